"""What a quasi-steady solution answers to small changes: of the parameters, and of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import DIFFERENCE, Steady


def drift(steady: Steady) -> Array:
    """Change of the particles' velocities by what a quasi-steady scene leaves out, to first order, (N,).

    The distances change at the rates dU, and with them the shapes and s; the velocity of the surfaces, that of the
    mesh and ds/dt that follow from this are put into the full residual. `factor` first.
    """
    scene, constraints, now = steady.scene, steady.constraints, steady.parameters
    U = steady.y[constraints.fields["U_p"]]
    rates = np.diff(U)
    fastest = float(np.abs(rates).max(initial=0.0))
    if fastest == 0.0:
        return np.zeros(len(U))

    def along(tau: float) -> Parameters:
        return replace(now, gaps=tuple(np.add(now.gaps, tau * rates / fastest)))

    y_t = fastest * steady.tangent(along)
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
    change: Array = -steady.newton.linear_solve(neglected)[constraints.fields["U_p"]]
    return change


def sensitivities(steady: Steady) -> dict[str, Array]:
    """Derivatives of every dU, (N-1,), by what the scene has of Ca_e, De and beta, at the same distances.

    Particles that differ keep the ratios of their values; the derivative is by the largest. One transposed solve a
    gap serves all parameters. `factor` first.
    """
    now, velocities = steady.parameters, steady.constraints.fields["U_p"]
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
    adjoints = []
    for i in range(len(velocities) - 1):
        row = np.zeros(steady.constraints.size)
        row[velocities[[i, i + 1]]] = -1.0, 1.0
        adjoints.append(steady.newton.linear_solve(row, transposed=True))
    return {name: -np.array([adjoint @ change for adjoint in adjoints]) for name, change in changes.items()}
