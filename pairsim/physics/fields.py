"""Fields of a phase: unknowns at the nodes of its mesh, and what forms, meshes and solvers must know of each.

A liquid has velocity, pressure and the fields that its laws declare, which are transported with the liquid, such as the
conformation of a polymer. What has to be done for each of them is done in a loop over `Liquid.fields` or
`Liquid.transported`; no other file knows which fields there are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Field:
    """A field of a phase.

    Attributes:
        name: Its symbol.
        degree: Lagrange degree on triangles, 1 or 2.
        components: Number of components.
        odd: Components that are odd functions of r; the others are even.
        transported: Whether it is transported with the liquid. It then has a time derivative and a history, is equal at
            periodic ends, and has the values of the developed flow (`PipeState.fields`) at prescribed ends.
        rest: Value of every component in a liquid at rest.
        free: Name of its free unknowns in a scene; by default `name`.
        carried: Whether it is interpolated to a new mesh; otherwise it follows from other unknowns there.
        step_weight: Weight of the root mean square of its local error in the norm of a time step, in which the
            positions of the material have the weight 1; 0 where its error does not count.
        most_change: Largest change of a nodal value in a predictor step of a continuation.
    """

    name: str
    degree: int
    components: int = 1
    odd: tuple[int, ...] = ()
    transported: bool = False
    rest: float = 0.0
    free: str = ""
    carried: bool = True
    step_weight: float = 0.0
    most_change: float = math.inf

    @property
    def unknowns(self) -> str:
        """Name of its free unknowns in a scene."""
        return self.free or self.name

    def times(self, count: int) -> Field:
        """One field with the components of `count` fields of this kind, one after the other."""
        odd = tuple(self.components * i + c for i in range(count) for c in self.odd)
        return replace(self, components=self.components * count, odd=odd)


VELOCITY = Field("u", 2, 2, odd=(1,))
PRESSURE = Field("p", 1, free="p_f")
DISPLACEMENT = Field("eta", 2, 2, odd=(1,), carried=False)
"""Displacement of a solid, or of the mesh of a liquid."""
MESH_VELOCITY = Field("w", 1, 2, odd=(1,), carried=False)
"""Velocity of the mesh in a quasi-steady liquid with a memory."""
PRESSURE_OF_SOLID = replace(PRESSURE, free="p_s")
