"""The quantities of an experiment: the declarations of the keys of the `physical` block of a case.

De = lambda U_av/D_c and Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone
(2024).
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace

from pairsim.physics.declared import DIMENSIONS
from pairsim.physics.solids.solid import MODULUS
from pairsim.quantities.kinds import DENSITY as OF_DENSITY
from pairsim.quantities.kinds import FLOW_RATE, PERCENTAGE, TIME, VELOCITY
from pairsim.quantities.measurable import EACH, MEAN, Measurable, Usual, a_length
from pairsim.runtime.plain import Plain

BLOCK = "physical"
RANGE_OF_LENGTHS = "{start: 5 um, stop: 40 um, num: 9}"

TUBE = a_length(
    "tube",
    "inner diameter of the tube D_c",
    symbol="D_c",
    uncertain=True,
    usual=Usual(1e-7, 1.0, "100 nm to 1 m"),
)
DENSITY = Measurable(
    "density",
    OF_DENSITY,
    "density of the liquid, used only for the Reynolds number",
    "1000 kg/m^3",
    r"\rho",
    usual=Usual(10.0, 3e4, "10 to 30,000 kg/m^3"),
    in_captions=False,
    default="water",
)
DIFFERENCE = Measurable(
    "particle_difference",
    PERCENTAGE,
    "relative difference of the diameters of two particles, (leading - trailing)/mean, where `particle` is the mean",
    "0 +- 1 %",
    r"\delta",
    uncertain=True,
    by="difference",
)
EXPERIMENT = (
    TUBE,
    Measurable(
        "flow_rate",
        FLOW_RATE,
        "flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)",
        "1 ul/min",
        "Q",
        uncertain=True,
        usual=Usual(1e-18, 1e-2, "1 pl/s to 10 l/s"),
        short="flow",
    ),
    Measurable(
        "velocity",
        VELOCITY,
        "mean velocity of the liquid U_av, in place of flow_rate",
        "5 mm/s",
        "U_{av}",
        uncertain=True,
        usual=Usual(1e-10, 100.0, "0.1 nm/s to 100 m/s"),
    ),
    a_length(
        "particle",
        "diameter D_p; gives beta = D_p/D_c",
        "20 um",
        "D_p",
        gives=("beta",),
        many=True,
        uncertain=True,
        each="spread.diameter",
        usual=Usual(1e-8, 0.1, "10 nm to 10 cm"),
    ),
    DIFFERENCE,
    MODULUS,
    replace(  # an incompressible material has E = 3 G_p
        MODULUS,
        key="young",
        words="Young's modulus E = 3 G_p, in place of modulus",
        example="15 kPa",
        symbol="E",
        times=3.0,
        usual=Usual(1.0, 1e12, "1 Pa to 1000 GPa"),
        default="",
    ),
    DENSITY,
    a_length(
        "distance",
        "distance between the facing surfaces; gives d0 of a run, d of curve, critical, train and stream",
        "5 um",
        "d_0",
        gives=("d", "d0"),
        ranged=True,
    ),
    a_length(
        "spacing",
        "distance between the centres of neighbours; gives train.spacing",
        "30 um",
        "s",
        gives=("train.spacing",),
    ),
    a_length(
        "capillary",
        "length of tube along which beads are followed; gives row.tube of train, stream.tube",
        "40 cm",
        "L",
        gives=("row.tube", "stream.tube"),
    ),
    a_length(
        "contact",
        "distance at which beads touch; gives row.min_gap of train, stream.min_gap",
        "100 nm",
        r"d_\mathrm{min}",
        gives=("row.min_gap", "stream.min_gap"),
    ),
    a_length(
        "drop",
        "volume of a drop, or the length of tube that holds this volume; gives stream.drop",
        "100 um",
        gives=("stream.drop",),
        as_volume="0.28 nl",
    ),
    Measurable(
        "concentration",
        PERCENTAGE,
        "volume fraction of the beads in the suspension; gives stream.concentration",
        "1 %",
        r"\phi",
        gives=("stream.concentration",),
    ),
    Measurable(
        "end",
        TIME,
        "end time of a run; gives time.end",
        "2 ms",
        gives=("time.end",),
        in_captions=False,
        default="from De and Ca_e",
    ),
)
"""Quantities that set the scales, or that give keys of cases."""
KEYS = {each.key: each for each in (*EXPERIMENT, *DIMENSIONS.values())}
"""All keys of the block: those of an experiment, then those from which parameters of materials follow."""
DEVIATIONS = {each.deviation.key: each.deviation for each in KEYS.values() if each.each}
"""The standard deviations of quantities that may differ among the particles, such as "particle.each"."""
QUANTITIES = KEYS | DEVIATIONS
"""All quantities that the block may give."""


def with_deviations(given: Mapping[str, Plain]) -> dict[str, Plain]:
    """The quantities of a block, with standard deviations among the particles as entries of their own.

    `{"particle": {"mean": "24 um", "each": "0.5 um"}}`, or `{"particle": "24 um each 0.5 um"}`, becomes
    `{"particle": "24 um", "particle.each": "0.5 um"}`; a deviation such as 2 % is that part of the mean.
    """
    found = dict[str, Plain]()
    for key, value in given.items():
        of, both = KEYS.get(key), _in_words(value) if isinstance(value, str) else value
        if of is not None and of.each and isinstance(both, Mapping) and both.keys() == {MEAN, EACH}:
            found |= {key: both[MEAN], of.deviation.key: _absolute(both[EACH], both[MEAN])}
        else:
            found[key] = value
    return found


def _in_words(text: str) -> Plain:
    """Mean and standard deviation in a text such as "24 um each 0.5 um"; any other text unchanged."""
    mean, word, deviation = text.partition(f" {EACH} ")
    return {MEAN: mean.strip(), EACH: deviation.strip()} if word else text


def _absolute(deviation: Plain, mean: Plain) -> Plain:
    """A deviation in per cent of a mean in the unit of this mean; anything else unchanged."""
    if not (isinstance(deviation, str) and deviation.rstrip().endswith("%") and isinstance(mean, str)):
        return deviation
    from pairsim.cases.quantity_text import as_given, percentage

    with suppress(ValueError):
        number, unit = as_given(mean)
        return f"{number * percentage(deviation)[0]:.12g} {unit}"
    return deviation
