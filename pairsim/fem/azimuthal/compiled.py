"""Compiled bilinear forms of disturbances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import ufl

from pairsim.fem.azimuthal import fields
from pairsim.fem.azimuthal.calculus import Angle
from pairsim.fem.azimuthal.forms import Terms, disturbed_liquid, disturbed_solid, linearised
from pairsim.fem.phases.compiled_form import CompiledForm, compiled
from pairsim.fem.phases.compiled_phase import COORDINATE, QUADRATURE_DEGREE, mixed_element, split
from pairsim.physics.fields import PRESSURE_OF_SOLID, Field
from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid


@dataclass(frozen=True, eq=False)
class CompiledDisturbance:
    """The bilinear form of the disturbances of a kind of phase, compiled without a mesh.

    Attributes:
        fields: The disturbances, in the order of the mixed element.
        base_fields: Fields of the axisymmetric solution.
        form: The form.
        base: Coefficient of the axisymmetric solution.
        constants: Constants of the form by name.
    """

    fields: tuple[Field, ...]
    base_fields: tuple[Field, ...]
    form: CompiledForm
    base: ufl.Coefficient
    constants: dict[str, ufl.Constant]


_COMPILED: dict[tuple[object, ...], CompiledDisturbance] = {}


def _compile(
    kind: tuple[object, ...],
    unknown: tuple[Field, ...],
    base_fields: tuple[Field, ...],
    names: tuple[str, ...],
    build: Callable[[Terms, Angle], ufl.Form],
) -> CompiledDisturbance:
    """Compile the form of a kind of phase, or return it if it was compiled before."""
    if kind not in _COMPILED:
        mesh = ufl.Mesh(COORDINATE)
        space, base_space = (ufl.FunctionSpace(mesh, mixed_element(each)) for each in (unknown, base_fields))
        x, base, test = ufl.Coefficient(space), ufl.Coefficient(base_space), ufl.TestFunction(space)
        constants = {name: ufl.Constant(mesh, count=i) for i, name in enumerate(names)}  # see `compiled_phase`
        dx = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
        parts = split(base, base_fields), split(x, unknown), split(test, unknown)
        form = linearised(build, Terms(mesh, *parts, constants, dx), x)
        _COMPILED[kind] = CompiledDisturbance(unknown, base_fields, compiled(form), base, constants)
    return _COMPILED[kind]


def liquid_disturbance(liquid: Liquid, base_fields: tuple[Field, ...]) -> CompiledDisturbance:
    """The compiled form of the disturbances of a liquid.

    Args:
        liquid: The liquid; the form depends on its laws.
        base_fields: Fields of the axisymmetric solution, including the velocity w of the mesh.
    """
    kind, names = (liquid.structure, base_fields), (*liquid.numbers, "rate", "Re")
    return _compile(kind, fields.of_liquid(liquid), base_fields, names, disturbed_liquid(liquid))


UNDEFORMED = Field("X", 2, 2, odd=(1,))


def solid_disturbance(solid: Solid, *, volume_modulus: bool) -> CompiledDisturbance:
    """The compiled form of the disturbances of a solid.

    Its axisymmetric solution is given by the undeformed positions and the pressure.
    """
    kind = (solid.name, volume_modulus)
    base = (UNDEFORMED, PRESSURE_OF_SOLID)
    unknown = [
        fields.DISPLACEMENT,
        fields.PRESSURE,
        *([fields.MATERIAL_VELOCITY] if solid.viscosity is not None else []),
    ]
    return _compile(kind, tuple(unknown), base, tuple(solid.numbers), disturbed_solid(solid, volume_modulus))
