"""Report of a nonlinear solve."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Report:
    """Result of a nonlinear solve.

    Attributes:
        converged: Whether the tolerance was met.
        iterations: Number of Newton iterations (linear solves).
        factorisations: Number of numeric factorisations.
        reason: "converged", or the reason of the failure.
        steps: Norm of the last step of each field, relative to the field.
        residual: Euclidean norm of the last residual.
    """

    converged: bool
    iterations: int
    factorisations: int
    reason: str
    steps: dict[str, float]
    residual: float
