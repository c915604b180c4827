"""Load cases from files, dicts and other cases: `load`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, overload

from pairsim.cases.case import SceneCase
from pairsim.computing.case_files import Files, first_accepted, fitting
from pairsim.computing.loading import AnyCase, case_from, case_of, content_of, source_of
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.sweeps.files import FILES

if TYPE_CHECKING:
    from pairsim.cases.run_case import Case

CASE_FILES = Files(QUESTIONS)


@overload
def load(path_or_dict: AnyCase, *, kind: Literal["run"], **overrides: Any) -> Case: ...
@overload
def load(path_or_dict: AnyCase, *, kind: str | None = None, **overrides: Any) -> Any: ...


def load(path_or_dict: AnyCase, *, kind: str | None = None, **overrides: Any) -> SceneCase:
    """Load and validate a case.

    Args:
        path_or_dict: Path of a case file (YAML), a dict of its keys, or a case.
        kind: The computation that the case is for, such as "run" (in time) or "curve" (quasi-steady, over the
            distance); by default the first one that has all keys of the case and allows their values.
        overrides: Keys to replace, such as `Ca_e=0.05`. Groups are merged: `mesh={"Np": 20}` only changes this key of
            `mesh`. Dotted keys are written as `**{"mesh.Np": 20}`. `liquid` and `solid` may be laws of one's own, such
            as `liquid=FeneCR(L2=20)`.

    Returns:
        The validated case with all defaults, immutable.

    Raises:
        InputError: The file cannot be read, or a key or value is not allowed; the message says what is.

    Example:
        >>> pairsim.load({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}, mesh={"Np": 20}).mesh.Np
        20
    """
    if kind is not None and kind not in QUESTIONS:
        raise InputError("pairsim.load", "kind", kind, f"must be {' or '.join(QUESTIONS)}")
    if kind is None and isinstance(path_or_dict, SceneCase):
        kind = path_or_dict.kind
    if kind is not None:
        return case_of(QUESTIONS[kind], path_or_dict, overrides, FILES)
    keys = dict.fromkeys((*content_of(path_or_dict), *(key.partition(".")[0] for key in overrides)))

    def read(name: str) -> SceneCase:
        return case_from(QUESTIONS[name], content_of(path_or_dict), overrides, source_of(path_or_dict), FILES)

    return first_accepted(fitting(keys, CASE_FILES), read)[1]
