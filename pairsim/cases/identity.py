"""Hashes that identify a case, and the folder names derived from them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import keys_of
from pairsim.cases.physical import BLOCK, DENSITY, QUANTITIES, with_deviations
from pairsim.cases.quantity_text import measured
from pairsim.cases.yaml_file import Content
from pairsim.physics.own_laws import digest_of, file_of
from pairsim.runtime.plain import Plain

RUNS = Path("runs")
LONGEST_SLUG = 100
SHOWN = 10  # digits of the hash in a folder name


def identity_of(case: SceneCase) -> dict[str, Plain]:
    """The keys and values that identify a case: everything that affects its results, so all but the name.

    A list of equal values counts as one value, and parameters without effect are left out. The output times are
    included, since time steps land on them and they decide which fields are in the folder. Keys of later versions are
    left out where they have their default, so that older cases keep their folders.
    """
    identity = case.resolved()
    for name, key in keys_of(type(case)).items():
        group, last = _holder(identity, name)
        value = group.get(last)
        if key.count is not None and isinstance(value, list) and value and all(each == value[0] for each in value):
            group[last] = value = value[0]
        if not key.in_identity(case) or (key.since and key.is_default(value)):
            group.pop(last, None)
    return identity | sources_of(case)


def with_later_keys(case: Content, model: type[SceneCase]) -> dict[str, Plain]:
    """A resolved case of an older version, as plain data, with keys of later versions at their defaults."""
    later = {name: key.default for name, key in keys_of(model).items() if key.since}
    found: dict[str, Plain] = {name: {**value} if isinstance(value, Mapping) else value for name, value in case.items()}
    for name, default in later.items():
        group, last = _holder(found, name)
        group.setdefault(last, default)
    return found


def _holder(identity: dict[str, Plain], name: str) -> tuple[dict[str, Plain], str]:
    """The group that a dotted key is in, and its name there."""
    group, _, last = name.rpartition(".")
    inner = identity.get(group) if group else identity
    return inner if isinstance(inner, dict) else {}, last


def alike(case: SceneCase) -> str:
    """A text that is the same for cases that compute the same, however their quantities are written.

    5 kPa, 5000 Pa and a Young's modulus of 15 kPa count as one, as do numbers with the same twelve digits. Hashes are
    not made from it: the folder of a computed case is found by how the case was written.
    """
    identity: dict[str, Plain] = {"kind": case.kind, **identity_of(case)}
    block = identity.pop(BLOCK, None)
    if (scales := case.scales) is not None and isinstance(block, Mapping):
        block = with_deviations(block)
        given = {key: QUANTITIES[key] for key, value in block.items() if isinstance(value, str)}
        pairs = {key: (each, *measured(block[key], each)) for key, each in given.items() if each.uncertain}
        density = measured(block[DENSITY.key], DENSITY)[0] if DENSITY.key in given else None
        identity["scales"] = [scales.length, scales.velocity, scales.viscosity, density]
        parts = {key: half / (1.0 if each.kind.signed else value) for key, (each, value, half) in pairs.items() if half}
        identity["half-widths"] = parts
    return json.dumps(_twelve_digits(identity), sort_keys=True)


def _twelve_digits(value: Any) -> Any:
    """Nested values with all numbers rounded to twelve digits, which removes the rounding errors of conversions."""
    if isinstance(value, Mapping):
        return {key: _twelve_digits(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_twelve_digits(each) for each in value]
    return float(f"{value:.12g}") if isinstance(value, float) else value


def sources_of(case: SceneCase) -> dict[str, dict[str, str]]:
    """The entry `laws` with the hash of the source of each user-defined law of a case; empty if it has none."""
    liquid = case.liquid_model
    laws = {type(law) for law in filter(None, (liquid.solvent, liquid.yielding, *liquid.modes, *case.solid_models))}
    found = {law.name: digest_of(file) for law in laws if (file := file_of(law)) is not None}
    return {"laws": dict(sorted(found.items()))} if found else {}


def key_of(command: str, identity: Content) -> str:
    """SHA-256 hash (hexadecimal) of a command and the identity of its case."""
    text = json.dumps({"command": command, **identity}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def folder_name(slug: str, key: str) -> str:
    """Folder name that is unique to a case: its slug and the beginning of its hash."""
    return f"{slug[:LONGEST_SLUG]}-{key[:SHOWN]}"


def default_folder(command: str, case: SceneCase, file: str = "") -> Path:
    """Default folder for the results: `runs/<name>`, or `runs/<file>-<hash>` for a case without a name.

    `file` is the name of the case file without its ending; if it is empty, the parameters of the case take its place.
    """
    return RUNS / (case.name or folder_name(file or case.slug, key_of(command, identity_of(case))))
