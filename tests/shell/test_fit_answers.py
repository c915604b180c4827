"""What `pairsim units` says of files of a rheometer: while it fits, when it is stopped, and where it cannot write."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.commands import Pairsim

import pairsim as api
from pairsim.lab.rheometer.derivatives import Sheared, numbers_of, slopes
from pairsim.lab.rheometer.law_fits import Fit, fits
from pairsim.lab.rheometer.measured import Measured, of_liquid
from pairsim.lab.rheometer.rheology_of_case import Listener, fit_liquid, sentences
from pairsim.physics.homogeneous import ShearMemory, moduli, shear, steady_shear, stress_after
from pairsim.physics.liquids import LAWS, ConformationLaw, Liquid, Newtonian, single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.ptt import LinearPTT
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

EXPERIMENT = ("--tube", "50um", "--particle", "20um", "--flow", "1ul/min", "--modulus", "5kPa")
RATES, FREQUENCIES = np.geomspace(0.01, 1000, 25), np.geomspace(0.1, 100, 16)
ELASTIC = [name for name, law in LAWS.items() if issubclass(law, ConformationLaw)]


def noisy(values: Array, seed: int) -> Array:
    return np.asarray(values * np.exp(0.01 * np.random.default_rng(seed).standard_normal(len(values))))


def written(folder: Path, liquid: Liquid) -> tuple[Path, Path]:
    """A flow curve of 25 points and moduli at 16 frequencies, with 1 % noise."""
    curve, spectrum = folder / "flow.csv", folder / "moduli.csv"
    eta, (storage, loss) = steady_shear(liquid, RATES)[0], moduli(liquid, FREQUENCIES)
    rows = [f"{x:.6g},{y:.6g}\n" for x, y in zip(RATES, noisy(eta, 1), strict=True)]
    curve.write_text("rate [1/s],viscosity [Pa.s]\n" + "".join(rows))
    each = zip(FREQUENCIES, noisy(storage, 2), noisy(loss, 3), strict=True)
    spectrum.write_text("omega [rad/s],G' [Pa],G'' [Pa]\n" + "".join(f"{w:.6g},{a:.6g},{b:.6g}\n" for w, a, b in each))
    return curve, spectrum


class Notes(Listener):
    """Keeps what it is told, and interrupts after a number of laws."""

    def __init__(self, laws: int = 100) -> None:
        self.said, self.done, self._laws = list[str](), list[str](), laws

    def answer(self, sentence: str) -> None:
        self.said.append(sentence)

    def progress(self, sentence: str) -> None:
        self.done.append(sentence)
        if sum("off by" in each for each in self.done) == self._laws:
            raise KeyboardInterrupt


@pytest.mark.parametrize("name", ELASTIC)
def test_steady_shear_is_where_the_flow_leads_with_and_without_a_memory(name: str) -> None:
    law = LAWS[name](**{key: {"L2": 40.0, "n": 0.5, "Cu": 2.0}.get(key, 0.3) for key in LAWS[name].parameters()})
    assert isinstance(law, ConformationLaw)
    rates, memory = np.array([30.0, 0.02, 1.0, 5.0]), ShearMemory()
    for De in (0.5, 0.505, 0.51, 2.0):  # near to each other, and far
        viscosity, N1 = steady_shear(single(law, De, 0.1), rates, memory)
        alone = steady_shear(single(law, De, 0.1), rates)
        assert viscosity == pytest.approx(alone[0], rel=1e-9)
        assert np.allclose(N1, alone[1], rtol=1e-7)
    tau = stress_after(single(law, 2.0, 0.1), shear(5.0), 60.0)
    assert viscosity[3] == pytest.approx(0.1 + tau[1] / 5.0, rel=1e-6)


def test_several_modes_are_sheared_as_each_alone() -> None:
    modes = tuple(Giesekus(alpha=0.3, time=t, weight=w) for t, w in ((1.0, 0.6), (0.1, 0.4)))
    both = steady_shear(Liquid(Newtonian(), 0.0, 2.0, modes), RATES)
    parts = [steady_shear(single(Giesekus(alpha=0.3), 2.0 * mode.time, 0.0), RATES) for mode in modes]
    for quantity in (0, 1):
        total = sum(mode.weight * part[quantity] for mode, part in zip(modes, parts, strict=True))
        assert both[quantity] == pytest.approx(total, rel=1e-6)


@pytest.mark.parametrize("name", ELASTIC)
def test_derivatives_of_what_is_measured_are_those_of_differences(name: str) -> None:
    """By log eta_0, xi, the weights of both modes, the logarithms of their times, and the numbers of the law."""
    own = {key: {"L2": 40.0, "n": 0.5, "Cu": 2.0}.get(key, 0.3) for key in LAWS[name].parameters()}
    x = {"viscosity": RATES, "N1": RATES[5:], "storage": FREQUENCIES, "loss": FREQUENCIES[2:]}

    def liquid(numbers: Array) -> Liquid:
        modes = tuple(
            LAWS[name](time=np.exp(time), weight=weight, **dict(zip(own, numbers[6:], strict=True)))
            for weight, time in zip(numbers[2:4], numbers[4:6], strict=True)
        )
        return Liquid(Newtonian(), numbers[1], 1.0, modes)

    def logarithms(numbers: Array) -> Array:
        return np.log(np.concatenate([*of_liquid(liquid(numbers), np.exp(numbers[0]), x).values()]))

    at = np.array([0.4, 0.1, 0.7, 0.3, 0.2, -2.0, *own.values()])
    assert numbers_of(liquid(at), np.exp(0.4)) == pytest.approx(at)
    differences = [(logarithms(at + h) - logarithms(at - h)) / 2e-5 for h in 1e-5 * np.eye(len(at))]
    assert slopes(liquid(at), x, Sheared()) == pytest.approx(np.array(differences).T, rel=1e-5, abs=1e-7)


def test_a_fit_shears_the_liquid_once_for_all_derivatives(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the solvent is given xi follows from it and eta_0, and so does the derivative by eta_0."""
    modes = tuple(Giesekus(alpha=0.3, time=t, weight=w) for t, w in ((1.0, 0.6), (0.1, 0.4)))
    liquid = Liquid(Newtonian(), 0.1, 2.0, modes)
    eta, (storage, loss) = steady_shear(liquid, RATES)[0], moduli(liquid, RATES)
    data = Measured(RATES, noisy(eta, 1), frequency=RATES, storage=noisy(storage, 2), loss=noisy(loss, 3))
    fit = Fit(Giesekus, 2, data, {"solvent": 0.1})
    evaluated, of_fit, start = list[Array](), fit._deviations, fit._best.x + 0.01
    differences = [(of_fit(start + h) - of_fit(start - h)) / 2e-5 for h in 1e-5 * np.eye(len(start))]
    assert fit._slopes(start) == pytest.approx(np.array(differences).T, rel=1e-4, abs=1e-6)

    def counted(x: Array) -> Array:
        evaluated.append(x)
        return of_fit(x)

    monkeypatch.setattr(fit, "_deviations", counted)
    found = fit._solved(start)
    assert found.x == pytest.approx(fit._best.x, abs=1e-4)
    assert found.njev > 1
    assert len(evaluated) == found.nfev


@pytest.mark.slow
def test_what_was_read_is_said_first_and_then_each_law(tmp_path: Path) -> None:
    curve, spectrum = written(tmp_path, Liquid(Newtonian(), 0.05, 0.5, (LinearPTT(epsilon=0.25),)))
    notes = Notes()
    found = fit_liquid(curve, spectrum, listener=notes)
    assert [each[:4] for each in notes.said[:2]] == ["read", "read"]
    assert notes.said == found.sentences
    assert notes.done[0] == f"fit: trying {', '.join(ELASTIC)}"
    assert any(each.startswith("fit: linear PTT: off by ") for each in notes.done)
    said = " ".join(found.sentences)
    assert "FENE-P is taken, and linear PTT fits as well: --liquid ptt-linear chooses one" in said or (
        "linear PTT is taken, and FENE-P fits as well: --liquid fene-p chooses one" in said
    )


def test_the_best_law_so_far_is_said_when_the_fit_is_interrupted(tmp_path: Path) -> None:
    files = written(tmp_path, Liquid(Newtonian(), 0.05, 0.5, (Giesekus(alpha=0.3),)))
    notes = Notes(laws=1)
    with pytest.raises(KeyboardInterrupt):
        fit_liquid(*files, listener=notes)
    assert notes.said[0].startswith("read: flow.csv: 25 points")
    assert notes.said[-1].startswith("fit: stopped; the best so far is FENE-P: viscosity = ")
    left = "not tried: giesekus, oldroyd-b, ptt-linear, ptt-exp, white-metzner; --liquid fene-p fits this law alone"
    assert notes.said[-1].endswith(f"intervals are not known; {left}")
    with pytest.raises(KeyboardInterrupt):
        fit_liquid(*files, listener=(notes := Notes(laws=0)))
    assert notes.said[-1] == "fit: stopped before the first law was fitted"


GEL = np.geomspace(0.1, 100, 16)


def gel(folder: Path) -> Path:
    rows = "".join(f"{w:.5g},{100 * w**0.02:.5g},{3 + 0.05 * w:.5g}\n" for w in GEL)
    (folder / "gel.csv").write_text(f"omega [rad/s],G' [Pa],G'' [Pa]\n{rows}")
    return folder / "gel.csv"


def test_a_gel_is_described_by_four_modes() -> None:
    data = Measured(frequency=GEL, storage=100 * GEL**0.02, loss=3 + 0.05 * GEL)
    found = fits(data, ["oldroyd-b"])
    assert len(found[0].liquid.modes) == 4
    assert found[0].deviation < 0.02
    assert found[0].liquid.xi < 1e-5
    times = [mode.time for mode in found[0].liquid.modes]
    assert times == sorted(times, reverse=True)
    assert "describe" not in " ".join(sentences(found, data))


def test_the_viscosity_of_a_solvent_that_moduli_do_not_show_stays_where_a_case_may_have_it() -> None:
    storage, loss = moduli(Liquid(Newtonian(), 1e-4, 1.0, (LAWS["oldroyd-b"](),)), FREQUENCIES)
    (best,) = fits(Measured(frequency=FREQUENCIES, storage=storage, loss=noisy(loss, 1)), ["oldroyd-b"])
    assert best.liquid.xi >= 1e-4


def test_a_case_is_made_of_modes_of_which_one_has_no_measurable_memory(pairsim: Pairsim, tmp_path: Path) -> None:
    """The time of such a mode is anywhere below what the data show; it stays where a case may have it."""
    thinning = LAWS["white-metzner"](n=0.5, Cu=0.5, weight=0.5)
    written(tmp_path, Liquid(Newtonian(), 1e-4, 0.5, (thinning, replace(thinning, time=1e-9))))
    files = ("--rheology", "flow.csv", "--spectrum", "moduli.csv", "--liquid", "white-metzner")
    done = pairsim("units", *files, *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 0, done.stderr
    modes = api.load(tmp_path / "case.yaml").liquid_model.modes
    assert len(modes) == 2
    assert modes[1].time < 0.1
    assert modes[0].numbers["Cu"] == modes[1].numbers["Cu"]


def test_a_fit_is_printed_before_its_liquid_is_refused_as_a_case(pairsim: Pairsim, tmp_path: Path) -> None:
    gel(tmp_path)
    done = pairsim("units", "--spectrum", "gel.csv", "--liquid", "oldroyd-b", *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 2
    assert "fit: Oldroyd-B, 4 modes: viscosity = 5" in done.stdout
    assert "fit: off by 1.5 %" in done.stdout
    assert "this is De = " in done.stderr
    assert "the value is that of the fit, so that no case can be made of this liquid here" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["gel.csv"]


@pytest.fixture
def flow(tmp_path: Path) -> Path:
    rows = "".join(f"{rate:.5g},{(1 + rate**2) ** -0.2:.5g}\n" for rate in RATES)
    (tmp_path / "flow.csv").write_text(f"rate [1/s],viscosity [Pa.s]\n{rows}")
    return tmp_path


def full_for(patch: pytest.MonkeyPatch, ending: str) -> None:
    """Make the disk full for files of a kind."""
    before = Path.write_bytes

    def write_bytes(path: Path, content: bytes) -> int:
        if ending in path.name:
            before(path, content[:10])
            raise OSError(errno.ENOSPC, "No space left on device")
        return before(path, content)

    patch.setattr(Path, "write_bytes", write_bytes)


def test_on_a_full_disk_the_answer_is_printed_and_nothing_is_half_written(
    pairsim: Pairsim, flow: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_for(monkeypatch, ".yaml")
    done = pairsim("units", "--rheology", "flow.csv", *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 2
    assert "case.yaml: -o: must be a writable file (No space left on device)" in done.stderr
    assert "wall shear rate" in done.stdout
    assert [file.name for file in flow.iterdir()] == ["flow.csv"]


def test_a_case_is_not_lost_with_its_picture(pairsim: Pairsim, flow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full_for(monkeypatch, ".png")
    done = pairsim("units", "--rheology", "flow.csv", *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 2
    assert "case-fit.png: must be a writable file (No space left on device)" in done.stderr
    assert done.stdout.endswith("case.yaml\n")
    assert sorted(file.name for file in flow.iterdir()) == ["case.yaml", "flow.csv"]


def test_numbers_of_modes_stand_apart_from_their_names() -> None:
    law = {"law": "ptt-linear", "weight": 1, "epsilon": 1.574}
    modes = [{**law, "time": time} for time in (1, 0.1)]
    found = api.units(
        tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", relaxation="1ms",
        liquid={"law": "modes", "modes": modes},
    )  # fmt: skip
    assert "liquid.modes[1].epsilon 1.574 " in str(found)


@pytest.mark.parametrize(
    ("quantities", "says"),
    [
        ({"modulus": "3 mPa", "viscosity": "10 mPa.s"},
         "modulus 3 mPa is 0.003 Pa (m is milli, mega is M), but the usual range is 1 Pa to 100 GPa"),
        ({"viscosity": "2 MPa.s"}, "viscosity 2 MPa.s is 2e+06 Pa.s (M is mega, milli is m), but the usual range is"),
        ({"viscosity": "1 Pa.s", "tube": "90 nm", "particle": "20 nm"}, "tube 90 nm is 9e-08 m, but the usual range"),
    ],
)  # fmt: skip
def test_a_prefix_that_may_be_misread_is_said_at_once(quantities: dict[str, str], says: str) -> None:
    found = api.units(**{"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", **quantities})
    assert str(found).startswith(f"note: {says}")
    assert f"# {says}" in found.case_file("case")
    usual = api.units(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="3 kPa")
    assert str(usual).startswith("beta ")


def test_a_number_that_follows_from_a_misread_prefix_is_refused_with_it() -> None:
    with pytest.raises(InputError, match=r"this is Ca_e = 5.659e\+04; .*; modulus 3mPa is 0.003 Pa \(m is milli"):
        api.units(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="3mPa")
