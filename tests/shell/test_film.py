"""Films as trackers and spreadsheets write them: which distances are read, and what is refused with its line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.tracks import (
    OPTIONS,
    D,
    positions,
    read,
    refused,
    trackmate,
)

from pairsim.lab.films.film import film_of
from pairsim.runtime.errors import InputError


def test_centres_need_a_smaller_diameter(tmp_path: Path) -> None:
    film = read(tmp_path, "t [s],c [um]\n0,26\n1,24.5\n2,25\n")
    np.testing.assert_allclose(1e6 * film.gaps(20e-6), [6, 4.5, 5])
    with pytest.raises(InputError, match=r"film.csv:3: has centres 24.5 um apart, less than the diameter .* 25 um"):
        film.gaps(25e-6)
    in_print = read(tmp_path, trackmate(positions().assign(x=lambda table: table["x"] / 72), "inch", "sec", 0.04))
    with pytest.raises(InputError, match="the unit, or the scale in the tracker, is wrong, such as inches or cm"):
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
        "t [s],D [um],d [um]\n0,20,4\n0.01,20,4.1\n0.02,20,4.3\n",
        "id,t [s],d [um]\n1,0,4\n2,0.01,4.1\n3,0.02,4.3\n",
        "t [s],d [um],,\n0,4,,\n0.01,4.1\n0.02,4.3,,\n",
        "% t [s]  d [um]\n  0.00e+00  4.0e+00\n  1.00e-02  4.1e+00\n  2.00e-02  4.3e+00\n",
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
    two = read(tmp_path, f"{D}0,4\n0.01,4.1\n\nfilm 2\n{D}0,8\n0.01,8.1\n")
    assert two.notes[1:] == ("not read: numbers below the end of the table, from line 7 on",)
    turned = read(tmp_path, D + "0.02,4.3\n0.01,4.1\n0,4\n")
    assert turned.notes[1] == "reversed: rows are in descending order of time"


def test_numbers_of_frames_beside_distances(tmp_path: Path) -> None:
    for heading in ("frame", "Slice n°", "Frame #", "t [frame]", "t"):
        film = read(tmp_path, f"{heading},d [um]\n1,4\n2,4.1\n5,4.3\n", fps="100 fps")
        np.testing.assert_allclose(film.seconds, [0.01, 0.02, 0.05])
    assert "frame: got 0.5; must be whole" in refused(tmp_path, "frame,d [um]\n0,4\n0.5,5\n", fps=100)
    ntsc = read(tmp_path, "frame,d [px]\n0,4\n1,4.1\n", fps="30000/1001", pixel="1um")
    assert ntsc.seconds[1] == pytest.approx(1001 / 30000)


def test_times_that_step_back_are_refused_with_the_line(tmp_path: Path) -> None:
    said = refused(tmp_path, D + "0,4\n0.01,4.1\n0.005,4.2\n0.02,4.3\n")
    assert said == "film.csv:4: t [s]: got '0.005 s'; must not step back: the row before has 0.01 s"
    frames = refused(tmp_path, "frame,d [um]\n0,4\n1,4.1\n0,4.2\n1,4.3\n", fps=100)
    assert frames.startswith("film.csv:4: frame: got '0 s'; must not step back")
    tracks = "t [s],particle,x [um],y [um]\n0,1,0,9\n0,2,30,0\n.02,1,2,0\n.02,2,33,0\n.01,1,1,0\n.01,2,32,0\n"
    assert refused(tmp_path, tracks) == "film.csv:6: t [s]: must not step back, as it does for particle 1"
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
        assert "film.csv:3: t [s]: got '0.01 s'; must have one distance at a time, but has 4.1, 7.2" in said
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
        ("t [s],d [um]\n0,5\n1,1e400\n", "film.csv:3: d [um]: got '1e400'; must be a number"),
        ("t [s],d [um]\n0,5\n1e31,6\n", "film.csv:3: t [s]: got '1e31'; must be a number"),
        ("t [s],d [um]\n0,far\n1,5\n", "film.csv:2: d [um]: got 'far'; must be a number"),
        ("t [s],d [um]\n", "film.csv: t [s]: must have numbers below it"),
        ("t [s],d [ms]\n0,5\n", "film.csv: d [ms]: must have a unit such as m, not ms"),
        ("t [m],d [um]\n0,5\n", "film.csv: t [m]: must have a unit such as s, not m"),
        ("t [s],d [point]\n0,5\n", "film.csv: d [point]: must have a unit such as m, not point"),
        ("t [s],d [px]\n0,5\n1,6\n", "film.csv: pixel: must be given, such as '.65 +- .01 um': \"d [px]\" is in px"),
        ("t [s],d\n0,5\n1,6\n", "film.csv: d: must be a column with its unit, such as d [um]"),
        ("t,d [um]\n0,5\n1,6\n", "film.csv: t: must be a column with its unit, such as t [s]"),
        ("t [s],distance [um]\n0,5\n1,6\n", "must be headed d if it is between surfaces, c if it is between centres"),
        ("t [s],D [um]\n0,5\n1,6\n", "film.csv: D [um]: must be headed d if it is between surfaces"),
        (
            "t [s],bead,d [um]\n0,1,20\n0,2,20\n1,1,20\n1,2,20\n",
            "film.csv:2: d [um]: must be that of pairs, but particles 1, 2 have one each at one time, as diameters do",
        ),
        ("t [s],d [um],d [um]\n0,5,6\n1,6,7\n", "film.csv: d [um]: must be the heading of one column, not of several"),
        ("t [s],d [um]\n0,1,5\n0,2,6\n", "film.csv:2: must have a cell for each heading: has 3, but line 1 has 2"),
        ("t [s],T,d [um],n\n0,4,1\n1,5,1\n", "film.csv:2: must have a cell for each heading: has 3, but line 1 has 4"),
        ("t [s],d [um],n\n0,4,1\n1,5\n", "film.csv:3: must have a cell for each heading: has 2, but line 1 has 3"),
        ("t [s],d [um]\n0,4\n1,1.234,5\n", "film.csv:3: must have a cell for each heading"),
        ("t [s]\td [um]\n0,001\t4,125\n1,002\t5,250\n", None),
        ("t [s]\td [um]\n1,001\t4,125\n1,002\t5,250\n", "has 1,001, whose comma may mark decimals or thousands"),
        ("", "film.csv: must be a table with headings, such as t [s], d [um]"),
        ("TRACK_ID,SPOT_SOURCE_ID,SPEED\n1,2,3\n", "but has TRACK ID, SPOT SOURCE ID, SPEED"),
        ("<?xml version='1.0'?>\n<Tracks nTracks='2'/>\n", "must be a table, but is XML: export the spots as CSV"),
        ("frame,particle,x,y\n1,1,4,5\n2,1,4,5\n", "particles: must be two: the film has 1 (2 frames, 1 to 2)"),
        (
            "frame,particle,x,y\n1,1,4,5\n2,2,4,5\n",
            "particles: must be two that are seen in one frame: 1 and 2 are not",
        ),
        ("frame,x,y\n1,4,5\n2,4,5\n", "must have two particles in a frame"),
        (
            "frame,particle,x [px],y [um]\n1,1,4,5\n1,2,4,5\n",
            "must have the same unit as other lengths, but these have",
        ),
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
