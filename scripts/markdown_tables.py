"""Tables in Markdown, and their places in pages."""

from __future__ import annotations

import re


def table(head: list[str], rows: list[list[str]]) -> str:
    """Format a table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]) + "\n"


def put(page: str, name: str, content: str | None) -> str:
    """Replace the text between the marks of a table in the page; without content the page is unchanged."""
    if not content:
        return page
    marks = f"<!-- {name} -->", f"<!-- end of {name} -->"
    return re.sub(f"{marks[0]}.*?{marks[1]}", lambda _: f"{marks[0]}\n{content}{marks[1]}", page, flags=re.DOTALL)
