"""The case of an experiment, made from its quantities and from measurements of its liquid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import keys_of
from pairsim.cases.physical import BLOCK
from pairsim.cases.physical_keys import Physical
from pairsim.cases.unit_registry import as_texts
from pairsim.lab.cytometer.suspending_media import methyl_cellulose
from pairsim.lab.driving_pressure import velocity_for
from pairsim.lab.load import load
from pairsim.physics.liquids import LAWS
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import Argument, InputError

if TYPE_CHECKING:
    from pairsim.lab.rheometer.rheology_of_case import Listener, MeasuredLiquid

WATER = "1000 kg/m^3"


class OfExperiment(NamedTuple):
    """The case of an experiment, and what it is made of."""

    case: SceneCase
    quantities: dict[str, Any]  # of its `physical` block, as given or as derived from what was given
    keys: dict[str, Any]  # its other keys, likewise
    fit: MeasuredLiquid | None  # the liquid that was fitted to files of a rheometer; None without such files


def case_of_experiment(
    *,
    kind: str = "run",
    pressure: str | None = None,
    over: str | None = None,
    rheology: Path | str | None = None,
    spectrum: Path | str | None = None,
    section: str | Sequence[str] = (),
    listener: Listener | None = None,
    carrier: str | None = None,
    celsius: float = 23.0,
    **given: Any,
) -> OfExperiment:
    """Make the case of an experiment; arguments are those of `units`.

    Raises:
        InputError: A quantity is missing, or is wrong.
    """
    quantities = {
        **(given.pop(BLOCK, None) or {}),
        **{key: given.pop(key) for key in Physical.model_fields if key in given},
    }
    quantities = {key: as_texts(each) for key, each in quantities.items()}
    fit = None
    if carrier is not None:
        if "liquid" in given:
            raise InputError("pairsim units", Argument("liquid"), given["liquid"], "must be left out with `carrier`")
        given["liquid"], quantities["consistency"] = _liquid_of(carrier, celsius)
    if rheology is not None or spectrum is not None:
        from pairsim.lab.rheometer.rheology_of_case import fit_liquid

        fit = fit_liquid(rheology, spectrum, given.get("liquid"), section, quantities, listener)
        given["liquid"] = fit.block
        quantities |= fit.quantities
    if isinstance(sizes := quantities.get("particle"), list | tuple):
        given.setdefault("particles", len(sizes))
    if not quantities.keys() & {"modulus", "young"}:
        given.setdefault("Ca_e", 0)
    if not quantities.keys() & {"distance", "spacing"} and kind in QUESTIONS:
        model: type[SceneCase] = QUESTIONS[kind].model
        given = {name: key.usual for name, key in keys_of(model).items() if key.usual is not None} | given

    def case_with(**more: str) -> SceneCase:
        try:
            return load({**given, BLOCK: {"density": WATER, **quantities, **more}}, kind=kind)
        except InputError as error:
            of_fit = {f"{BLOCK}.{key}" for key in fit.fitted} if fit else ()
            for each in error.mistakes:
                if each.key in of_fit:
                    each.allowed += "; the value is that of the fit, so that no case can be made of this liquid here"
            raise

    if pressure is not None or over is not None:
        pressure, over = _checked_pressure(pressure, over, quantities)
        quantities["velocity"] = velocity_for(pressure, over, lambda velocity: case_with(velocity=velocity))
    return OfExperiment(case_with(), quantities, given, fit)


def _liquid_of(carrier: str, celsius: float) -> tuple[Mapping[str, str | float], str]:
    """The law of a carrier, as the value of `liquid` in a case, and its consistency with its unit."""
    K, n = methyl_cellulose(carrier, celsius)
    power_law = next(name for name, law in LAWS.items() if law.parameters().keys() == {"n"})
    return {"law": power_law, "n": round(n, 6)}, f"{K:.6g}Pa.s^{n:.6f}"


def _checked_pressure(pressure: str | None, over: str | None, quantities: Mapping[str, object]) -> tuple[str, str]:
    """A pressure drop and the length of tube over which it falls, given in place of the flow.

    Raises:
        InputError: One of them is missing, or the flow is given, too.
    """
    if pressure is None or over is None:
        missing, other = ("over", "pressure") if over is None else ("pressure", "over")
        allowed = f"must be given with `{other}`, such as `pressure` 20kPa `over` 5cm"
        raise InputError("pairsim units", Argument(missing), None, allowed)
    for key in quantities.keys() & {"flow_rate", "velocity"}:
        raise InputError("pairsim units", f"{BLOCK}.{key}", quantities[key], "must be left out with `pressure`")
    return pressure, over
