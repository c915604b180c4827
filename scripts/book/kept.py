"""Results of cases that several parts of a study share: each is computed once, and found again by later commands."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

from book.code import SHOWN, code_of
from book.study import solved
from pairsim.cases.case import SceneCase
from pairsim.cases.identity import folder_name, identity_of, key_of


class Kept:
    """Results of cases, in the folder that has those of the parts, too.

    A result is found by its case and its code, so that none of other code is taken. A part that needs a case which
    another part is computing waits for it.

    Args:
        uses: Packages and modules whose code the results depend on, as in `Study.uses`.
        seconds: Wall time after which a case is stopped.
    """

    def __init__(self, uses: Sequence[str], seconds: float) -> None:
        self.uses, self.seconds = uses, seconds
        self._locks: defaultdict[str, Lock] = defaultdict(Lock)

    @cached_property
    def _code(self) -> str:
        return hashlib.sha256(code_of(self.uses).encode()).hexdigest()[:SHOWN]

    def result(self, question: str, case: SceneCase, folder: Path) -> Any:
        """The result of a case for the part whose folder is given; where it has failed its status and reason say so.

        Raises:
            Stopped: The study was stopped.
        """
        name = folder_name(f"{self._code}-{case.slug}", key_of(question, identity_of(case)))
        with self._locks[name]:
            return solved(question, case, folder.with_name(name), self.seconds)
