"""Distances of two particles from the tracks that programs find in films."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from pairsim.lab.films.film_table import GAPS, Column, FilmTable
from pairsim.lab.films.headings import FRAME, PARTICLE, Heading, X, Y
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument
from pairsim.runtime.text import counted

NAMED = 12  # largest number of particles, or frames, that a sentence names
USUAL = 5.0  # ratio to their median up to which deviations from a steady change of the distance are usual; chosen
NEAREST = 0.1  # quantile of the distances that counts as the least one, as a few may be wrong; chosen
LOST = 0.0, -1.0  # both coordinates of a particle that is lost, as some trackers write
UNTRACKED = GAPS | {"-1"}


class Distances(NamedTuple):
    """Distances of the centres of two particles.

    Attributes:
        d: Distances in the unit of the positions, by the number of their line.
        notes: Whose they are, and then what was left out and put right, in phrases.
    """

    d: pd.Series[float]
    notes: list[str]


def distances_of(table: FilmTable, wanted: str | Sequence[object] | None) -> Distances:
    """Distances of two particles in the plane of the film, in the frames in which both are seen.

    Args:
        table: A table with positions.
        wanted: Names of the two particles; those that are parts of one track are joined by a plus sign.

    Raises:
        InputError: It is not clear which particles are meant, or a track goes on with another particle.
    """
    notes: list[str] = []
    positions = _positions(table, notes)
    planar = all(Y in each for each in table.placed)
    lost = (positions["x"] == positions["y"]) & positions["x"].isin(LOST) & planar
    if lost.any():
        notes.append(f"left out: {counted(int(lost.sum()), 'position')} 0, 0 or -1, -1, of particles that were lost")
        positions = positions[~lost]
    if len(positions) > 2 and positions["key"].nunique() == 1:
        allowed = "must be several: slices of a stack may have been taken for depths"
        raise table.error("frame", f"{positions['key'].iloc[0]:g}", allowed, int(positions["line"].iloc[0]))
    if (positions["name"] == "").all():
        if wanted is not None:
            raise table.error(
                Argument("particles"), _text(wanted), "must be left out: no column tells the particles apart"
            )
        return Distances(_without_names(table, positions, notes), notes)
    tracks = _tracks(table, positions, notes)
    pair = _pair(table, tracks, wanted)
    one, two = _untangled(table, tracks, pair, notes)
    if one.empty:
        never = f"must be two that are seen in one frame: {pair[0]} and {pair[1]} are not"
        raise table.error(Argument("particles"), None if wanted is None else _text(wanted), never)
    alone = len(tracks[pair[0]].index.union(tracks[pair[1]].index)) - len(one)
    if alone:
        notes.append(f"left out: {counted(alone, 'frame')} in which only one of the two is seen")
    steps = two[["x", "y"]].to_numpy() - one[["x", "y"]].to_numpy()
    d = pd.Series(np.hypot(*steps.T), index=one["line"].to_numpy())
    return Distances(d, [f"centres of {pair[0]} and {pair[1]}", *notes])


def named(values: Iterable[object], most: int = NAMED) -> str:
    """Values in a sentence, the first ones if there are many."""
    texts = [f"{each:.10g}" if isinstance(each, float) else str(each) for each in values]
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")


def _positions(table: FilmTable, notes: list[str]) -> pd.DataFrame:
    """Columns "key", "name" ("" without one), "x", "y" and "line" of all particles."""
    keys = table.clock.numbers
    if table.particles:
        several = table.particles.items()
        parts = [_of_columns(each, keys.index.to_series()).assign(name=name) for name, each in several]
        return pd.concat(parts).dropna().sort_values("line", kind="stable")
    found = _of_columns(table.columns, keys)
    names = table.columns.get(PARTICLE)
    if names is None:
        found["name"] = ""
    else:
        cells = names.cells.where(names.numbers.isna(), names.numbers.map("{:.15g}".format))
        found["name"] = cells.where(~cells.str.lower().isin(UNTRACKED), "")
    whole = found.dropna()
    if len(whole) < len(found):
        lines = found.index.difference(whole.index)
        notes.append(f"left out: {counted(len(lines), 'row')} without a number, of {len(found)}: line {named(lines)}")
    if names is not None and 0 < (whole["name"] == "").sum() < len(whole):
        notes.append(f"left out: {counted(int((whole['name'] == '').sum()), 'row')} of particles without a track")
        whole = whole[whole["name"] != ""]
    return whole


def _of_columns(columns: Mapping[Heading, Column], keys: pd.Series[float]) -> pd.DataFrame:
    axes = {axis.name: columns[axis].numbers if axis in columns else 0.0 for axis in (X, Y)}
    return pd.DataFrame({"key": keys, **axes, "line": keys.index}, index=keys.index)


def _without_names(table: FilmTable, positions: pd.DataFrame, notes: list[str]) -> pd.Series[float]:
    """Distances in the frames that have two particles, for which it does not matter which is which."""
    frames = positions.groupby("key")
    many = positions[frames["x"].transform("size") > 2]
    if len(many):
        wrong = f"has {len(frames.get_group(many['key'].iloc[0]))} particles in one frame"
        allowed = f"must have a column that tells the particles apart, such as particle: {wrong}"
        raise table.error("", None, allowed, int(many["line"].iloc[0]))
    pairs = positions[frames["x"].transform("size") == 2].sort_values("key", kind="stable")
    if pairs.empty:
        raise table.error("", None, "must have two particles in a frame")
    notes.insert(0, "centres of the two in each frame")
    if left := len(positions) - len(pairs):
        notes.append(f"left out: {counted(left, 'frame')} with one particle only")
    one, two = (pairs[["x", "y"]].to_numpy()[i::2] for i in (0, 1))
    return pd.Series(np.hypot(*(two - one).T), pairs["line"][::2])


def _tracks(table: FilmTable, positions: pd.DataFrame, notes: list[str]) -> dict[str, pd.DataFrame]:
    """Positions of each particle by the key of the frame, in ascending order."""
    unique = positions.drop_duplicates(["key", "name", "x", "y"])
    if twice := len(positions) - len(unique):
        notes.append(f"left out: {counted(twice, 'repeated row')}")
    again = unique[unique.duplicated(["key", "name"])]
    if len(again):
        name, key, line = again["name"].iloc[0], again["key"].iloc[0], int(again["line"].iloc[0])
        first = unique[(unique["name"] == name) & (unique["key"] == key)]["line"].iloc[0]
        raise table.error(
            "", None, f"must have particle {name} once in each frame, but has it in line {first}, too", line
        )
    tracks = {}
    for name, track in unique.groupby("name", sort=False):
        if FRAME not in table.columns and (back := np.flatnonzero(np.diff(track["key"]) < 0)).size:
            line = int(track["line"].iloc[back[0] + 1])
            of = track["name"].iloc[0]
            raise table.error(table.clock.heading, None, f"must not step back, as it does for particle {of}", line)
        tracks[str(name)] = track.set_index("key").sort_index()
    return tracks


def _pair(table: FilmTable, tracks: dict[str, pd.DataFrame], wanted: str | Sequence[object] | None) -> tuple[str, str]:
    """The names of the two particles: those wanted, or the only two; joined tracks replace their parts in `tracks`."""
    one, *others = tracks
    order = sorted(tracks, key=lambda name: -len(tracks[name])) if len(tracks) > NAMED else [*tracks]
    has = named(f"{name} ({counted(len(tracks[name]), 'frame')}, {_ends(tracks[name])})" for name in order)
    if wanted is None:
        if len(tracks) != 2:
            must = "must be given, such as 3,5" if len(order) > 2 else "must be two"
            raise table.error(Argument("particles"), None, f"{must}: the film has {has}")
        return one, others[0]
    given = re.split(r"[\s,;]+", wanted.strip()) if isinstance(wanted, str) else wanted
    names = ["+".join(map(_plain, str(each).split("+"))) for each in given]
    if len(names) != 2 or len({*names}) != 2:
        raise table.error(Argument("particles"), _text(wanted), f"must be two, such as 3,5: the film has {has}")
    for name in names:
        parts = name.split("+")
        if unknown := [part for part in parts if part not in tracks]:
            wrong = f"must be in the film, which has no {unknown[0]}, but {has}"
            raise table.error(Argument("particles"), _text(wanted), wrong)
        whole = pd.concat([tracks[part] for part in parts]).sort_index()
        if (twice := whole.index[whole.index.duplicated()]).size:
            wrong = f"{name} must be parts of one track, but both are in {twice[0]:.10g}"
            raise table.error(Argument("particles"), _text(wanted), wrong)
        for part in parts:
            del tracks[part]
        tracks[name] = whole
    return names[0], names[1]


def _untangled(
    table: FilmTable, tracks: dict[str, pd.DataFrame], pair: tuple[str, str], notes: list[str]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The tracks of a pair in the frames that they share, after names that were exchanged are put back.

    Two particles keep apart, and move alike from frame to frame. Where their distance jumps by more than half of the
    least distance, and by more than usual, one of the names belongs to another particle from there on.
    """
    exchanged: dict[str, list[float]] = {}
    last = -np.inf
    while True:
        one, two = (tracks[name] for name in pair)
        one, two = one[one.index.isin(two.index)], two[two.index.isin(one.index)]
        at = [each[["x", "y"]].to_numpy(dtype=float) for each in (one, two)]
        keys = one.index.to_numpy(dtype=float)
        jump = _next_jump(keys, at)
        if jump is None:
            break
        i, limit = jump
        key, found = float(keys[i]), []
        for k, name in enumerate(pair):
            partner = pd.Series([*at[1 - k]], keys)
            expected = at[k][i - 1] + partner[key] - partner[keys[i - 1]]
            found += [
                (name, other)
                for other, track in tracks.items()
                if other not in pair and _takes_over(track, key, expected, partner, limit)
            ]
        if len(found) != 1 or key <= last:
            line, hint = int(one["line"].iloc[i]), "take other `particles`, or the rows before"
            raise table.error("", None, f"must not jump: {pair[0]} or {pair[1]} is another particle here; {hint}", line)
        name, other = found[0]
        before, after = tracks[name], tracks[other]
        tracks[name] = pd.concat([before[before.index < key], after[after.index >= key]])
        tracks[other] = pd.concat([after[after.index < key], before[before.index >= key]])
        exchanged.setdefault(f"{name} and {other}", []).append(key)
        last = key
    what = "frame" if FRAME in table.columns else "time"
    for names, places in exchanged.items():
        notes.append(f"corrected: {names}, whose names are exchanged from {what} {named(places)} on")
    return one, two


def _takes_over(track: pd.DataFrame, key: float, expected: Array, partner: pd.Series[float], limit: float) -> bool:
    """Whether a track is, in a frame, where a particle of the pair is expected, and not nearer to its own course.

    Args:
        track: The other track.
        key: The frame.
        expected: The position of the particle that is expected there, shape (2,).
        partner: Positions of the other particle of the pair by frame, with which all are taken to move.
        limit: How far off the position may be.
    """
    if key not in track.index:
        return False
    there = track.loc[key, ["x", "y"]].to_numpy(dtype=float)
    off, before = np.linalg.norm(there - expected), track[track.index < key]
    if off > limit or before.empty:
        return bool(off <= limit)
    seen = before.index[-1]
    if seen not in partner.index:
        return False
    itself = before[["x", "y"]].to_numpy(dtype=float)[-1] + partner[key] - partner[seen]
    return bool(off < np.linalg.norm(there - itself))


def _next_jump(keys: Array, at: Sequence[Array]) -> tuple[int, float] | None:
    """The first frame in which one of two tracks goes on with another particle, and how far positions may be off there.

    Where both have exchanged their names, which leaves their midpoint as it is, nothing is wrong: the distance is the
    same. None if there is no such frame.

    Args:
        keys: Numbers or times of the frames, shape (frames,).
        at: Positions of both particles, shape (frames, 2) each.
    """
    if len(keys) < 3:
        return None
    apart, middle, gap = at[1] - at[0], (at[0] + at[1]) / 2, np.diff(keys)
    kept, turned = (np.hypot(*(apart[1:] - sign * apart[:-1]).T) for sign in (1, -1))
    exchanged = turned < kept
    apart = apart * np.cumprod([1, *np.where(exchanged, -1, 1)])[:, None]
    off, off_middle = (deviations(each, gap) for each in (apart, middle))
    limits = usual_limits(np.quantile(np.hypot(*apart.T), NEAREST) / 2, off, gap)
    jumps = np.flatnonzero((off > limits) | (exchanged & (off_middle > limits)))
    return (int(jumps[0]) + 1, float(limits[jumps[0]])) if jumps.size else None


def deviations(positions: Array, gap: Array) -> Array:
    """Distances of positions from where the median velocity brings them from the frame before, shape (frames - 1,).

    Args:
        positions: Points, shape (frames, coordinates).
        gap: Times between frames, in any unit.
    """
    moved = np.diff(positions, axis=0)
    return np.asarray(np.linalg.norm(moved - gap[:, None] * np.median(moved / gap[:, None], axis=0), axis=1))


def usual_limits(least: float, off: Array, gap: Array) -> Array:
    """The largest deviations with which a particle still counts as the same one, shape (frames - 1,).

    Args:
        least: The least that any of them may be.
        off: The result of `deviations`.
        gap: Times between frames, in any unit.
    """
    return np.maximum(least, USUAL * np.median(off / gap) * gap)


def _plain(name: object) -> str:
    """A name as a table has it, in which 3.0 is 3."""
    text = str(name).strip().replace("_", " ")
    try:
        return f"{float(text):.15g}"
    except ValueError:
        return text


def _text(wanted: str | Sequence[object]) -> str:
    return wanted if isinstance(wanted, str) else ",".join(map(str, wanted))


def _ends(track: pd.DataFrame) -> str:
    return f"{track.index[0]:.10g} to {track.index[-1]:.10g}"
