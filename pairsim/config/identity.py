"""What makes two cases the same, and the names of folders that follow from it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pairsim.config.case import SceneCase
from pairsim.physics.materials.polymer import PARAMETERS

RUNS = Path("runs")
LONGEST_SLUG = 100
SHOWN = 10  # digits of a hash in the name of a folder


def identity_of(case: SceneCase) -> dict[str, Any]:
    """What makes two cases the same: all that changes a file of the folder, so everything but the name.

    Equal entries of a list are one number, and a Newtonian liquid has no parameters of a polymer. The outputs do count:
    steps land on their times, and a folder without the fields that were asked for is not that case.
    """
    identity = case.resolved()
    identity.pop("name", None)
    if case.polymer is None:
        for key in ("liquid", "xi", *PARAMETERS):
            identity.pop(key, None)
    for key in ("beta", "Ca_e", "d0"):
        value = identity.get(key)
        if isinstance(value, list) and value and all(entry == value[0] for entry in value):
            identity[key] = value[0]
    return identity


def key_of(command: str, identity: Mapping[str, Any]) -> str:
    """Hash of what a command computes of a case."""
    text = json.dumps({"command": command, **identity}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def folder_name(slug: str, key: str) -> str:
    """Name of a folder that no other case has."""
    return f"{slug[:LONGEST_SLUG]}-{key[:SHOWN]}"


def default_folder(command: str, case: SceneCase) -> Path:
    """Where the results of a case go unless told: into the folder of its name, or one that no other case has."""
    return RUNS / (case.name or folder_name(case.slug, key_of(command, identity_of(case))))
