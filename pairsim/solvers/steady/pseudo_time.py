"""Pseudo-transient continuation of quasi-steady scenes, for parameters at which Newton's method fails.

The method is that of Kelley and Keyes (1998), in which only the transported fields of the liquid, such as the
log-conformation, have a time derivative.
"""

from __future__ import annotations

from dataclasses import replace

from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.scene import SteadySolver

# All were chosen.
FIRST_STEP = 0.1  # of pseudo-time, in relaxation times; steps are doubled each time
LAST_STEP = 200.0
MOST_STEPS = 40


def relax(steady: SteadySolver, parameters: Parameters) -> Report:
    """Solve by implicit pseudo-time steps of increasing size for the transported fields; all else is in equilibrium.

    Args:
        steady: A scene in a liquid with a memory, with a first guess in `y`. It is left at the new solution, or
            unchanged in case of failure.
        parameters: Parameters at which to solve.

    Returns:
        Report of the last step.
    """
    newton, liquid, longest = steady.newton, steady.scene.liquid, parameters.liquid.longest
    steady.forget()
    with steady.changed_to(parameters) as update:
        y, dt = steady.y, FIRST_STEP * longest
        for _ in range(MOST_STEPS):
            steady.problem.monitor.check()
            liquid.constants["rate"].value = 1 / dt if dt < LAST_STEP * longest else 0.0
            _, x = steady.constraints.state(y, update)
            liquid.set_star(x[: liquid.size])
            newton.forget()
            new, report = newton.solve(y, update)
            steady.iterations += report.iterations
            steady.factorisations += report.factorisations
            if report.converged and steady.distortion_of(*steady.constraints.state(new, update)) > 0:
                y = new
                if liquid.constants["rate"].value == 0.0:
                    steady.y, steady.parameters = y, parameters
                    return report
                dt *= 2.0
            else:
                dt /= 4
                if dt < 1e-3 * FIRST_STEP * longest:
                    break
    # If the stress grows without bound, every step may converge although no steady state is reached.
    reason = "no steady state was reached in pseudo-time" if report.converged else report.reason
    return replace(report, converged=False, reason=reason)
