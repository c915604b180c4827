"""Tables of trackers: which are read, and what is left out, put right and refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from support.commands import Pairsim
from support.inputs import ROOT
from support.pictures import drawn_figures
from support.tracks import (
    BENCH,
    CENTRES,
    FPS,
    FRAMES,
    MIDDLE,
    OPTIONS,
    PIXEL,
    D,
    N,
    assert_read,
    cellprofiler,
    imagej,
    imaris,
    manual_tracking,
    mosaic,
    mtrack2,
    napari,
    positions,
    read,
    refused,
    renamed,
    trackmate,
    trackpy,
)

import pairsim as api
from pairsim.runtime.errors import InputError


@pytest.mark.parametrize("table", [trackpy, trackmate, manual_tracking, mtrack2, mosaic, imagej, cellprofiler, napari])
def test_tables_of_trackers_are_read_as_they_are(table: Any, tmp_path: Path) -> None:
    film = read(tmp_path, table(positions()), **OPTIONS)
    assert_read(film, tolerance=1e-3)
    assert film.pixel == pytest.approx((PIXEL * 1e-6, 0))
    assert "40 frames" in film.notes[0]
    assert "500 frames per second" in film.notes[0]


@pytest.mark.parametrize("name", ["d", "D", "diameter"])
def test_diameters_of_particles_are_no_distances(name: str, tmp_path: Path) -> None:
    table = positions().assign(**{name: 30.8}).drop(columns="particle")
    film = read(tmp_path, table.to_csv(index=False), **OPTIONS)
    np.testing.assert_allclose(1e6 * film.metres, PIXEL * CENTRES)


@pytest.mark.parametrize(("one", "two"), [("leading", "trailing"), ("bead A", "bead B"), ("front", "rear")])
def test_particles_side_by_side_may_have_names_before_their_axes(one: str, two: str, tmp_path: Path) -> None:
    columns = {
        f"{name}_{axis}": positions()[positions()["particle"] == k][axis].to_numpy()
        for k, name in enumerate((one, two))
        for axis in "xy"
    }
    table = pd.DataFrame({"frame": FRAMES, **columns})
    assert_read(read(tmp_path, table.to_csv(index=False), **OPTIONS))


def test_centroids_of_regions_are_positions(tmp_path: Path) -> None:
    """As scikit-image writes them: rows and columns of the picture, and labels that follow no particle."""
    columns = {"y": "centroid-0", "x": "centroid-1", "particle": "label"}
    table = positions().rename(columns=columns).sort_values("frame", kind="stable")
    assert_read(read(tmp_path, table.to_csv(), **OPTIONS))


def test_half_widths_of_a_pixel_are_kept(tmp_path: Path) -> None:
    text = trackpy(positions())
    for pixel in (".65 +- .01 um", "0.65um +- 10 nm", "0.65 +- 0.01 um/px", "0.65 +- .01 um per pixel"):
        film = read(tmp_path, text, fps=FPS, pixel=pixel)
        assert film.pixel == pytest.approx((0.65e-6, 0.01e-6)), pixel
    of_scale = read(tmp_path, text, fps=FPS, pixel="1.6 px/um +- 2 %")  # as ImageJ gives it
    assert of_scale.pixel == pytest.approx((0.625e-6, 0.0125e-6))


def test_units_of_trackers_are_known(tmp_path: Path) -> None:
    um = positions().assign(x=lambda table: PIXEL * table["x"], y=PIXEL * 50)
    for length in ("micron", "microns", "um", "µm", "\\u00B5m", "Micron"):  # \u00B5 is what Java writes in ASCII
        film = read(tmp_path, trackmate(um, length, "sec", 1 / FPS))
        assert_read(film, tolerance=1e-3)
        assert film.pixel is None
    assert_read(read(tmp_path, trackmate(um, "µm", "s", 1 / FPS), "latin-1"), tolerance=1e-3)
    assert_read(read(tmp_path, imaris(positions()), fps=FPS), tolerance=1e-3)
    assert "must have a unit such as m, not furlong" in refused(tmp_path, trackmate(um, "furlong", "sec", 1 / FPS))


def test_spreadsheets_change_a_table(tmp_path: Path) -> None:
    """Decimal commas with tabs or semicolons, a line that says so, numbers of particles with a point."""
    table = positions().assign(particle=lambda table: table["particle"].astype(float))
    for options in ({"sep": "\t"}, {"sep": ";"}):
        text = trackpy(table, decimal=",", **options)  # type: ignore[arg-type]
        assert_read(read(tmp_path, text, **OPTIONS))
        assert_read(read(tmp_path, f"sep={options['sep']}\n{text}", "utf-16", particles=(0, 1), **OPTIONS))


def test_missing_options_are_asked_for_by_name_all_at_once(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "tracks.csv").write_text(trackpy(positions(third=True)))
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(BENCH))
    done = pairsim("fit", "tracks.csv", "case.yaml")
    assert done.returncode == 2
    assert "tracks.csv: --fps: must be given: the film has frame numbers" in done.stderr
    assert "tracks.csv: --pixel: must be given, such as '.65 +- .01 um'" in done.stderr
    assert "0 (40 frames, 0 to 39), 1 (40 frames, 0 to 39), 2 (40 frames, 0 to 39)" in done.stderr


@pytest.mark.parametrize(
    ("options", "wrong"),
    [
        ({"pixel": "1um"}, "fps: must be given: the film has frame numbers"),
        ({"fps": 500}, "pixel: must be given, such as '.65 +- .01 um' if it is in px, or 1um if it is in um"),
        (OPTIONS | {"fps": 0}, "fps: got 0; must be frames per second above 0"),
        (OPTIONS | {"fps": "fast"}, "fps: got 'fast'; must be frames per second above 0"),
        (OPTIONS | {"fps": float("nan")}, "fps: got nan; must be frames per second above 0"),
        (OPTIONS | {"pixel": ".65"}, "pixel: got '.65'; is not a number with a unit"),
        (OPTIONS | {"pixel": ".65 px"}, "pixel: got '.65 px'; has the unit px, which is a unit of screens and print"),
        (OPTIONS | {"pixel": ".65 +- .7 um"}, "must have a half-width below its value"),
        (OPTIONS | {"particles": "0"}, "particles: got '0'; must be two"),
        (OPTIONS | {"particles": (1, 1)}, "particles: got '1,1'; must be two"),
        (OPTIONS | {"particles": "0,7"}, "which has no 7, but 0 (40 frames, 0 to 39), 1 (40 frames, 0 to 39)"),
    ],
)
def test_options_that_are_wrong(options: dict[str, Any], wrong: str, tmp_path: Path) -> None:
    assert wrong in refused(tmp_path, trackpy(positions()), **options)


def test_options_that_contradict_the_table(tmp_path: Path) -> None:
    um = trackmate(positions(), "micron", "sec", 0.04)  # of a film that plays at 25 frames per second
    assert 'pixel: must be left out: "POSITION X" is in micron' in refused(tmp_path, um, pixel=".65um")
    fast = read(tmp_path, um, fps=500)
    assert fast.seconds[1] == pytest.approx(0.002)
    assert '500 frames per second; column "POSITION T", which says 25, is not read' in fast.notes[0]
    assert "fps: got '500'; must be left out: the film has times, column \"t [s]\"" in refused(
        tmp_path, D + "0,4\n1,5\n", fps=500
    )
    assert "particles: got '1,2'; must be left out: the film has distances" in refused(
        tmp_path, D + "0,4\n1,5\n", particles="1,2"
    )


def test_a_frame_interval_that_nobody_has_set_is_none(tmp_path: Path) -> None:
    """TrackMate writes one second a frame where the film does not say how long it is."""
    text = trackmate(positions(), "micron", "sec", 1.0)
    assert "fps: must be given: POSITION T counts frames, at one per second" in refused(tmp_path, text)
    assert read(tmp_path, text, fps=1).seconds[1] == 1.0


def test_frames_that_have_one_time_or_one_number(tmp_path: Path) -> None:
    """A stack whose slices are depths, and a clock that stands still."""
    text = trackmate(positions().assign(frame=0), "micron", "sec", 1.0)
    assert "frame: got '0'; must be several: slices of a stack may have been taken for depths" in refused(
        tmp_path, text, fps=500
    )
    text = trackmate(positions(), "micron", "sec", 0.0)
    assert "fps: must be given: POSITION T is the same in all rows" in refused(tmp_path, text)


def test_positions_that_stand_for_lost_particles_are_none(tmp_path: Path) -> None:
    """Some trackers write 0, 0 or -1, -1, and give the name -1 to what is in no track."""
    table, whole = positions(), np.delete(FRAMES, [5, 30])
    for nowhere in (0, -1):
        lost = table["frame"].isin([5, 30]) & (table["particle"] == 1)
        film = read(
            tmp_path,
            trackpy(table.assign(x=table["x"].mask(lost, nowhere), y=table["y"].mask(lost, nowhere))),
            **OPTIONS,
        )
        assert_read(film, whole)
        assert film.notes[1] == "left out: 2 positions 0, 0 or -1, -1, of particles that were lost"
    untracked = pd.concat([table, pd.DataFrame({"frame": [3, 3], "particle": -1, "x": [1.0, 2.0], "y": 5.0})])
    assert_read(read(tmp_path, trackpy(untracked), **OPTIONS))
    np.testing.assert_allclose(1e6 * read(tmp_path, "t [s],x1 [um],x2 [um]\n0,0,30\n0.1,0,32\n").metres, [30, 32])


def test_two_of_several_particles(tmp_path: Path) -> None:
    table = positions(third=True)
    assert_read(read(tmp_path, trackpy(table), particles="0,1", **OPTIONS))
    assert_read(read(tmp_path, trackpy(table), particles=[1, 0], **OPTIONS))
    ahead = read(tmp_path, trackpy(table), particles="1, 2", **OPTIONS)
    np.testing.assert_allclose(1e6 * ahead.metres, PIXEL * 120)
    assert "has 3 particles in one frame" in refused(tmp_path, imagej(table), **OPTIONS)


def test_frames_in_which_one_is_lost_are_left_out(tmp_path: Path) -> None:
    table, whole = positions(), np.delete(FRAMES, [5, 6, 20])
    lost = table[~(table["frame"].isin([5, 6]) & (table["particle"] == 1)) & (table["frame"] != 20)]
    for text in (trackpy(lost), trackmate(lost), mtrack2(lost), imagej(lost)):
        film = read(tmp_path, text, **OPTIONS)
        assert_read(film, whole, 1e-3)
        assert any("left out: " in note for note in film.notes[1:])
    parts = renamed(table, 25, {1: 7})  # where it was lost, it became another one
    assert len(read(tmp_path, trackpy(parts), particles="0,1", **OPTIONS).seconds) == 25
    assert_read(read(tmp_path, trackpy(parts), particles="0,1+7", **OPTIONS))
    assert "7 (15 frames, 25 to 39)" in refused(tmp_path, trackpy(parts), **OPTIONS)
    assert "0+1 must be parts of one track" in refused(tmp_path, trackpy(parts), particles="0+1,7", **OPTIONS)


def test_particles_that_exchange_their_names_are_put_back(tmp_path: Path) -> None:
    table = positions(third=True)
    two = table[table["particle"] < 2]
    assert_read(read(tmp_path, trackpy(renamed(two, 20, {0: 1, 1: 0})), **OPTIONS))  # which changes no distance
    with_third = renamed(table, 25, {1: 2, 2: 1})
    film = read(tmp_path, trackpy(with_third), particles="0,1", **OPTIONS)
    assert_read(film)
    assert film.notes[1] == "corrected: 1 and 2, whose names are exchanged from frame 25 on"
    for_a_while = renamed(table, 25, {1: 2, 2: 1}, 33)
    film = read(tmp_path, trackpy(for_a_while), particles="0,1", **OPTIONS)
    assert_read(film)
    assert film.notes[1] == "corrected: 1 and 2, whose names are exchanged from frame 25, 33 on"


def test_a_track_that_goes_on_with_another_particle_is_refused_with_the_line(tmp_path: Path) -> None:
    table = positions()
    jumps = table.assign(x=table["x"].mask((table["particle"] == 1) & (table["frame"] >= 25), table["x"] + 60))
    assert "film.csv:52: must not jump: 0 or 1 is another particle here" in refused(tmp_path, trackpy(jumps), **OPTIONS)


def test_a_particle_that_stays_itself_does_not_take_over(tmp_path: Path) -> None:
    """Particle 1 goes on as one far behind, and 2 is near to where 1 would be, but was there before."""
    table = positions(third=True).assign(x=lambda table: table["x"].mask(table["particle"] == 2, table["x"] - 95))
    far = table.assign(x=table["x"].mask((table["particle"] == 1) & (table["frame"] >= 25), table["x"] - 170))
    said = refused(tmp_path, trackpy(far), particles="0,1", **OPTIONS)
    assert "must not jump: 0 or 1 is another particle here" in said


def test_a_jump_that_only_the_diameter_tells_from_motion_is_refused(tmp_path: Path) -> None:
    """Beads four diameters apart, and one of them is the next bead, 1.5 diameters on, from a frame on."""
    distances = 80 + 0.1 * FRAMES + 30 * (FRAMES >= 20)
    table = positions().assign(x=np.concatenate([MIDDLE, MIDDLE + distances]))
    film = read(tmp_path, trackpy(table), fps=FPS, pixel="1um")
    with pytest.raises(InputError, match=r"film.csv:42: must not jump by more than half a diameter"):
        film.gaps(20e-6)
    smooth = read(tmp_path, trackpy(table.assign(x=np.concatenate([MIDDLE, MIDDLE + 80 + FRAMES]))), **OPTIONS)
    assert len(smooth.gaps(20e-6)) == N


def test_a_stage_that_is_moved_and_a_coarse_film_are_no_jumps(tmp_path: Path) -> None:
    moved = positions().assign(x=lambda table: table["x"] - 200 * (table["frame"] >= 20))
    assert_read(read(tmp_path, trackpy(moved), **OPTIONS))
    apart = np.array([40, 65, 90, 115, 140])  # px, more than half of the least distance from frame to frame
    rows = "".join(f"{i},{k},{50 * i + k * c},20\n" for i, c in enumerate(apart) for k in (0, 1))
    coarse = read(tmp_path, f"frame,particle,x,y\n{rows}", fps=10, pixel="1um")
    np.testing.assert_allclose(1e6 * coarse.metres, apart)


def test_distances_are_those_in_the_plane(tmp_path: Path) -> None:
    """The channel need not be along x."""
    turned = positions().assign(x=lambda table: 0.6 * table["x"] + 7, y=lambda table: 0.8 * table["x"])
    original = positions()
    turned = original.assign(x=0.6 * original["x"] + 7, y=0.8 * original["x"] + 3)
    assert_read(read(tmp_path, trackpy(turned), **OPTIONS))
    along_x = "t [s],x1 [um],x2 [um]\n0,4,30\n0.1,5,32\n"
    np.testing.assert_allclose(1e6 * read(tmp_path, along_x).metres, [26, 27])


def test_a_distance_beside_positions_of_both_particles_is_refused(tmp_path: Path) -> None:
    """It may be a diameter, or a distance between centres."""
    said = refused(tmp_path, "t [s],x1 [um],x2 [um],d [um]\n0,0,30,20\n0.1,0,32,20\n")
    assert "must not have positions of each particle and distances" in said


def test_a_particle_that_is_twice_in_a_frame(tmp_path: Path) -> None:
    table = positions()
    again = pd.concat([table, table.iloc[[10]]])
    film = read(tmp_path, again.to_csv(), **OPTIONS)
    assert_read(film)
    assert film.notes[1] == "left out: 1 repeated row"
    other = pd.concat([table, table.iloc[[10]].assign(x=300.0)])
    said = refused(tmp_path, other.to_csv(), **OPTIONS)
    assert "film.csv:82: must have particle 0 once in each frame, but has it in line 12, too" in said


@pytest.mark.slow
def test_a_modulus_follows_from_a_table_of_a_tracker(tmp_path: Path) -> None:
    """The table of the page about films: a pair with a modulus of 2 kPa, and another bead ahead."""
    options: dict[str, Any] = {"fps": 500, "pixel": "0.65 +- 0.01 um", "particles": "0,2"}
    found = api.fit(ROOT / "docs" / "how-to" / "films" / "tracks.csv", BENCH, **options)
    modulus = found.values["modulus"]
    assert modulus.unit == "kPa"
    assert modulus.least < 2 < modulus.most
    assert modulus.value == pytest.approx(2, rel=0.05)
    assert found.parts is not None
    assert found.parts["modulus"]["pixel"] > 0.02
    assert "left out: 3 frames in which only one of the two is seen" in found.notes


def test_a_film_of_centres_is_drawn_beside_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "film.csv").write_text(trackpy(positions()))
    (run := tmp_path / "run").mkdir()
    scales = {"length": 50e-6, "time": 5.89e-3, "velocity": 8.49e-3, "stress": 1.0}
    (run / "run.json").write_text(json.dumps({"kind": "run", "status": "finished", "scales": scales}))
    (run / "case.yaml").write_text("beta: [0.4, 0.44]\nDe: 0\nCa_e: 0.1\nd0: 0.1\n")
    (run / "series.csv").write_text("t,d,z_L,z_T\n0,0.1,1.02,0.5\n20,0.2,1.12,0.5\n")
    with drawn_figures(monkeypatch) as figures:
        api.plot(run, tmp_path / "film.csv", out=tmp_path, **OPTIONS)
    seen = np.concatenate([line.get_ydata() for line in figures[0].axes[0].lines if len(line.get_ydata()) == N])
    np.testing.assert_allclose(seen, PIXEL * CENTRES - 21, atol=1e-6)  # 21 um between 20 and 22
    with pytest.raises(InputError, match="fps: must be given"):
        api.plot(run, tmp_path / "film.csv", out=tmp_path, pixel="1um")
    with pytest.raises(InputError, match="fps: got 500; must be left out without a film"):
        api.plot(run, out=tmp_path, fps=500)
    with pytest.raises(InputError, match="must be a single film, with runs or curves"):
        api.plot(run, tmp_path / "film.csv", tmp_path / "film.csv", out=tmp_path, **OPTIONS)
