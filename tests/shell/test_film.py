"""Films as trackers and spreadsheets write them: which distances are read, and what is refused with its line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from support.commands import Pairsim
from support.inputs import ROOT
from support.pictures import drawn_figures

import pairsim as api
from pairsim.api.film import Film, film_of
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

N, FPS, PIXEL = 40, 500, 0.65
FRAMES = np.arange(N)
MIDDLE = 100 + 8.0 * FRAMES  # px
CENTRES = 40 + 0.3 * FRAMES  # their distance, px
OPTIONS: dict[str, Any] = {"fps": FPS, "pixel": f"{PIXEL} um"}
D = "t [s],d [um]\n"
BENCH = {
    "physical": {
        **{"tube": "50 um", "particle": "20 um", "flow_rate": "1 ul/min"},
        **{"viscosity": "1 Pa.s", "distance": "5 um", "particle_difference": "0 %"},
    }
}


def positions(third: bool = False) -> pd.DataFrame:
    """Frame, particle, x and y [px] of two particles, or of a third one far ahead."""
    both = [MIDDLE - CENTRES / 2, MIDDLE + CENTRES / 2] + [MIDDLE + CENTRES / 2 + 120] * third
    tracks = [pd.DataFrame({"frame": FRAMES, "particle": k, "x": x, "y": 50.0}) for k, x in enumerate(both)]
    return pd.concat(tracks, ignore_index=True)


def renamed(table: pd.DataFrame, first: int, names: dict[int, int], last: int = N) -> pd.DataFrame:
    """A table in which particles have other names in some frames."""
    later = (table["frame"] >= first) & (table["frame"] < last)
    return table.assign(particle=table["particle"].mask(later, table["particle"].replace(names)))


def trackpy(table: pd.DataFrame, **options: Any) -> str:
    """What `DataFrame.to_csv` makes of linked features, sorted by frames, with an index without a name."""
    more = {"mass": 5145.29, "size": 7.93, "ecc": 0.06, "signal": 61.0, "raw_mass": 22068.1, "ep": 0.03}
    columns = ["y", "x", *more, "frame", "particle"]
    return table.assign(**more)[columns].sort_values("frame", kind="stable").to_csv(**options)


def trackmate(table: pd.DataFrame, length: str = "pixel", time: str = "frame", step: float = 1.0) -> str:
    """Spots of TrackMate 7: keys, names, short names and units above, and a spot that belongs to no track."""
    keys = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS,VISIBILITY"
    names = "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,Radius,Visibility"
    short = "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,R,Visibility"
    units = f",,,(quality),({length}),({length}),({length}),({time}),,({length}),"
    rows = [
        f"ID{i},{i},{row.particle:.0f},5.65,{row.x},{row.y},0.0,{row.frame * step},{row.frame:.0f},2.5,1"
        for i, row in enumerate(table.itertuples())
    ]
    return "\n".join([keys, names, short, units, *rows, f"ID999,999,,5.1,7.0,8.0,0.0,{3 * step},3,2.5,1", ""])


def manual_tracking(table: pd.DataFrame) -> str:
    """Results of Manual Tracking of ImageJ, whose distances are those from one frame to the next."""
    heading = " \tTrack n°\tSlice n°\tX\tY\tDistance\tVelocity\tPixel Value"
    rows = [
        f"{i + 1}\t{row.particle + 1}\t{row.frame + 1}\t{row.x}\t{row.y}\t{'-1' if row.frame == 0 else 8.1}\t4.2\t12"
        for i, row in enumerate(table.itertuples())
    ]
    return "\n".join([heading, *rows, ""])


def mtrack2(table: pd.DataFrame) -> str:
    """Tracks of MTrack2 side by side, a title below the headings, flags, and path lengths at the end."""
    lines = ["Frame\tX1\tY1\tFlag1\tX2\tY2\tFlag2", "Tracks 1 to 2"]
    for frame in FRAMES:
        cells = []
        for particle in (0, 1):
            seen = table[(table["frame"] == frame) & (table["particle"] == particle)]
            cells += (
                [f"{seen['x'].iloc[0]}", f"{seen['y'].iloc[0]}", "*" if frame == 9 else " "] if len(seen) else [" "] * 3
            )
        lines.append("\t".join([str(frame + 1), *cells]))
    more = ["", "Track \tLength\tDistance traveled\tNr of Frames", "1\t322.1\t320.0\t40", "2\t330.2\t331.7\t40", ""]
    return "\n".join([*lines, *more])


def mosaic(table: pd.DataFrame) -> str:
    """Trajectories of the MOSAIC particle tracker, in a table of ImageJ."""
    rows = [
        f"{i + 1},{row.particle + 1},{row.frame},{row.x:.3f},{row.y:.3f},0,4.208,2.083"
        for i, row in enumerate(table.itertuples())
    ]
    return "\n".join([" ,Trajectory,Frame,x,y,z,m0,m1", *rows, ""])


def imagej(table: pd.DataFrame) -> str:
    """Results of Analyze Particles in a stack: no column says which particle is which."""
    table = table.sort_values("frame", kind="stable")
    rows = [
        f"{i + 1},beads.tif:{row.frame + 1:04d},314,{row.x:.3f},{row.y:.3f},{row.x:.3f},{row.y:.3f},{row.frame + 1}"
        for i, row in enumerate(table.itertuples())
    ]
    return "\n".join([" ,Label,Area,X,Y,XM,YM,Slice", *rows, ""])


def imaris(table: pd.DataFrame) -> str:
    """Positions of Imaris: a title, units in a column, numbers of frames as times."""
    rows = [
        f"{PIXEL * row.x},{PIXEL * row.y},0,um,Spot,Position,{row.frame + 1},{1000000000 + row.particle},{i},"
        for i, row in enumerate(table.itertuples())
    ]
    heading = "Position X,Position Y,Position Z,Unit,Category,Collection,Time,TrackID,ID,"
    return "\n".join(["Position", "====================", " ", heading, *rows, ""])


def cellprofiler(table: pd.DataFrame) -> str:
    """Objects of CellProfiler."""
    columns = {"frame": "ImageNumber", "x": "Location_Center_X", "y": "Location_Center_Y"}
    table = table.assign(TrackObjects_Label_30=table["particle"] + 1, ObjectNumber=table["particle"] + 1)
    return table.rename(columns=columns).drop(columns="particle").to_csv(index=False)


def napari(table: pd.DataFrame) -> str:
    """Tracks as of napari and SPOT-On: t is the number of the frame."""
    columns = {"particle": "track_id", "frame": "t"}
    return table.rename(columns=columns)[["track_id", "t", "y", "x"]].to_csv(index=False)


def read(folder: Path, text: str, encoding: str = "utf-8", **options: Any) -> Film:
    (folder / "film.csv").write_bytes(text.encode(encoding))
    return film_of(folder / "film.csv", **options)


def refused(folder: Path, text: str, **options: Any) -> str:
    """What is said of a film that is refused, without its folder."""
    with pytest.raises(InputError) as caught:
        read(folder, text, **options)
    return str(caught.value).replace(f"{folder}/", "")


def assert_read(film: Film, frames: Array = FRAMES, tolerance: float = 1e-6) -> None:
    """That a film has the distances of `positions`."""
    np.testing.assert_allclose(film.seconds - film.seconds[0], (frames - frames[0]) / FPS, atol=1e-12)
    np.testing.assert_allclose(1e6 * film.metres, PIXEL * CENTRES[frames], atol=tolerance)
    assert film.from_centres


@pytest.mark.parametrize("table", [trackpy, trackmate, manual_tracking, mtrack2, mosaic, imagej, cellprofiler, napari])
def test_tables_of_trackers_are_read_as_they_are(table: Any, tmp_path: Path) -> None:
    film = read(tmp_path, table(positions()), **OPTIONS)
    assert_read(film, tolerance=1e-3)
    assert film.pixel == pytest.approx((PIXEL * 1e-6, 0))
    assert "40 frames" in film.notes[0]
    assert "500 frames per second" in film.notes[0]


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
    assert "must have a unit as m is, not furlong" in refused(tmp_path, trackmate(um, "furlong", "sec", 1 / FPS))


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
    assert "tracks.csv: --fps: must be given: the film has numbers of frames" in done.stderr
    assert "tracks.csv: --pixel: must be given, such as '.65 +- .01 um'" in done.stderr
    assert "0 (40 frames, 0 to 39), 1 (40 frames, 0 to 39), 2 (40 frames, 0 to 39)" in done.stderr


@pytest.mark.parametrize(
    ("options", "wrong"),
    [
        ({"pixel": "1um"}, "--fps: must be given: the film has numbers of frames"),
        ({"fps": 500}, "--pixel: must be given, such as '.65 +- .01 um' if it is in px, or 1um if it is in um"),
        (OPTIONS | {"fps": 0}, "--fps: got 0; must be frames per second above 0"),
        (OPTIONS | {"fps": "fast"}, "--fps: got 'fast'; must be frames per second above 0"),
        (OPTIONS | {"fps": float("nan")}, "--fps: got nan; must be frames per second above 0"),
        (OPTIONS | {"pixel": ".65"}, "--pixel: got '.65'; is not a number with a unit"),
        (OPTIONS | {"pixel": ".65 px"}, "--pixel: got '.65 px'; has the unit px, which is one of screens and print"),
        (OPTIONS | {"pixel": ".65 +- .7 um"}, "must have a half-width below its value"),
        (OPTIONS | {"particles": "0"}, "--particles: got '0'; must be two"),
        (OPTIONS | {"particles": (1, 1)}, "--particles: got '1,1'; must be two"),
        (OPTIONS | {"particles": "0,7"}, "which has no 7, and 0 (40 frames, 0 to 39), 1 (40 frames, 0 to 39)"),
    ],
)
def test_options_that_are_wrong(options: dict[str, Any], wrong: str, tmp_path: Path) -> None:
    assert wrong in refused(tmp_path, trackpy(positions()), **options)


def test_options_that_contradict_the_table(tmp_path: Path) -> None:
    um = trackmate(positions(), "micron", "sec", 0.04)  # of a film that plays at 25 frames per second
    assert '--pixel: must be left out: "POSITION X" is in micron' in refused(tmp_path, um, pixel=".65um")
    fast = read(tmp_path, um, fps=500)
    assert fast.seconds[1] == pytest.approx(0.002)
    assert '500 frames per second; column "POSITION T", which says 25, is not read' in fast.notes[0]
    assert "--fps: got '500'; must be left out: the film has times, column \"t [s]\"" in refused(
        tmp_path, D + "0,4\n1,5\n", fps=500
    )
    assert "--particles: got '1,2'; must be left out: the film has distances" in refused(
        tmp_path, D + "0,4\n1,5\n", particles="1,2"
    )


def test_a_frame_interval_that_nobody_has_set_is_none(tmp_path: Path) -> None:
    """TrackMate writes one second a frame where the film does not say how long it is."""
    text = trackmate(positions(), "micron", "sec", 1.0)
    assert "--fps: must be given: POSITION T counts frames, one a second" in refused(tmp_path, text)
    assert read(tmp_path, text, fps=1).seconds[1] == 1.0


def test_frames_that_have_one_time_or_one_number(tmp_path: Path) -> None:
    """A stack whose slices are depths, and a clock that stands still."""
    text = trackmate(positions().assign(frame=0), "micron", "sec", 1.0)
    assert "frame: got '0'; must be several: slices of a stack may have been taken for depths" in refused(
        tmp_path, text, fps=500
    )
    text = trackmate(positions(), "micron", "sec", 0.0)
    assert "--fps: must be given: POSITION T is the same in all rows" in refused(tmp_path, text)


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
    assert film.notes[1] == "put back: 1 and 2, which exchange their names from frame 25 on"
    for_a_while = renamed(table, 25, {1: 2, 2: 1}, 33)
    film = read(tmp_path, trackpy(for_a_while), particles="0,1", **OPTIONS)
    assert_read(film)
    assert film.notes[1] == "put back: 1 and 2, which exchange their names from frame 25, 33 on"


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


def test_a_particle_that_is_twice_in_a_frame(tmp_path: Path) -> None:
    table = positions()
    again = pd.concat([table, table.iloc[[10]]])
    film = read(tmp_path, again.to_csv(), **OPTIONS)
    assert_read(film)
    assert film.notes[1] == "left out: 1 repeated row"
    other = pd.concat([table, table.iloc[[10]].assign(x=300.0)])
    said = refused(tmp_path, other.to_csv(), **OPTIONS)
    assert "film.csv:82: must have particle 0 once in a frame, and has it in line 12, too" in said


def test_centres_need_a_smaller_diameter(tmp_path: Path) -> None:
    film = read(tmp_path, "t [s],c [um]\n0,26\n1,24.5\n2,25\n")
    np.testing.assert_allclose(1e6 * film.gaps(20e-6), [6, 4.5, 5])
    with pytest.raises(InputError, match=r"film.csv:3: has centres 24.5 um apart, less than the diameter .* 25 um"):
        film.gaps(25e-6)
    in_print = read(tmp_path, trackmate(positions().assign(x=lambda table: table["x"] / 72), "inch", "sec", 0.04))
    with pytest.raises(InputError, match="the unit, or the scale in the tracker, is another one, such as inch or cm"):
        in_print.gaps(20e-6)
    of_surfaces = read(tmp_path, D + "0,4\n1,5\n")
    np.testing.assert_allclose(of_surfaces.gaps(25e-6), of_surfaces.metres)


@pytest.mark.parametrize(
    "text",
    [
        "t [s],d [um]\n0,4\n0.01,4.1\n0.02,4.3\n",
        "t (s),d (µm)\n0,4\n0.01,4.1\n0.02,4.3\n",
        "t,d\ns,um\n0,4\n0.01,4.1\n0.02,4.3\n",
        "t,d\n[ms],[um]\n0,4\n10,4.1\n20,4.3\n",
        "Zeit in s;d in um\n0;4\n0,01;4,1\n0,02;4,3\n",
        "sep=;\nt [s];d [um]\n0;4\n0,01;4,1\n0,02;4,3\n",
        "sep=|\nt [s]|d [um]\n0|4\n0.01|4.1\n0.02|4.3\n",
        "time_ms\tgap_um\n0\t4\n10\t4.1\n20\t4.3\n",
        "t/s, d/mm\n0, 4e-3\n0.01, 4.1e-3\n0.02, 4.3e-3\n",
        "t [s] d [um]\n0 4\n0.01 4.1\n0.02 4.3\n",
        '"t [s]","d [um]"\n"0","4"\n"0,01","4,1"\n"0,02","4,3"\n',
        "film 3, lens 20x\n\nT [°C],t [s],d [um],c [mM]\n23,0,4,1\n23,0.01,4.1,1\n23,0.02,4.3,1\n",
        "t [s],d [um]\n0,4\n,4.05\n0.01,4.1\n0.015,\n0.017,NaN\n0.02,4.3\n",
        "t [s],d [um],,\n0,4,,\n0.01,4.1\n0.02,4.3,,\n",
        "t [s],d [um]\n0.02,4.3\n0.01,4.1\n0,4\n",
    ],
)
def test_columns_of_times_and_distances(text: str, tmp_path: Path) -> None:
    film = read(tmp_path, text)
    np.testing.assert_allclose((film.seconds, 1e6 * film.metres), ([0, 0.01, 0.02], [4, 4.1, 4.3]))
    assert not film.from_centres


def test_what_is_left_out_or_turned_round_is_said(tmp_path: Path) -> None:
    film = read(tmp_path, D + "0,4\n,4.05\n0.01,4.1\n0.015,\n0.02,4.3\n")
    assert film.notes[1] == "left out: 2 rows without a number, of 5: line 3, 5"
    untimed = read(tmp_path, "frame,t [s],d [um]\n0,0,4\n1,,4.1\n2,0.02,4.3\n")
    assert untimed.notes[1] == "left out: 1 frame without a time"
    np.testing.assert_allclose(untimed.seconds, [0, 0.02])
    turned = read(tmp_path, D + "0.02,4.3\n0.01,4.1\n0,4\n")
    assert turned.notes[1] == "turned round: rows are in descending order of time"


def test_numbers_of_frames_beside_distances(tmp_path: Path) -> None:
    for heading in ("frame", "Slice n°", "Frame #", "t [frame]", "t"):
        film = read(tmp_path, f"{heading},d [um]\n1,4\n2,4.1\n5,4.3\n", fps="100 fps")
        np.testing.assert_allclose(film.seconds, [0.01, 0.02, 0.05])
    assert "frame: got 0.5; must be whole" in refused(tmp_path, "frame,d [um]\n0,4\n0.5,5\n", fps=100)
    ntsc = read(tmp_path, "frame,d [px]\n0,4\n1,4.1\n", fps="30000/1001", pixel="1um")
    assert ntsc.seconds[1] == pytest.approx(1001 / 30000)


def test_times_that_step_back_are_refused_with_the_line(tmp_path: Path) -> None:
    said = refused(tmp_path, D + "0,4\n0.01,4.1\n0.005,4.2\n0.02,4.3\n")
    assert said == "film.csv:4: t [s]: got '0.005 s'; must not step back: it is 0.01 s before"
    frames = refused(tmp_path, "frame,d [um]\n0,4\n1,4.1\n0,4.2\n1,4.3\n", fps=100)
    assert frames.startswith("film.csv:4: frame: got '0 s'; must not step back")
    tracks = "t [s],particle,x [um],y [um]\n0,1,0,9\n0,2,30,0\n.02,1,2,0\n.02,2,33,0\n.01,1,1,0\n.01,2,32,0\n"
    assert refused(tmp_path, tracks) == "film.csv:6: t [s]: must not step back, of particle 1"
    clock = trackmate(positions(), "micron", "sec", 0.01).replace(",0.3,30,", ",0.1,30,")
    assert "POSITION T" not in read(tmp_path, clock, fps=100).notes[0]
    assert "must not step back" in refused(tmp_path, clock)


def test_equal_times_are_one_frame_if_their_distances_are(tmp_path: Path) -> None:
    film = read(tmp_path, D + "0,4\n0.01,4.1\n0.01,4.2\n0.02,4.3\n0.03,4.5\n")
    np.testing.assert_allclose((film.seconds, 1e6 * film.metres), ([0, 0.01, 0.02, 0.03], [4, 4.15, 4.3, 4.5]))
    assert film.notes[1] == "merged: 1 row with the time of another one, into their mean"
    twice = read(tmp_path, D + "0,4\n0,4.01\n0.01,4.1\n0.01,4.11\n0.02,4.3\n0.02,4.31\n")  # in each frame
    assert len(twice.seconds) == 3
    for after in (4.3, 4.0):
        said = refused(tmp_path, f"{D}0,4\n0.01,4.1\n0.01,7.2\n0.02,{after}\n0.03,4.5\n")
        assert "film.csv:3: t [s]: got '0.01 s'; must have one distance at a time, and has 4.1, 7.2" in said
    assert "must not be the same in all rows" in refused(tmp_path, D + "0,4\n0,4.1\n0,4.2\n")


@pytest.mark.parametrize("distance", ["-4.1", "0", "-1e-9"])
def test_distances_that_are_not_positive_are_refused_with_the_line(distance: str, tmp_path: Path) -> None:
    said = refused(tmp_path, f"{D}0,4\n0.01,{distance}\n0.02,4.3\n")
    assert re.match(r"film.csv:3: d \[um\]: got '-?[\d.e-]+'; must be above 0: particles are swapped", said)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("t [s],d [um]\n0,4\n1,far\n", "film.csv:3: d [um]: got 'far'; must be a number"),
        ("t [s],d [um]\n0,5\n1,inf\n", "film.csv:3: d [um]: got 'inf'; must be a number"),
        ("t [s],d [um]\n0,far\n1,5\n", "film.csv:2: d [um]: got 'far'; must be a number"),
        ("t [s],d [um]\n", "film.csv: t [s]: must have numbers below it"),
        ("t [s],d [ms]\n0,5\n", "film.csv: d [ms]: must have a unit as m is, not ms"),
        ("t [m],d [um]\n0,5\n", "film.csv: t [m]: must have a unit as s is, not m"),
        ("t [s],d [point]\n0,5\n", "film.csv: d [point]: must have a unit as m is, not point"),
        ("t [s],d [px]\n0,5\n1,6\n", "film.csv: --pixel: must be given, such as '.65 +- .01 um': \"d [px]\" is in px"),
        ("t [s],d\n0,5\n1,6\n", "film.csv: d: must be a column with its unit, such as d [um]"),
        ("t,d [um]\n0,5\n1,6\n", "film.csv: t: must be a column with its unit, such as t [s]"),
        ("t [s],distance [um]\n0,5\n1,6\n", "must be headed d if it is between surfaces, c if it is between centres"),
        ("t [s],d [um],d [um]\n0,5,6\n1,6,7\n", "film.csv: d [um]: must be the heading of one column, not of several"),
        ("t [s],d [um]\n0,1,5\n0,2,6\n", "film.csv:2: must have a cell for each heading: has 3, and line 1 has 2"),
        ("t [s],T,d [um],n\n0,4,1\n1,5,1\n", "film.csv:2: must have a cell for each heading: has 3, and line 1 has 4"),
        ("t [s],d [um],n\n0,4,1\n1,5\n", "film.csv:3: must have a cell for each heading: has 2, and line 1 has 3"),
        ("t [s],d [um]\n0,4\n1,1.234,5\n", "film.csv:3: must have a cell for each heading"),
        ("t [s]\td [um]\n0,001\t4,125\n1,002\t5,250\n", None),
        ("t [s]\td [um]\n1,001\t4,125\n1,002\t5,250\n", "has 1,001, which may be one or a thousand"),
        ("", "film.csv: must be a table with headings, such as t [s], d [um]"),
        ("TRACK_ID,SPOT_SOURCE_ID,SPEED\n1,2,3\n", "and has TRACK ID, SPOT SOURCE ID, SPEED"),
        ("<?xml version='1.0'?>\n<Tracks nTracks='2'/>\n", "must be a table, and is XML: export the spots as CSV"),
        ("frame,particle,x,y\n1,1,4,5\n2,1,4,5\n", "--particles: must be two: the film has 1 (2 frames, 1 to 2)"),
        (
            "frame,particle,x,y\n1,1,4,5\n2,2,4,5\n",
            "--particles: must be two that are seen in one frame: 1 and 2 are not",
        ),
        ("frame,x,y\n1,4,5\n2,4,5\n", "must have two particles in a frame"),
        ("frame,particle,x [px],y [um]\n1,1,4,5\n1,2,4,5\n", "must have one unit with others, and they have"),
    ],
)
def test_what_is_wrong_in_a_film_is_named(text: str, wrong: str | None, tmp_path: Path) -> None:
    options = OPTIONS if text.startswith("frame") else {}
    if wrong is None:
        read(tmp_path, text, **options)
    else:
        assert wrong in refused(tmp_path, text, **options)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        film_of(tmp_path / "film.csv")
    (tmp_path / "film.xlsx").write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError, match="save the sheet with the table as CSV"):
        film_of(tmp_path / "film.xlsx")


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
    (run / "series.csv").write_text("t,d\n0,0.1\n20,0.2\n")
    with drawn_figures(monkeypatch) as figures:
        api.plot(run, tmp_path / "film.csv", out=tmp_path, **OPTIONS)
    seen = np.concatenate([line.get_ydata() for line in figures[0].axes[0].lines if len(line.get_ydata()) == N])
    np.testing.assert_allclose(seen, PIXEL * CENTRES - 21, atol=1e-6)  # 21 um between 20 and 22
    with pytest.raises(InputError, match="--fps: must be given"):
        api.plot(run, tmp_path / "film.csv", out=tmp_path, pixel="1um")
    with pytest.raises(InputError, match="--fps: got 500; must be left out: it goes with a film"):
        api.plot(run, out=tmp_path, fps=500)
    with pytest.raises(InputError, match="must be one film, with runs or curves"):
        api.plot(run, tmp_path / "film.csv", tmp_path / "film.csv", out=tmp_path, **OPTIONS)
