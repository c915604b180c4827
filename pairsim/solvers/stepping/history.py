"""Accepted values of the last steps of a time integration, and their errors."""

from __future__ import annotations

from dataclasses import dataclass, field

from pairsim.runtime.arrays import Array


@dataclass
class History:
    """Accepted values of the last steps, newest first. Lists and arrays are replaced, never changed in place.

    Attributes:
        t: Times of h and x, at most three [D_c/U_av].
        h: Positions of the material, shape (n_h,) each.
        x: Full vectors, shape (n,) each.
        y: Free unknowns on the present mesh, at most four, shape (n_y,) each; extrapolated for the next first guess.
        t_y: Times of y.
        frame: Axial positions in the tube of the frame in which the positions h are given, as many as these [D_c].
    """

    t: list[float] = field(default_factory=list)
    h: list[Array] = field(default_factory=list)
    x: list[Array] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    t_y: list[float] = field(default_factory=list)
    frame: list[float] = field(default_factory=list)

    def push(self, t: float, h: Array, x: Array, y: Array, frame: float = 0.0) -> None:
        self.t, self.h, self.x = [t, *self.t[:2]], [h, *self.h[:2]], [x, *self.x[:2]]
        self.frame = [frame, *self.frame[:2]]
        self.t_y, self.y = [t, *self.t_y[:3]], [y, *self.y[:3]]

    def forget_all_but_last(self) -> None:
        """Keep the values of the last step only, as at a start."""
        self.t, self.h, self.x, self.frame = self.t[:1], self.h[:1], self.x[:1], self.frame[:1]
        self.t_y, self.y = self.t_y[:1], self.y[:1]


@dataclass
class ErrorHistory(History):
    """Estimated exact minus discrete values of the last steps.

    Attributes:
        changes: Estimated errors of the goals with functionals of their own at the last steps, at most two, by name of
            the goal; without `imbalance`.
        imbalance: The part of the latest of these that is due to the imbalance of momentum after a remeshing, by the
            same names; it decays.
    """

    changes: list[dict[str, Array]] = field(default_factory=list)
    imbalance: dict[str, Array] = field(default_factory=dict)

    def forget_all_but_last(self) -> None:
        super().forget_all_but_last()
        self.changes = self.changes[:1]
