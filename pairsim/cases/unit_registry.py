"""Pint's registry of units, whose parsed definitions are kept in the user's cache."""

from __future__ import annotations

import platform
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.quantities.kinds import Kind
from pairsim.quantities.scales import Scales
from pairsim.runtime.cache import cache_folder

if TYPE_CHECKING:
    import pint

WHOLE = "whole"
"""Name of a folder of definitions until it is renamed to that of the cache."""


@cache
def registry() -> pint.UnitRegistry:
    """Pint's registry of units: from the cache, which is filled first if it is empty and can be written to."""
    import pint  # takes a fifth of a second; most cases have no units

    kept = cache_folder() / f"units-pint-{pint.__version__}-python-{platform.python_version()}"
    try:
        if not kept.is_dir():
            _fill(kept)
        return pint.UnitRegistry(cache_folder=kept)
    except Exception:  # a file that cannot be read or written, or is no longer what was written: unpickling raises any
        shutil.rmtree(kept, ignore_errors=True)
        return pint.UnitRegistry()


def quantity(kind: Kind, number: Any, scales: Scales) -> Any:
    """A dimensionless number or array as a quantity of pint, in the unit in which its kind is shown.

    None, for an unknown number, stays None.
    """
    return None if number is None else registry().Quantity(number * kind.factor(scales), kind.physical)


def as_texts(given: Any) -> Any:
    """A quantity of pint as a text with its unit (as a number if it has none), an array of them as a list.

    Anything else is returned unchanged. The quantity may belong to any registry.
    """
    if not hasattr(given, "magnitude") or not hasattr(given, "units"):
        return given
    if getattr(given.magnitude, "ndim", 0):
        return [as_texts(each) for each in given]
    number, unit = float(given.magnitude), f"{given.units:~C}"
    return f"{number!r} {unit}" if unit else number


def has_unit(given: Any) -> bool:
    """Whether a text, or each text in nested lists, is more than a number."""
    if isinstance(given, list | tuple):
        return bool(given) and all(map(has_unit, given))
    if not isinstance(given, str):
        return False
    try:
        float(given)
    except ValueError:
        return True
    return False


def _fill(kept: Path) -> None:
    """Have pint write its cache into a new folder, which gets its final name when it is complete.

    Pint itself writes into files that other processes may be reading, and that are incomplete if it is killed.
    """
    import pint

    kept.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=kept.parent, prefix="unfinished-") as unfinished:
        whole = Path(unfinished) / WHOLE
        pint.UnitRegistry(cache_folder=whole)
        with suppress(OSError):  # another process was faster
            whole.rename(kept)
