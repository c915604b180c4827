"""Load cases from files, dicts and other cases: `load`; laws of one's own in them: `use_laws`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal, overload

from pairsim.cases.case import SceneCase
from pairsim.cases.conversion import forget_numbers
from pairsim.cases.keys import groups_of
from pairsim.cases.run_case import Case
from pairsim.cases.yaml_file import merge, read_yaml
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import fitting, model_of, parse_case
from pairsim.physics.material import Material
from pairsim.physics.own_laws import file_of, load_file, name_file
from pairsim.physics.solids import Solid
from pairsim.results.folder import plain
from pairsim.runtime.errors import InputError

AnyCase = str | PathLike[str] | Mapping[str, Any] | SceneCase
"""Input for a case: the path of a case file, a dict of keys and values, or a case returned by `load`."""
DECLARED = "pairsim.physics.declared"  # the module that lists the laws for case files, once it is imported


@overload
def load(path_or_dict: AnyCase, *, kind: Literal["run"], **overrides: Any) -> Case: ...
@overload
def load(path_or_dict: AnyCase, *, kind: str | None = None, **overrides: Any) -> Any: ...


def load(path_or_dict: AnyCase, *, kind: str | None = None, **overrides: Any) -> SceneCase:
    """Load and validate a case.

    Args:
        path_or_dict: Path of a case file (YAML), a dict of its keys, or a case.
        kind: The computation that the case is for, such as "run" (in time) or "curve" (quasi-steady, over the
            distance); by default the first one that has all of its keys.
        overrides: Keys to replace, such as `Ca_e=0.05`. Groups are merged: `mesh={"Np": 20}` only changes this key of
            `mesh`. Dotted keys are written as `**{"mesh.Np": 20}`. `liquid` and `solid` may be laws of one's own, such
            as `liquid=FeneCR(L2=20)`.

    Returns:
        The validated case with all defaults, immutable.

    Raises:
        InputError: The file cannot be read, or a key or value is not allowed; the message says what is.

    Example:
        >>> pairsim.load({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}, mesh={"Np": 20}).mesh.Np
        20
    """
    if kind is not None and kind not in QUESTIONS:
        raise InputError("pairsim.load", "kind", kind, f"must be {' or '.join(QUESTIONS)}")
    if isinstance(path_or_dict, SceneCase):
        kind = kind or path_or_dict.kind
        if path_or_dict.kind == kind and not overrides:
            return path_or_dict  # valid already
    source = str(path_or_dict) if isinstance(path_or_dict, str | PathLike) else "case"
    data = content_of(path_or_dict)
    forget_numbers(data)
    keys = dict.fromkeys((*data, *(key.partition(".")[0] for key in overrides)))
    kind = kind or fitting(keys, QUESTIONS)[0]
    merge(data, _written(overrides, source), groups_of(model_of(kind)), source)
    return parse_case(QUESTIONS[kind], data, source)


def content_of(given: AnyCase) -> dict[str, Any]:
    """The keys and values of a file, of a dict or of a case; InputError for any other type."""
    if isinstance(given, SceneCase):
        return given.model_dump(mode="json", exclude_unset=True)
    if isinstance(given, Mapping):
        return _written(given, "case")
    if isinstance(given, str | PathLike):
        return read_yaml(Path(given))
    raise InputError("case", "", type(given).__name__, "must be the path of a case file, a dict of its keys, or a case")


def _written(keys: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Keys and values as a file has them; InputError where one cannot be written to a file."""
    try:
        return dict(plain(_with_blocks(keys)))
    except (TypeError, ValueError) as error:
        raise InputError(source, "", None, str(error)) from None


def use_laws(*laws: str | PathLike[str] | type[Material]) -> None:
    """Make laws of one's own known, before the first case is read; processes of sweeps know them, too.

    Args:
        laws: Files as for `--laws`, or classes that are defined in a file.

    Raises:
        InputError: A file or class cannot be used, or a case has been read already.
    """
    for each in laws:
        file = file_of(each) if isinstance(each, type) else Path(each)
        if file is None:  # it ships
            continue
        name_file(file)
        for law in [each] if isinstance(each, type) else load_file(file):
            if DECLARED in sys.modules and law.name not in sys.modules[DECLARED].LAWS:
                allowed = "must be known before the first case is read: import it, or call pairsim.use_laws, earlier"
                raise InputError("pairsim.use_laws", law.__name__, None, allowed)


def _with_blocks(keys: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a case with blocks in place of laws; the Ca_e of a solid is that of the case if this has none."""
    found = dict(keys)
    for key in ("liquid", "solid"):
        value = found.get(key)
        each = value if isinstance(value, list | tuple) else [value]
        if not any(isinstance(law, Material) for law in each):
            continue
        use_laws(*(type(law) for law in each if isinstance(law, Material)))
        blocks = [_block(law) if isinstance(law, Material) else law for law in each]
        found[key] = blocks if isinstance(value, list | tuple) else blocks[0]
        Ca_es = [law.Ca_e for law in each if isinstance(law, Solid)]
        if Ca_es:
            found.setdefault("Ca_e", Ca_es if len(Ca_es) > 1 else Ca_es[0])
    return found


def _block(law: Material) -> dict[str, Any]:
    return {"law": law.name} | {name: getattr(law, name) for name in law.parameters()}
