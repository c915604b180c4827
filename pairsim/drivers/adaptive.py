"""Meshes that follow from `accuracy`: the branch that makes them, and what run.json and warnings say of the outcome."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from pairsim.config.case import SceneCase
from pairsim.drivers.warnings import above
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.adaptation import ENOUGH, AdaptiveBranch, Scale, has_scale, reference_scale
from pairsim.solvers.curves.branch import Point
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import where

MOST_NAMED = 5  # distances that a warning names


@dataclass(frozen=True)
class LineOfScales:
    """The size of dU along a line of parameters.

    Attributes:
        ends: The first parameters, and the last ones where De or Ca_e changes, with the scale there.
    """

    ends: tuple[tuple[Parameters, Scale], ...]

    @property
    def first(self) -> Scale:
        """The scale at the first parameters."""
        return self.ends[0][1]

    def at(self, parameters: Parameters) -> float:
        """The size of dU [U_av], a power law of the parameter that changes."""
        if len(self.ends) == 1:
            return self.first.dU
        (a, start), (b, end) = self.ends

        def value(at: Parameters) -> float:
            return at.De if a.De != b.De else max(at.Ca_es)

        part = np.log(value(parameters) / value(a)) / np.log(value(b) / value(a))
        return float(start.dU ** (1 - part) * end.dU**part)


@dataclass(frozen=True)
class Adaptation:
    """The error wanted of a command, and the meshes that keep it.

    Attributes:
        wanted: Error wanted, as a part of the scale.
        scale: What it is a part of.
        branch: The branch with these meshes.
    """

    wanted: float
    scale: LineOfScales
    branch: AdaptiveBranch

    @classmethod
    def begin(
        cls,
        case: SceneCase,
        problem: SteadyProblem,
        first: Parameters,
        places: Sequence[tuple[float, ...]],
        *,
        last: Parameters | None = None,
        sensitivities: bool = False,
        mesh_error: bool = False,
        zeros_only: bool = False,
    ) -> Adaptation | None:
        """Find the scale and a first solution; None if there is no dU that an error could be compared to.

        Args:
            case: The case.
            problem: Its problem.
            first: Parameters of the first solution.
            places: Distances of the case.
            last: Parameters of the last solution, where De or Ca_e changes.
            sensitivities, mesh_error, zeros_only: See `AdaptiveBranch`.

        Raises:
            NoSteadyState: No solution was found at the first parameters.
            MeshFailure: A mesh could not be generated.
        """
        (found, scout), wanted = reference_scale(problem, first, places), case.error_wanted
        if not has_scale(found):
            scout.close()
            return None
        scale = LineOfScales(((first, found),))
        if last is not None and last != first:
            with suppress(NoSteadyState, MeshFailure):  # the last parameters may have no solution
                end, other = reference_scale(problem, last, places)
                other.close()
                scale = LineOfScales(((first, found), (last, end)) if has_scale(end) else ((first, found),))
        options: Any = {"allowed": lambda at: wanted * scale.at(at), "zeros_only": zeros_only, "scout": scout}
        branch = AdaptiveBranch(problem, first, mesh_error, sensitivities, **options)
        return cls(wanted, scale, branch)

    def size(self, points: Sequence[Point]) -> float:
        """The |dU| that errors are a part of: the largest of a curve, or the scale where there are few points."""
        peak = max((float(np.abs(point.dUs).max()) for point in points), default=0.0)
        return peak if len(points) >= ENOUGH else max(peak, self.scale.first.dU)

    def report(self, points: Sequence[Point], size: float | None = None) -> tuple[dict[str, Any], list[str]]:
        """The entry of run.json, and a warning of the points whose error is larger than wanted.

        Args:
            points: Points whose error should be kept.
            size: What errors are a part of [U_av]; None for the scale.
        """
        errors = {
            where(point.parameters): float(point.estimate.dU_error.max()) / (size or self.scale.at(point.parameters))
            for point in points
        }
        scales = [scale.dU for _, scale in self.scale.ends]
        missed = [place for place, error in errors.items() if error > self.wanted]
        worst = max(errors.values(), default=0.0)
        entry = {
            "wanted": self.wanted,
            "reached": worst,
            "kept": not missed,
            "reference_dU": size or (scales if len(scales) > 1 else scales[0]),
            "scout_dU": scales if len(scales) > 1 else scales[0],
            "scout_d": [gaps[0] if len(set(gaps)) == 1 else list(gaps) for gaps in self.scale.first.at],
            "rounds": max(self.branch.rounds.values(), default=0),
            "meshes": [
                {"d": gaps[0] if len(set(gaps)) == 1 else list(gaps), "unknowns": n, "rounds": self.branch.rounds[gaps]}
                for gaps, n in sorted(self.branch.unknowns.items())
            ],
        }
        if not missed:
            return entry, []
        more = f" and {len(missed) - MOST_NAMED} more" if len(missed) > MOST_NAMED else ""
        warning = (
            f"accuracy: {100 * self.wanted:g}% was not kept at {', '.join(missed[:MOST_NAMED])}{more}: dU_error is up "
            f"to {above(100 * worst, 100 * self.wanted)} % of the largest |dU| ({size or self.scale.first.dU:.3g})"
        )
        return entry, [warning]
