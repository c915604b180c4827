"""All subjects of the book, and their computation."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
from pairsim.results.output import write_text
from validation_book import (
    balances,
    extension,
    giesekus_pairs,
    manufactured,
    pyoomph,
    rigid,
    soft,
    sphere_in_tube,
    tube,
)
from validation_book.comparisons import BOOK, Found, Setting, Subject
from validation_book.contents import TITLES

MODULES = (sphere_in_tube, rigid, soft, extension, tube, manufactured, pyoomph, balances, giesekus_pairs)
SUBJECTS: dict[str, Subject] = {module.SUBJECT.name: module.SUBJECT for module in MODULES}
assert list(SUBJECTS) == list(TITLES), "the pages are those of contents.TITLES"


def computed(subject: Subject, output: Path, *, quick: bool) -> Found:
    """Compute a subject and write its results: of a quick computation to the output folder, else to the book.

    Args:
        subject: The subject.
        output: Folder for the files of cases.
        quick: Coarse cells and few points.
    """
    folder = output / subject.name
    results, pictures = (output, folder) if quick else (BOOK / "results", BOOK / "images")
    for each in (folder, results, pictures):
        each.mkdir(parents=True, exist_ok=True)
    found = subject.compute(Setting(quick, folder, pictures))
    rounded = [dataclasses.replace(row, value=float(f"{row.value:.12g}")) for row in found.comparisons]
    found = dataclasses.replace(found, comparisons=rounded)
    write_text(results / f"{subject.name}.json", found.text())
    return found
