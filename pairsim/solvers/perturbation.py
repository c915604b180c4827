"""First-order perturbations of a quasi-steady solution: sensitivities to parameters, and slow drift in time.

See "Sensitivities" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.adjoints import Adjoints
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import DIFFERENCE, Steady


def drift(steady: Steady, adjoints: Adjoints) -> Array:
    """Change of the particles' velocities by the terms that the quasi-steady equations neglect, to first order.

    The distances change at the rates dU, and with them the shapes and s. The resulting velocities of the surfaces and
    of the mesh and ds/dt are inserted into the complete residual; the adjoints give the change of the velocities.

    Args:
        steady: The scene, at a solution; its matrix must have been assembled by `Steady.factor`.
        adjoints: The adjoints of the solution.

    Returns:
        Changes of the velocities [U_av], shape (N,).
    """
    scene, constraints, now = steady.scene, steady.constraints, steady.parameters
    U = steady.y[constraints.fields["U_p"]]
    rates = np.diff(U)
    fastest = float(np.abs(rates).max(initial=0.0))
    if fastest == 0.0:
        return np.zeros(len(U))

    def along(tau: float) -> Parameters:
        return replace(now, gaps=tuple(np.add(now.gaps, tau * rates / fastest)))

    y_t = rates @ steady.gap_tangents()
    ends = [steady.h_star(along(tau)) for tau in (DIFFERENCE, -DIFFERENCE)]
    h_t = fastest * (ends[0] - ends[1]) / (2 * DIFFERENCE) + constraints.M @ y_t
    (h, x), liquid = steady.state(), scene.liquid
    means = []
    for body, at in zip(steady.bodies, scene.nodes.interfaces, strict=True):
        if body.phase is None:
            means.append(float(h_t[body.start]))
            continue
        moved = body.displacement(h_t)
        means.append(body.quadrature.mean(moved[:, 0], body.phase.six_node_mesh.points + body.displacement(h)))
        for c in range(2):
            x[liquid.index("u", at, c)] += moved[body.nodes, c] - (means[-1] if c == 0 else 0.0)
    if scene.polymer is not None:
        x_t = constraints.N @ y_t + constraints.C @ h_t
        vertices = liquid.six_node_mesh.vertices
        for c, frame in enumerate((float(np.mean(U - means)), 0.0)):
            x[liquid.index("w", vertices, c)] = frame + x_t[liquid.index("eta", vertices, c)]
        star = x[: liquid.size].copy()
        start, stop = liquid.offsets["s"], liquid.offsets["s"] + liquid.nodal("s", x).size
        star[start:stop] -= x_t[start:stop]
        liquid.set_star(star)
        liquid.constants["rate"].value = 1.0
    neglected = steady.newton.reduce(x) - steady.residual()
    return np.asarray(-adjoints.velocities @ neglected)


def sensitivities(steady: Steady, adjoints: Adjoints) -> dict[str, Array]:
    """Derivatives of the relative velocities dU with respect to Ca_e, De and beta at fixed distances, by the adjoint.

    If the values of the particles differ, their ratios are fixed and the derivative is with respect to the largest
    value. One adjoint for each velocity gives the derivatives with respect to all parameters (Giles and Pierce 2000).

    Args:
        steady: The scene, at a solution.
        adjoints: The adjoints of the solution.

    Returns:
        Derivatives by name of the parameter, shape (N-1,) each: "beta", and "Ca_e" and "De" if they are not zero.
    """
    now = steady.parameters
    lines: dict[str, tuple[float, Callable[[float], Parameters]]] = {}
    if any(now.Ca_es):
        lines["Ca_e"] = (
            max(now.Ca_es),
            lambda tau: replace(now, Ca_es=tuple(Ca_e * (1 + tau) for Ca_e in now.Ca_es)),
        )
    if steady.scene.polymer is not None:
        lines["De"] = now.De, lambda tau: replace(now, De=now.De * (1 + tau))
    lines["beta"] = max(steady.problem.betas), lambda tau: replace(now, size=now.size * (1 + tau))
    changes = {name: steady.residual_change(line) / value for name, (value, line) in lines.items()}
    return {name: np.asarray(np.diff(-adjoints.velocities @ change)) for name, change in changes.items()}
