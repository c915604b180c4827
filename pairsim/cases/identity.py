"""Hashes that identify a case, and the folder names derived from them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.physics.own_laws import digest_of, file_of

RUNS = Path("runs")
LONGEST_SLUG = 100
SHOWN = 10  # digits of the hash in a folder name


def identity_of(case: SceneCase) -> dict[str, Any]:
    """The keys and values that identify a case: everything that affects its results, so all but the name.

    A list of equal values counts as one value, and parameters without effect are left out. The
    output times are included, since time steps land on them and they decide which fields are in the folder.
    """
    identity = case.resolved()
    identity.pop("name", None)
    if not case.liquid_model.modes:
        for key in ("xi", *(("liquid",) if case.liquid_model.newtonian else ())):
            identity.pop(key, None)
    if not any(case.Ca_es):
        identity.pop("solid", None)
    for key in ("beta", "Ca_e", "d0"):
        value = identity.get(key)
        if isinstance(value, list) and value and all(entry == value[0] for entry in value):
            identity[key] = value[0]
    return identity | sources_of(case)


def sources_of(case: SceneCase) -> dict[str, dict[str, str]]:
    """The entry `laws` with the hash of the source of each law of a user's own in a case; empty without any."""
    liquid = case.liquid_model
    laws = {type(law) for law in filter(None, (liquid.solvent, liquid.yielding, *liquid.modes, *case.solid_models))}
    found = {law.name: digest_of(file) for law in laws if (file := file_of(law)) is not None}
    return {"laws": dict(sorted(found.items()))} if found else {}


def key_of(command: str, identity: Mapping[str, Any]) -> str:
    """SHA-256 hash (hexadecimal) of a command and the identity of its case."""
    text = json.dumps({"command": command, **identity}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def folder_name(slug: str, key: str) -> str:
    """Folder name that is unique to a case: its slug and the beginning of its hash."""
    return f"{slug[:LONGEST_SLUG]}-{key[:SHOWN]}"


def default_folder(command: str, case: SceneCase, file: str = "") -> Path:
    """Default folder for the results: `runs/<name>`, or `runs/<file>-<hash>` for a case without a name.

    The file is named without its ending; where there is none, the parameters of the case take its place.
    """
    return RUNS / (case.name or folder_name(file or case.slug, key_of(command, identity_of(case))))
