"""The file of a cytometer (.rtdc, HDF5): its events, and the attributes that moduli depend on."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pairsim.cases.attributes import Attribute
from pairsim.lab.cytometer.suspending_media import LIQUID
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError

if TYPE_CHECKING:
    import h5py

WIDTH = Attribute("setup:channel width", "um", 1, 1000)
FLOW_RATE = Attribute("setup:flow rate", "uL/s", 1e-4, 100)
PIXEL_SIZE = Attribute("imaging:pixel size", "um", 0.01, 5)
TEMPERATURE = Attribute("setup:temperature", "degC", *LIQUID, open=True)
PARTS = tuple(Attribute(f"setup:flow rate {part}", "uL/s", 0, 100) for part in ("sample", "sheath"))
MEDIUM, REGION, VISCOSITY = "setup:medium", "setup:chip region", "calculation:emodulus viscosity"
AREA, AREA_PX, DEFORMATION, CIRCULARITY, OF_EVENT = "area_um", "area_cvx", "deform", "circ", "temp"
SAME = 0.01  # relative difference up to which two numbers of a file agree
DRIFT = 5.0  # difference [K] between the temperatures of events and of the file above which there is a warning


type Stored = str | bytes | float | np.generic | Array
"""An attribute of an HDF5 file, as h5py gives it."""


@dataclass(frozen=True)
class CytometerFile:
    """The content of a cytometer's file, as far as moduli depend on it.

    Attributes:
        path: The file.
        attributes: Its attributes as they are stored.
        events: Values of the events by name, shape (m,) each; the number of temperatures may differ from m.
        others: Other files that it refers to for values of the events.
    """

    path: Path
    attributes: Mapping[str, Stored]
    events: dict[str, Array]
    others: tuple[str, ...] = ()

    def number(self, attribute: Attribute) -> float:
        """A number of the file, in the unit of the attribute.

        Raises:
            InputError: It is missing, or not physical.
        """
        if (value := self.attributes.get(attribute.key)) is None:
            raise InputError(str(self.path), attribute.key, None, "is missing in the file")
        try:
            return attribute.number(value)
        except ValueError as error:
            raise InputError(str(self.path), attribute.key, _plain(value), str(error)) from None

    def text(self, key: str, default: str = "") -> str:
        """A text in the attributes of the file; `default` if it is missing or is no text."""
        value = _plain(self.attributes.get(key, default))
        return value.strip() if isinstance(value, str) else default

    @cached_property
    def area(self) -> Array:
        """Area of the convex hull of each event [um^2], shape (m,); from that in pixels if the file has no other."""
        if AREA in self.events:
            return self.events[AREA]
        if AREA_PX in self.events:
            return self.events[AREA_PX] * self.number(PIXEL_SIZE) ** 2
        raise self._missing(AREA)

    @cached_property
    def deformation(self) -> Array:
        """Deformation of each event, 1 minus the circularity, shape (m,)."""
        if DEFORMATION in self.events:
            return self.events[DEFORMATION]
        if CIRCULARITY in self.events:
            return 1 - self.events[CIRCULARITY]
        raise self._missing(DEFORMATION)

    @cached_property
    def celsius(self) -> float:
        """Temperature [degC]: the median over the events that have a physical one, or else that of the file.

        Raises:
            InputError: Neither is physical.
        """
        measured = self._temperatures
        if (physical := TEMPERATURE.holds(measured)).any():
            return float(np.median(measured[physical]))
        if (own := self.attributes.get(TEMPERATURE.key)) is None and not np.isfinite(measured).any():
            raise InputError("pairsim moduli", Argument("celsius"), None, "must be given: the file does not have it")
        try:
            return TEMPERATURE.number(float(np.nanmedian(measured)) if own is None else own)
        except ValueError as error:
            key, value = (OF_EVENT, float(np.nanmedian(measured))) if own is None else (TEMPERATURE.key, _plain(own))
            raise InputError(str(self.path), key, value, f"{error}; give `celsius`") from None

    @property
    def _temperatures(self) -> Array:
        return self.events.get(OF_EVENT, np.array([]))

    def doubts(self) -> Iterator[str]:
        """Warnings of contradictions in the file, other than in temperatures, and of entries that are not used."""
        flow, parts = self.number(FLOW_RATE), [self.attributes.get(each.key) for each in PARTS]
        with suppress(ValueError, TypeError):
            total = sum(each.number(part) for each, part in zip(PARTS, parts, strict=True) if part is not None)
            if None not in parts and abs(total - flow) > SAME * flow:
                yield f"{FLOW_RATE.key}, {flow:g} uL/s, is not the sum of its parts (sample, sheath), {total:g} uL/s"
        areas, pixels = self.events.get(AREA), self.events.get(AREA_PX)
        if areas is not None and pixels is not None and areas.shape == pixels.shape:
            both, size = (areas > 0) & (pixels > 0), self.number(PIXEL_SIZE)
            found = float(np.median(np.sqrt(areas[both] / pixels[both]))) if both.any() else size
            if abs(found - size) > SAME * size:
                yield f"{PIXEL_SIZE.key} is {size:g} um, but by {AREA} over {AREA_PX} it is {found:.3g} um"
        if (viscosity := self.attributes.get(VISCOSITY)) is not None:
            yield f"{VISCOSITY}, {_plain(viscosity)}, was not used: the viscosity is that of the carrier"

    def doubtful_temperatures(self) -> Iterator[str]:
        """Warnings of contradictions in the temperatures of the file."""
        measured, own = self._temperatures, self.attributes.get(TEMPERATURE.key)
        wrong = np.isfinite(measured) & ~TEMPERATURE.holds(measured)
        if wrong.any():
            taken = "that of the others" if TEMPERATURE.holds(measured).any() else TEMPERATURE.key
            words = f"{OF_EVENT} of {wrong.sum()} of {measured.size} events cannot be that of a liquid"
            yield f"{words} in degC ({np.median(measured[wrong]):.4g}): {taken} was taken"
        elif measured.size and own is not None:
            with suppress(ValueError):
                if (off := abs(TEMPERATURE.number(own) - self.celsius)) > DRIFT:
                    yield f"{TEMPERATURE.key} is {off:.2g} K from the median of the events, which was taken"

    def _missing(self, name: str) -> InputError:
        cure = f", whose events are in other files: give one of these ({'; '.join(self.others)})"
        return InputError(str(self.path), name, None, f"is missing in the file{cure if self.others else ''}")


def read_cytometer_file(path: Path) -> CytometerFile:
    """Read an .rtdc file (HDF5).

    Raises:
        InputError: It cannot be read, was not measured in the channel, or has no area and deformation for each event.
    """
    import h5py

    try:
        import hdf5plugin  # noqa: F401  # registers the filters of compressed files
    except ImportError:
        filters = "; if it is compressed: pip install hdf5plugin"
    else:
        filters = ""
    try:
        opened = h5py.File(path, "r")
    except OSError as error:
        raise InputError(str(path), "", None, _why_closed(error)) from None
    with opened as file:
        group = file.get("events")
        if not isinstance(group, h5py.Group):
            raise InputError(str(path), "events", None, "must be a group: this is not a cytometer file (.rtdc)")
        try:
            attributes = dict(file.attrs)
            wanted = (AREA, AREA_PX, DEFORMATION, CIRCULARITY, OF_EVENT)
            events = {name: _values(path, name, group[name]) for name in wanted if name in group}
        except OSError as error:
            raise InputError(str(path), "events", None, f"cannot be read ({_words_of_hdf5(error)}){filters}") from None
        elsewhere = list(_basins(file))
    found = CytometerFile(path, attributes, events, tuple(elsewhere))
    lengths = {len(found.area), len(found.deformation)}
    if len(lengths) > 1:
        counts = ", ".join(f"{name}: {len(values)}" for name, values in events.items() if name != OF_EVENT)
        raise InputError(str(path), "events", None, f"must have the same number of values each, not {counts}")
    if lengths == {0}:
        raise InputError(str(path), "events", None, "must have at least one event")
    if (region := found.text(REGION, "channel")).lower() != "channel":
        raise InputError(str(path), REGION, region, "must be channel, where the flow deforms")
    return found


def _values(path: Path, name: str, stored: Any) -> Array:
    """The values of one quantity, one for each event, shape (m,)."""
    shape = getattr(stored, "shape", None)
    if shape is None or len(shape) != 1 or stored.dtype.kind not in "fiu":
        raise InputError(str(path), f"events/{name}", None, "must have one number for each event")
    return np.asarray(stored, dtype=float)


def _why_closed(error: OSError) -> str:
    """Why a file cannot be opened."""
    said = _words_of_hdf5(error)
    if isinstance(error, BlockingIOError) or "unable to lock" in said:
        return "another program has the file open for writing: close it there, or read a copy"
    if "already open for write" in said:
        cure = "or if that one has crashed, run h5clear -s on it"
        return f"the file was not closed by the program that writes it: close it there, {cure}"
    if error.errno:
        return f"cannot be read: {os.strerror(error.errno)}"
    return f"must be a cytometer file (.rtdc), which is HDF5 ({said})"


def _words_of_hdf5(error: OSError) -> str:
    """The message of HDF5 in an error: the words in parentheses, or all words if there are none."""
    words = str(error.args[-1]).replace("\n", " ")
    return words.partition("(")[2].removesuffix(")") or words


def _basins(file: h5py.File) -> Iterator[str]:
    """Files, addresses or groups that a file refers to for its events, as dclab writes them."""
    basins = file.get("basins")
    for name in basins if basins is not None else ():
        try:
            lines = [_plain(line) for line in basins[name]]
            basin = json.loads(" ".join(map(str, lines)))
            places = basin.get("paths") or basin.get("urls") or ()
            yield ", ".join(map(str, places)) or f"{basin.get('type', 'unknown')} {basin.get('name', '')}".strip()
        except (OSError, TypeError, ValueError, AttributeError):
            yield str(name)


def _plain(value: Any) -> Any:
    """A stored value as Python has it: an array of one entry is that entry, bytes are a text."""
    array = np.asarray(value)
    entry = array.reshape(-1)[0] if array.size == 1 else array.tolist()
    entry = entry.item() if isinstance(entry, np.generic) else entry
    return entry.decode(errors="replace") if isinstance(entry, bytes) else entry
