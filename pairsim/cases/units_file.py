"""The case file that `pairsim units -o` writes: the quantities of an experiment, with a comment a line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.yaml_file import yaml_text

WIDE = 24  # column of the comments
KEY = re.compile(r"( *)(\w+):")
MORE = re.compile(r"[;:]| \(|, ")  # from here on words are for the reference


def case_text(written: Mapping[str, Any], case: SceneCase, head: Sequence[str]) -> str:
    """The text of a case file.

    Args:
        written: The keys that are written.
        case: The case.
        head: Lines of comment above them.
    """
    fields, block = type(case).model_fields, ""
    lines = [f"# {line}" for line in head]
    for line in yaml_text(written, blocks=True).splitlines():
        words, key = "", KEY.match(line)
        if key is not None and not key[1]:
            block = key[2]
            words = (field.description or "") if (field := fields.get(block)) is not None else ""
        elif key is not None and block == "physical":
            words = QUANTITIES[key[2]].dimension.words
        comment = MORE.split(words)[0]
        lines.append(f"{line:{WIDE}}# {comment}" if comment else line)
    return "\n".join([*lines, ""])
