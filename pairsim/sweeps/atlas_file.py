"""The keys of atlas files, and the checks that involve several of them; `atlas_building.py` chooses the curves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from pairsim.cases.keys import Keys
from pairsim.cases.mistakes import Mistake
from pairsim.cases.values import Whole
from pairsim.sweeps.grid_file import MOST_CASES, Changes, FolderName, as_list

Ends = tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]]

Ratios = tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)]]

PER_ROUND = 6  # curves; after each round the atlas is fitted anew


class AtlasFile(Keys):
    """An atlas file: a box of parameters, in which master curves are computed where they tell most."""

    name: FolderName | None = Field(None, description="name of the folder of the atlas; default: that of the file")
    base: Changes = Field({}, description="keys that all curves share, or the path of a case file")
    beta: Ends = Field(description="smallest and largest diameter of the particles [D_c]", examples=[[0.3, 0.5]])
    De: Ends = Field(description="smallest and largest Deborah number", examples=[[0, 1]])
    Ca_e: Ends = Field(description="smallest and largest elastic capillary number", examples=[[0, 0.1]])
    d: Ends = Field((0.02, 2.0), description="smallest and largest distance [D_c]")
    curves: Whole = Field(
        0,
        ge=0,
        le=MOST_CASES,
        description=f"number of curves, in rounds of {PER_ROUND} (the first round has up to {8 + PER_ROUND // 2})",
    )
    start: str | list[str] = Field(
        [],
        description="file of an atlas, to which the curves are added; or several files: the first is an atlas of this "
        "box and base, and of the others the curves within the box are taken, as those of a Newtonian liquid at De = 0",
    )
    within: dict[Literal["beta", "De", "Ca_e"], Ends] = Field(
        {},
        description="part of the box in which curves are added to those of start; default: the whole box",
        examples=["{De: [0, 0.3]}"],
    )
    diameters: Ratios | None = Field(
        None,
        description="smallest and largest ratio of the diameters, leading to trailing particle: curves of unequal "
        "pairs, drawn at random from the box and the ratios, are added to those of start; must go with moduli",
        examples=[[0.9, 1.1]],
    )
    moduli: Ratios | None = Field(
        None,
        description="smallest and largest ratio of the moduli, likewise; without effect on rigid particles",
        examples=[[0.5, 2]],
    )
    beads: Whole = Field(
        0,
        ge=0,
        le=MOST_CASES,
        description="number of single particles that are computed as well; their velocities are those of pairs far "
        "apart",
    )
    recompute: bool = Field(
        False,
        description="instead of adding curves, compute those of start again, with its unequal pairs and single "
        "particles, as after a change of version",
    )
    seed: Whole = Field(0, description="seed of the random numbers from which candidate curves are drawn")

    @property
    def of_unequal(self) -> bool:
        """Whether curves are those of pairs whose particles differ."""
        return self.diameters is not None and self.moduli is not None

    @property
    def starts(self) -> list[str]:
        """The values of `start`, in a list."""
        return as_list(self.start)


def check_atlas(file: AtlasFile) -> Iterator[Mistake]:
    """Check the keys of an atlas file; yields mistakes."""
    for key in ("beta", "De", "Ca_e", "d"):
        low, high = getattr(file, key)
        if not low < high and (key in ("beta", "d") or low > high):
            yield Mistake(key, [low, high], "must be the smallest and the largest value")
    for key, (low, high) in file.within.items():
        if not getattr(file, key)[0] <= low <= high <= getattr(file, key)[1]:
            yield Mistake(f"within.{key}", [low, high], f"must be a part of {key}: {list(getattr(file, key))}")
    if file.within and not file.start:
        yield Mistake("within", None, "must be left out without start: the first curves are at the corners of the box")
    yield from _check_ratios(file)
    yield from _check_curves(file)
    if file.De[1] == file.Ca_e[1] == 0:
        yield Mistake(
            "Ca_e", list(file.Ca_e), "must end above 0, or De must: dU of rigid pairs vanishes in Newtonian liquids"
        )


def _check_curves(file: AtlasFile) -> Iterator[Mistake]:
    """Check the keys that say which curves are computed."""
    if not file.recompute:
        if not file.curves:
            yield Mistake("curves", None, "must be the number of curves, at least 1")
        return
    if len(file.starts) != 1:
        yield Mistake(
            "start", file.start or None, "must be a single atlas with recompute, which computes its curves again"
        )
    for key in ("curves", "within", "diameters", "beads"):
        if value := getattr(file, key):
            yield Mistake(key, value, "must be left out with recompute: the curves are those of start")


def _check_ratios(file: AtlasFile) -> Iterator[Mistake]:
    """Check the keys of pairs whose particles differ."""
    for key, other in (("diameters", "moduli"), ("moduli", "diameters")):
        if (ends := getattr(file, key)) is None:
            continue
        if not ends[0] <= 1 <= ends[1]:
            yield Mistake(key, list(ends), "must be the smallest and the largest ratio, with 1 between them")
        if getattr(file, other) is None:
            yield Mistake(other, None, f"must be given with {key}, such as [1, 1]")
        elif not file.start:
            yield Mistake(key, list(ends), "must go with start: pairs that differ are added to an atlas of equal ones")
        elif file.within:
            yield Mistake("within", None, f"must be left out with {key}")
    if file.beads and not file.of_unequal:
        yield Mistake("beads", file.beads, "must go with diameters and moduli")
