"""Quasi-steady scenes through pseudo-time, for places that Newton does not reach at once."""

from __future__ import annotations

from dataclasses import replace

from pairsim.runtime.signals import heed
from pairsim.solvers.newton import Report
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import Steady

# First and last step of pseudo-time, in relaxation times; doubled each, eleven steps lie between them.
RELAX_FIRST, RELAX_LAST = 0.1, 200.0
MOST_RELAXED = 40


def relax(steady: Steady, parameters: Parameters) -> Report:
    """Solve through pseudo-time: s relaxes in growing implicit steps while all else stays in balance.

    Args:
        steady: A scene in a viscoelastic liquid, at a solution, which is the guess.
        parameters: Where.

    Returns:
        The last step's report. On success the solution is the scene's.
    """
    newton = steady.newton
    h_star, y, dt = steady.apply(parameters), steady.y, RELAX_FIRST * parameters.De
    steady.forget()
    liquid = steady.scene.liquid
    for _ in range(MOST_RELAXED):
        heed(steady.comm)
        liquid.constants["rate"].value = 1 / dt if dt < RELAX_LAST * parameters.De else 0.0
        _, x = newton.state(y)
        liquid.set_star(x[: liquid.size])
        newton.forget()
        new, report = newton.solve(y, h_star, 1.0, 0.0)
        steady.iterations += report.iterations
        steady.factorisations += report.factorisations
        if report.converged and steady.distortion_of(*newton.state(new)) > 0:
            y = new
            if liquid.constants["rate"].value == 0.0:
                steady.y, steady.parameters = y, parameters
                return report
            dt *= 2.0
        else:
            dt /= 4
            if dt < 1e-3 * RELAX_FIRST * parameters.De:
                break
    # Where stress grows for ever, steps would go on being taken.
    steady.apply(steady.parameters)
    reason = "stress keeps growing in pseudo-time" if report.converged else report.reason
    return replace(report, converged=False, reason=reason)
