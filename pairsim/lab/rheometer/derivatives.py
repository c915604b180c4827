"""Derivatives of what a rheometer measures by the numbers of a viscoelastic liquid, whose modes are of one law.

A quantity of `Measured` is eta_0 [xi s + (1 - xi) sum_i w_i q_i], where s is the part of the solvent and q_i that of
mode i, which depends on its relaxation time and on the numbers a of the law. In steady shear the rate of change
R(c, Wi, a) of the conformation c of a mode vanishes, so that dc = -(dR/dc)^-1 dR; R is differentiated by complex steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pairsim.lab.rheometer.measured import FLOW, OSCILLATION
from pairsim.physics.conformation import mode_stress, relaxation
from pairsim.physics.homogeneous import ShearMemory, steady_shear
from pairsim.physics.liquids import ConformationLaw, Liquid, single
from pairsim.runtime.arrays import Array, Indices

STEP = 1e-30  # complex step, which causes no cancellation


@dataclass(frozen=True)
class Parts:
    """A quantity at n shear rates or frequencies as a sum over solvent and M modes, for a law with K numbers.

    Attributes:
        solvent: The part s of the solvent, (n,).
        modes: The parts q_i of the modes, (M, n).
        by_time: Their derivatives by the logarithms of their relaxation times, (M, n).
        by_numbers: Their derivatives by the numbers of the law, (K, M, n).
    """

    solvent: Array
    modes: Array
    by_time: Array
    by_numbers: Array

    def at(self, i: Indices) -> Parts:
        """These parts at some of the rates or frequencies."""
        return Parts(*(each[..., i] for each in (self.solvent, self.modes, self.by_time, self.by_numbers)))


class Sheared(ShearMemory):
    """A memory of steady shear that exposes its last solution, for modes that differ only in times and weights.

    Attributes:
        Wi: Weissenberg numbers of the first mode at all rates, then those of the second, ..., (M n,).
        gamma2: Squares of the shear rates there, (M n,).
        c: Conformations there, (4, M n).
    """

    Wi: Array
    gamma2: Array
    c: Array

    def solution(self, points: Any, mode: int) -> Array:
        self.Wi, self.gamma2, self.c = points.Wi, points.gamma2, super().solution(points, mode)
        return self.c


def numbers_of(liquid: Liquid, eta_0: float) -> Array:
    """The numbers by which `slopes` differentiates, shape (2 + 2 M + K,).

    They are log eta_0, xi, the weights and the logarithms of the relaxation times of all modes, and those of their law.
    """
    weights = [mode.weight for mode in liquid.modes]
    times = [np.log(liquid.relaxation_time(mode)) for mode in liquid.modes]
    return np.array([np.log(eta_0), liquid.xi, *weights, *times, *liquid.modes[0].numbers.values()])


def slopes(liquid: Liquid, x: dict[str, Array], memory: Sheared) -> Array:
    """Derivatives of the logarithms of quantities of `Measured` by `numbers_of` a liquid.

    Args:
        liquid: The liquid.
        x: Shear rates [1/s] or frequencies [rad/s] by the name of the quantity, of n values together.
        memory: Has the steady shear of a similar liquid at the same rates, from which Newton's method starts.

    Returns:
        Derivatives, (n, 2 + 2 M + K).
    """
    found = dict[str, Array]()
    weights = np.array([mode.weight for mode in liquid.modes])
    for names in (FLOW, OSCILLATION):
        if own := [x[name] for name in names if name in x]:
            every = np.unique(np.concatenate(own))
            parts = _in_oscillation(liquid, every) if names is OSCILLATION else _in_shear(liquid, every, memory)
            for name, of_all in zip(names, parts, strict=True):
                if name in x:
                    of = of_all.at(np.searchsorted(every, x[name]))
                    polymer, rest = weights @ of.modes, 1 - liquid.xi
                    total = liquid.xi * of.solvent + rest * polymer
                    by_weights, by_times = rest * of.modes, rest * weights[:, None] * of.by_time
                    by_numbers = rest * np.einsum("m,kmn->kn", weights, of.by_numbers)
                    rows = [total[None], (of.solvent - polymer)[None], by_weights, by_times, by_numbers]
                    found[name] = (np.concatenate(rows) / total).T
    return np.concatenate([found[name] for name in x])


def _in_oscillation(liquid: Liquid, frequency: Array) -> tuple[Parts, Parts]:
    """Storage and loss modulus over eta_0 at frequencies, (n,)."""
    x = np.array([[liquid.relaxation_time(mode)] for mode in liquid.modes]) * frequency
    none = np.zeros((len(liquid.modes[0].numbers), *x.shape))
    below = 1 / (1 + x**2)
    storage = Parts(0 * frequency, frequency * x * below, frequency * x * (1 - x**2) * below**2, none)
    return storage, Parts(frequency, frequency * below, -2 * frequency * (x * below) ** 2, none)


def _in_shear(liquid: Liquid, rates: Array, memory: Sheared) -> tuple[Parts, Parts]:
    """Viscosity and first normal stress difference over eta_0 at shear rates, (n,)."""
    steady_shear(liquid, rates, memory)
    law = replace(liquid.modes[0], time=1.0, weight=1.0)
    shape = len(liquid.modes), len(rates)
    stress, slopes = _stresses(law, memory)
    shear, normal = stress[1] / memory.Wi, (stress[0] - stress[2]) / memory.Wi
    of_shear, of_normal = slopes[:, 1] / memory.Wi, (slopes[:, 0] - slopes[:, 2]) / memory.Wi
    found = []
    for solvent, scale, value, (by_time, *by_numbers) in (
        (np.ones_like(rates), np.ones_like(rates), shear, of_shear),
        (np.zeros_like(rates), rates, normal, of_normal),
    ):
        each = scale * np.array(by_numbers).reshape(-1, *shape)
        found.append(Parts(solvent, scale * value.reshape(shape), scale * (by_time - value).reshape(shape), each))
    return found[0], found[1]


def _stresses(law: ConformationLaw, at: Sheared) -> tuple[Array, Array]:
    """Stresses over the modulus, (4, n), and their derivatives by log Wi and the numbers of the law, (1 + K, 4, n)."""
    n, varied = len(at.Wi), [replace(law, **{name: value + 1j * STEP}) for name, value in law.numbers.items()]
    moved = np.concatenate([at.c + 1j * STEP * unit[:, None] for unit in np.eye(4)], axis=1)
    _, zr, rr, _ = at.c
    by_log_Wi = np.array([2 * at.Wi * zr, at.Wi * rr, np.zeros(n), np.zeros(n)])
    by_c = np.imag(_change(law, moved, np.tile(at.Wi, 4), np.tile(at.gamma2, 4))).reshape(4, 4, n).transpose(2, 0, 1)
    by_numbers = [np.imag(_change(each, at.c, at.Wi, at.gamma2)) / STEP for each in varied]
    right = np.array([by_log_Wi, *by_numbers])
    dc = -np.linalg.solve(by_c / STEP, right.transpose(2, 1, 0)).transpose(2, 1, 0)
    each = [mode_stress(_alone(of), of, at.c + 1j * STEP * d) for of, d in zip([law, *varied], dc, strict=True)]
    return mode_stress(_alone(law), law, at.c), np.imag(each) / STEP


def _change(law: ConformationLaw, c: Array, Wi: Array, gamma2: Array) -> Array:
    """The rate of change R of conformations in steady shear, in units of the relaxation time, shape (4, n)."""
    _, zr, rr, _ = c
    turned = np.array([2 * Wi * zr, Wi * rr, np.zeros_like(zr), np.zeros_like(zr)])
    return np.asarray(turned + relaxation(_alone(law), law, c, gamma2))


def _alone(law: ConformationLaw) -> Liquid:
    """The liquid of a mode whose relaxation time and modulus are 1."""
    return single(law, 1.0, 0.0)
