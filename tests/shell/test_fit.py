"""`fit`: what is unknown of an experiment from a film, on an atlas of invented curves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.integrate import cumulative_trapezoid
from support.atlases import exact, exact_by_difference
from support.commands import Pairsim
from support.pictures import drawn_figures

import pairsim as api
from pairsim.atlas.atlas import SHIPPED, Atlas
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.lab.films.fit_film import FilmFit
from pairsim.record.table_files import table_text
from pairsim.runtime.errors import InputError

BENCH = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s"}
TIME = 5.8905e-3  # D_c/U_av [s]
MODULUS = 5 * 0.033953 / 0.06  # [kPa] with Ca_e = .06


def holds(found: FilmFit, modulus: float) -> bool:
    """Whether the interval holds a modulus [kPa]."""
    _, least, most, _ = found.values["modulus"]
    return least < modulus < most


def width(found: FilmFit) -> float:
    """That of the interval of the modulus, over its value."""
    value, least, most, _ = found.values["modulus"]
    return (most - least) / value


def film(
    path: Path,
    De: float,
    Ca_e: float,
    noise: float,
    *,
    drift: float = 0.0,
    stop: float = 0.9,
    beta: float = 0.4,
    difference: float = 0.0,
    start: float = 0.0,
    begin: float = 0.5,
    frames: int = 80,
    centres: bool = False,
    unit: str = "um",
) -> Path:
    """A film of the invented curves, by an integral of dt = (stretch/dU) dd.

    Args:
        path: File to write.
        De, Ca_e, beta: Numbers of the pair.
        noise: Standard deviation of distances [D_c].
        drift: Amplitude of a deviation that no pair has [D_c].
        begin: First distance [D_c].
        stop: Last distance [D_c].
        difference: Of the diameters, leading less trailing over their mean.
        start: How far the first frame is off the motion, which decays with the time 0.4 D_c/U_av [D_c].
        frames: Their number.
        centres: Whether the film has the distances between the centres, which are a diameter more in the first frame.
        unit: That of the distances in the file.
    """
    d = np.linspace(begin, stop, 2000)
    dU = exact(beta, De, Ca_e, d) + difference * exact_by_difference(beta, De, d)  # type: ignore[arg-type]
    stretch = 1 + Ca_e * np.exp(-d)
    t = cumulative_trapezoid(stretch / dU, d, initial=0)
    times = np.linspace(0, t[-1], frames)
    shown = begin + beta + cumulative_trapezoid(stretch, d, initial=0) if centres else d
    seen = np.interp(times, t, shown) + noise * np.random.default_rng(7).standard_normal(frames)
    seen += drift * np.sin(2 * np.pi * times / times[-1]) + start * np.exp(-times / 0.4)
    rows = "".join(f"{1e3 * TIME * a},{50 * b}\n" for a, b in zip(times, seen, strict=True))
    path.write_text(f"t [ms],{'c' if centres else 'd'} [{unit}]\n{rows}")
    return path


def case(**quantities: Any) -> dict[str, Any]:
    liquid = {"liquid": "giesekus"} if "relaxation" in quantities else {}
    return {"physical": BENCH | quantities, "d": [0.02, 2], **liquid}


@pytest.mark.slow
def test_a_modulus_is_found_within_its_interval(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.0, 0.06, 4e-3)
    found = api.fit(path, case(modulus="5 kPa"), atlas=atlas)  # Ca_e = .0340 there
    value, least, most, unit = found.values["modulus"]
    assert (value, unit) == (pytest.approx(5 * 0.033953 / 0.06, rel=0.05), "kPa")
    assert least < 5 * 0.033953 / 0.06 < most
    assert most < 1.3 * value
    assert "bad fit" not in str(found)
    exactly = api.fit(film(tmp_path / "exact.csv", 0.0, 0.06, 0.0), case(modulus="5 kPa"), atlas=atlas)
    _, least, most, _ = exactly.values["modulus"]  # which the atlas does not know exactly
    assert least < 5 * 0.033953 / 0.06 < most
    assert "bad fit" not in str(exactly)


def test_a_spread_of_beads_is_what_is_known_of_the_difference_of_two(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.0, 0.06, 4e-3)
    differences = [
        api.fit(path, case(modulus="5 kPa", **known), atlas=atlas)
        for known in ({"particle": "20 um each 0.1 um"}, {"particle_difference": "0 +- 1.3859 %"})
    ]
    of_spread, of_difference = (found.values["modulus"][:3] for found in differences)
    assert of_spread == pytest.approx(of_difference, rel=1e-3)
    assert width(differences[0]) < width(api.fit(path, case(modulus="5 kPa"), atlas=atlas))


@pytest.mark.slow
def test_a_relaxation_time_is_found_beside_it(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.5, 0.06, 4e-3)
    equal = case(modulus="2.83 kPa", relaxation="2 ms", particle_difference="0 %")
    found = api.fit(path, equal, unknown=["relaxation"], atlas=atlas)
    _, least, most, unit = found.values["relaxation"]
    assert unit == "ms"
    assert least < 1e3 * 0.5 * TIME < most
    both = api.fit(path, equal, unknown=["modulus", "relaxation"], atlas=atlas)
    assert both.values["relaxation"][2] - both.values["relaxation"][1] > most - least


@pytest.mark.slow
def test_an_interval_holds_both_values_that_give_the_same_motion(tmp_path: Path) -> None:
    """The pair approaches fastest at De = 0.44: one of De 0.37 moves as one of De 0.51, as by a relaxation of 3 ms."""
    times, De = np.linspace(0, 42, 100), 3e-3 / TIME
    shipped = Atlas.load(next(path for path in SHIPPED if path.stem == "equal-pairs"))
    motion = curve_of_atlas(shipped, beta=0.4, De=De, Ca_e=0.0566).motion
    assert motion is not None
    inside = 0
    for seed in range(4):
        d = motion.path(0.16, times) + 4e-3 * np.random.default_rng(seed).standard_normal(100)
        rows = "".join(f"{1e3 * TIME * a},{50 * b}\n" for a, b in zip(times, d, strict=True))
        (tmp_path / "film.csv").write_text(f"t [ms],d [um]\n{rows}")
        found = api.fit(
            tmp_path / "film.csv",
            case(modulus="3 kPa", relaxation="2.5 ms", particle_difference="0 %"),
            unknown=["relaxation"],
        )
        _, least, most, _ = found.values["relaxation"]
        inside += 1.4 < least < 2.3 and 3.0 < most < 4.5
    assert inside >= 3


@pytest.mark.slow
def test_what_data_do_not_determine_and_what_does_not_fit_is_said(atlas: Path, tmp_path: Path) -> None:
    short = api.fit(film(tmp_path / "a.csv", 0.0, 0.06, 0.02, stop=0.51), case(modulus="5 kPa"), atlas=atlas)
    assert "these data do not determine it" in str(short)
    still = api.fit(film(tmp_path / "c.csv", 0.0, 0.06, 0.05, stop=0.51), case(modulus="5 kPa"), atlas=atlas)
    for found in (short, still):
        _, least, most, _ = found.values["modulus"]
        assert least < 5 * 0.033953 / 0.06 < most
    drift = api.fit(film(tmp_path / "b.csv", 0.0, 0.06, 4e-3, drift=0.03), case(modulus="5 kPa"), atlas=atlas)
    assert "A bad fit" in str(drift)


@pytest.mark.slow
def test_an_interval_that_the_atlas_cuts_off_is_said_to_be(atlas: Path, tmp_path: Path) -> None:
    soft = api.fit(film(tmp_path / "a.csv", 0.0, 0.2, 4e-3), case(modulus=["5 kPa", "5 kPa"]), atlas=atlas)
    assert "the interval ends where the atlas does" in str(soft)
    (tmp_path / "b.csv").write_text("t [ms],d [um]\n" + "".join(f"{10 * i},25\n" for i in range(40)))
    rigid = api.fit(tmp_path / "b.csv", case(particle_difference="0 %"), atlas=atlas)
    assert "to inf: these data do not determine it" in str(rigid)
    assert not rigid.cut
    assert api.fit(tmp_path / "b.csv", case(), atlas=atlas).cut  # a larger leading bead holds soft ones in their place


@pytest.mark.slow
def test_the_command_says_the_same(atlas: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    film(tmp_path / "film.csv", 0.0, 0.06, 4e-3)
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(case(modulus="5 kPa")))
    done = pairsim("fit", "film.csv", "case.yaml", "--atlas", str(atlas))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("modulus = ")
    assert not (tmp_path / "film.png").exists()
    pairsim("fit", "film.csv", "case.yaml", "--atlas", str(atlas), "-o", ".")
    assert (tmp_path / "film.png").stat().st_size > 10_000
    equal = pairsim("fit", "film.csv", "case.yaml", "--atlas", str(atlas), "--set", "physical.particle_difference=0 %")
    assert "as fitted" in done.stdout
    assert "as fitted" not in equal.stdout
    assert equal.stdout.startswith("modulus = ")
    wrong = pairsim("fit", "film.csv", "case.yaml", "--atlas", str(atlas), "--set", "physical.tube=50 foo")
    assert "case.yaml: physical.tube: got '50 foo'" in wrong.stderr
    (tmp_path / "film.csv").write_text("t,d\n1,2\n")
    refused = pairsim("fit", "film.csv", "case.yaml", "--atlas", str(atlas))
    assert refused.returncode == 2
    assert "must be a column with its unit, such as t [s]" in refused.stderr


@pytest.mark.parametrize("centres", [False, True])
def test_a_film_a_run_and_a_curve_are_in_one_picture(
    centres: bool, atlas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A film of centres is shown beside the motion of the centres, which differs from that of the surfaces."""
    seen = film(tmp_path / "film.csv", 0.0, 0.06, 0.0, centres=centres)
    table = curve_of_atlas(Atlas.load(atlas), beta=0.4, De=0.0, Ca_e=0.06).table
    (frames := pd.read_csv(seen)).columns = ["t", "seen"]
    (surfaces := pd.read_csv(film(tmp_path / "surfaces.csv", 0.0, 0.06, 0.0))).columns = ["t", "d"]
    z_L = frames["seen"] / 50 if centres else 0.4 + surfaces["d"] / 50
    run = {"t": frames["t"] / 1e3 / TIME, "d": surfaces["d"] / 50, "z_L": z_L, "z_T": 0 * z_L}
    for name, file, columns in (("run", "series", run), ("curve", "curve", table)):
        (folder := tmp_path / name).mkdir()
        scales = {"length": 50e-6, "time": TIME, "velocity": 50e-6 / TIME, "stress": 1.0}
        (folder / "run.json").write_text(json.dumps({"kind": name, "status": "finished", "scales": scales}))
        (folder / f"{file}.csv").write_text(table_text(list(columns), zip(*columns.values(), strict=True)))
        (folder / "case.yaml").write_text(
            "beta: 0.4\nDe: 0\nCa_e: 0.06\n" + ("d0: 0.5\n" if name == "run" else "d: [0.1, 1]\n")
        )
    with drawn_figures(monkeypatch) as figures:
        api.plot(tmp_path / "run", tmp_path / "curve", seen, out=tmp_path)
    motion, off = figures[0].axes
    assert len(motion.lines) == 3
    moved = 20 * (1 + 0.06 * np.exp(-0.7) if centres else 1)
    assert np.ptp(motion.lines[-1].get_ydata()) == pytest.approx(moved, rel=0.01)
    assert max(np.abs(line.get_ydata()).max() for line in off.lines if len(line.get_ydata()) > 2) < 0.05
    (tmp_path / "run" / "run.json").write_text('{"kind": "run"}')
    with pytest.raises(InputError, match="must be a run or a curve with a physical block"):
        api.plot(tmp_path / "run", seen, out=tmp_path)


@pytest.mark.slow
def test_the_answer_does_not_depend_on_a_first_guess(atlas: Path, tmp_path: Path) -> None:
    """Of a film whose first frames are off, as from rest: once they were left out as the guess had it."""
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3, start=8e-3)
    found = [api.fit(path, case(modulus=guess), atlas=atlas) for guess in ("2.3 kPa", "9 MPa")]
    assert found[1].values["modulus"].unit == "MPa"
    assert 1e3 * found[1].values["modulus"].value == pytest.approx(found[0].values["modulus"].value, rel=1e-6)
    without = api.fit(path, case(), atlas=atlas).values["modulus"]
    assert without == found[0].values["modulus"]
    assert holds(found[0], MODULUS)


@pytest.mark.slow
def test_what_is_left_of_the_start_is_no_softness(tmp_path: Path) -> None:
    """A short film of beads of 2 kPa, from rest: taken for motion along the curve it would give 2.3 kPa."""
    shipped = Atlas.load(next(path for path in SHIPPED if path.stem == "newtonian"))
    curve, times = curve_of_atlas(shipped, beta=0.4, De=0.0, Ca_e=0.0849), np.linspace(0, 3.4, 80)
    motion = curve.motion
    assert motion is not None
    decay = float(np.interp(0.08, curve.table["d"], curve.table["t_relax"]))
    seen = motion.path(0.0766, times) + 8e-3 * np.exp(-times / decay) - 4.6e-3 * np.exp(-4 * times / decay)
    seen += 5e-4 * np.random.default_rng(3).standard_normal(80)
    rows = "".join(f"{1e3 * TIME * a},{50 * b}\n" for a, b in zip(times, seen, strict=True))
    (tmp_path / "film.csv").write_text(f"t [ms],d [um]\n{rows}")
    assert holds(api.fit(tmp_path / "film.csv", case(particle_difference="0 %")), 2.0)


@pytest.mark.slow
def test_half_widths_of_the_case_are_in_the_interval(atlas: Path, tmp_path: Path) -> None:
    """The film is of beads of 20.2 um; the user has measured 20 +- 0.4 um."""
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3, beta=0.404)
    exactly, measured = (
        api.fit(path, case(particle=size, particle_difference="0 %"), atlas=atlas) for size in ("20 um", "20 um +- 2 %")
    )
    assert not holds(exactly, MODULUS)
    assert holds(measured, MODULUS)
    assert max(measured.parts["modulus"], key=lambda name: measured.parts["modulus"][name]) == "particle"
    assert "particle +- " in str(measured)


@pytest.mark.slow
@pytest.mark.parametrize("difference", [1e-3, -2e-3])
def test_beads_that_are_not_quite_equal(difference: float, atlas: Path, tmp_path: Path) -> None:
    """A tenth of a per cent is not seen in a picture, and worth several half-widths of the modulus of equal beads."""
    path = film(tmp_path / "a.csv", 0.0, 0.06, 1e-3, difference=difference, begin=0.1, stop=0.4)
    unknown = api.fit(path, case(), atlas=atlas)
    assert holds(unknown, MODULUS)
    assert abs(unknown.difference[0] - difference) < unknown.difference[1]
    least, most = unknown.equal["modulus"][1:3]
    assert not least < MODULUS < most
    assert "If the diameters are equal" in str(unknown)
    known = api.fit(path, case(particle_difference=f"{100 * difference} %"), atlas=atlas)
    assert holds(known, MODULUS)
    assert width(known) < 0.8 * width(unknown)


@pytest.mark.slow
def test_a_difference_is_known_by_two_diameters_or_by_films_in_both_orders(atlas: Path, tmp_path: Path) -> None:
    difference = -2e-3
    path = film(tmp_path / "a.csv", 0.0, 0.06, 1e-3, difference=difference, begin=0.1, stop=0.4)
    known = api.fit(path, case(particle_difference=f"{100 * difference} %"), atlas=atlas)
    listed = api.fit(path, case(particle=[f"{20 * (1 + s * difference / 2)} um" for s in (-1, 1)]), atlas=atlas)
    assert known.values["modulus"].value == pytest.approx(listed.values["modulus"].value, rel=1e-4)
    other = film(tmp_path / "b.csv", 0.0, 0.06, 1e-3, difference=-difference, begin=0.1, stop=0.3)
    both = api.fit(path, case(), exchanged=other, atlas=atlas)
    assert holds(both, MODULUS)
    assert width(both) < 0.8 * width(api.fit(path, case(), atlas=atlas))


@pytest.mark.slow
def test_outliers_are_left_out(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3)
    rows = path.read_text().splitlines()
    for k in (20, 55):
        rows[k] = f"{rows[k].partition(',')[0]},{float(rows[k].partition(',')[2]) + 5}"
    path.write_text("\n".join(rows))
    found = api.fit(path, case(particle_difference="0 %"), atlas=atlas)
    assert found.left_out == 2
    assert holds(found, MODULUS)
    assert "2 more are outliers" in str(found)


def test_frames_far_from_all_others_are_refused(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3)
    rows = path.read_text().splitlines()
    t, _, d = rows[-1].partition(",")
    path.write_text("\n".join([*rows[:-1], f"{t},1e9"]))
    with pytest.raises(InputError, match=rf"csv:{len(rows)}: distance: got '1e\+09 um'; must be at most 100 diameters"):
        api.fit(path, case(), atlas=atlas)
    path.write_text("\n".join([*rows[:-1], f"1e10,{d}"]))
    with pytest.raises(InputError, match="no motion of the atlas comes close to these frames"):
        api.fit(path, case(), atlas=atlas)


def test_centres_are_further_apart_than_a_diameter(atlas: Path, tmp_path: Path) -> None:
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3)
    wrong = "has centres 15 um apart, less than the diameter of the case, 20 um"
    table = "frame,particle,x,y\n" + "".join(f"{k},{i},{i * (15 + k)},3\n" for k in range(20) for i in (0, 1))
    path.write_text(table)
    with pytest.raises(InputError, match=wrong):
        api.fit(path, case(), atlas=atlas, fps=500, pixel="1 um")


@pytest.mark.slow
def test_centres_move_as_dU_says_and_the_facing_surfaces_do_not(atlas: Path, tmp_path: Path) -> None:
    """Their distances change by up to 4 % more here; with little noise this is many half-widths of the modulus."""
    known = case(particle_difference="0 %")
    found = api.fit(film(tmp_path / "c.csv", 0.0, 0.06, 1e-4, begin=0.1, centres=True), known, atlas=atlas)
    assert holds(found, MODULUS)
    assert found.values["modulus"].value == pytest.approx(MODULUS, rel=0.01)


@pytest.mark.slow
def test_many_frames_do_not_shift_the_size_of_a_pixel(atlas: Path, tmp_path: Path) -> None:
    """The noise of a frame does not shrink with a smaller pixel: thousands of frames once chose one for that reason."""
    path = film(tmp_path / "film.csv", 0.0, 0.06, 2e-3, begin=0.1, frames=4000, unit="px")
    found = api.fit(path, case(particle_difference="0 %"), atlas=atlas, pixel="1 um +- 2 %")
    assert holds(found, MODULUS)
    assert found.values["modulus"].value == pytest.approx(MODULUS, rel=0.01)


@pytest.mark.slow
def test_cases_that_were_made_without_what_is_unknown(atlas: Path, tmp_path: Path) -> None:
    """As `pairsim units -o` writes them, with rigid beads; and without any distance, which films have."""
    path = film(tmp_path / "film.csv", 0.0, 0.06, 1e-3)
    block = {"physical": BENCH | {"particle_difference": "0 %"}}
    rigid, bare = api.fit(path, block | {"Ca_e": 0, "d0": 0.1}, atlas=atlas), api.fit(path, block, atlas=atlas)
    assert rigid.values == bare.values
    assert holds(bare, MODULUS)


def test_what_may_be_unknown_is_named(atlas: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown: got 'viscosity'; allowed: modulus, relaxation, both"):
        api.fit(tmp_path / "f.csv", case(modulus="5 kPa"), unknown="viscosity", atlas=atlas)
    with pytest.raises(InputError, match="unknown: got ''; allowed: modulus"):
        api.fit(tmp_path / "f.csv", case(modulus="5 kPa"), unknown=[], atlas=atlas)


def test_films_that_are_too_short_are_refused(atlas: Path, tmp_path: Path) -> None:
    (tmp_path / "film.csv").write_text("t [s],d [um]\n0,5\n")
    with pytest.raises(InputError, match="must have at least 4 frames; has 1"):
        api.fit(tmp_path / "film.csv", case(modulus="5 kPa"), atlas=atlas)
