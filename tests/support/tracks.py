"""Tables of two particles as trackers write them, and what is read of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pairsim.lab.films.film import Film, film_of
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
