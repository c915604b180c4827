"""Hook of mkdocs that converts equations to MathML, which browsers display without scripts and without a connection.

`pymdownx.arithmatex` marks `$...$` and `$$...$$`. They are converted when the site is built, so that an invalid
equation is a warning, and an error with `--strict`.
"""

from __future__ import annotations

import html
import logging
import re
from typing import Any

from latex2mathml.converter import convert

LOG = logging.getLogger("mkdocs.hooks.math")
MARKED = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Replace the marked equations in the HTML of a page by MathML; called by mkdocs."""

    def mathml(match: re.Match[str]) -> str:
        source = html.unescape(match[3]).strip()
        try:
            return str(convert(source, display="block" if match[2] == "[" else "inline"))
        except Exception as error:
            LOG.warning("%s: equation %r: %r", page.file.src_uri, source, error)
            return match[0]

    return MARKED.sub(mathml, content)
