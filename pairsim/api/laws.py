"""Laws of one's own in Python: `use_laws`, and objects as values of `liquid` and `solid`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from pairsim.physics.material import Material
from pairsim.physics.own_laws import file_of, load_file, name_file
from pairsim.physics.solids import Solid
from pairsim.runtime.errors import InputError

DECLARED = "pairsim.physics.declared"  # the module that lists the laws for case files, once it is imported


def use_laws(*laws: str | PathLike[str] | type[Material]) -> None:
    """Make laws of one's own known, before the first case is read; processes of sweeps know them, too.

    Args:
        laws: Files as for `--laws`, or classes that are defined in a file.

    Raises:
        InputError: A file or class cannot be used, or a case has been read already.
    """
    for each in laws:
        file = file_of(each) if isinstance(each, type) else Path(each)
        if file is None:  # it ships
            continue
        name_file(file)
        for law in [each] if isinstance(each, type) else load_file(file):
            if DECLARED in sys.modules and law.name not in sys.modules[DECLARED].LAWS:
                allowed = "must be known before the first case is read: import it, or call pairsim.use_laws, earlier"
                raise InputError("pairsim.use_laws", law.__name__, None, allowed)


def with_blocks(keys: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a case with blocks in place of laws; the Ca_e of a solid is that of the case if this has none.

    Raises:
        InputError: A law cannot be used.
    """
    found = dict(keys)
    for key in ("liquid", "solid"):
        value = found.get(key)
        each = value if isinstance(value, list | tuple) else [value]
        if not any(isinstance(law, Material) for law in each):
            continue
        use_laws(*(type(law) for law in each if isinstance(law, Material)))
        blocks = [_block(law) if isinstance(law, Material) else law for law in each]
        found[key] = blocks if isinstance(value, list | tuple) else blocks[0]
        Ca_es = [law.Ca_e for law in each if isinstance(law, Solid)]
        if Ca_es:
            found.setdefault("Ca_e", Ca_es if len(Ca_es) > 1 else Ca_es[0])
    return found


def _block(law: Material) -> dict[str, Any]:
    return {"law": law.name} | {name: getattr(law, name) for name in law.parameters()}
