"""Words as HTML: with signs where a terminal has letters."""

from __future__ import annotations

import re
from html import escape

SIGNS = (
    (r"\+-", "&plusmn;"),
    (r"(?<![A-Za-z])u([lm])\b", r"&micro;\1"),
    (r"\)e-(\d+)", r") &times; 10<sup>&minus;\1</sup>"),
    (r"\)e(\d+)", r") &times; 10<sup>\1</sup>"),
)
"""What stands for what."""


def html_of(text: str) -> str:
    """A text as HTML."""
    text = escape(text)
    for pattern, sign in SIGNS:
        text = re.sub(pattern, sign, text)
    return text
