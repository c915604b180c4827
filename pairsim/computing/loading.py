"""Make a case from what a Python caller passes: a file, a dict or another case, which may contain the caller's laws."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, cast, runtime_checkable

from pairsim.cases.case import SceneCase
from pairsim.cases.conversion import forget_numbers
from pairsim.cases.keys import groups_of
from pairsim.cases.unit_registry import as_texts
from pairsim.cases.yaml_file import merge, read_yaml
from pairsim.computing.case_files import Files, parse_case
from pairsim.computing.question import Question
from pairsim.physics.material import Material
from pairsim.physics.own_laws import use_laws
from pairsim.physics.solids import Solid
from pairsim.record.folder import plain
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain

type Given = Mapping[str, object]
"""Keys of a case with values as a Python caller may pass them.

They are laws, quantities of pint, arrays, columns of pandas, paths and plain data.
"""
AnyCase = str | PathLike[str] | Mapping[str, object] | SceneCase
"""Input for a case: the path of a case file, a dict of keys and values, or a case returned by `load`."""


def case_of[C: SceneCase](
    question: Question[C], given: AnyCase, overrides: Given | None = None, files: Files | None = None
) -> C:
    """The valid case of a question, with `overrides` in place of its own keys; `files` is that of `parse_case`.

    Raises:
        InputError: The file cannot be read, or a key or value is not allowed.
    """
    if isinstance(given, SceneCase) and given.kind == question.name and not overrides:
        return cast("C", given)  # valid already
    return case_from(question, content_of(given), overrides or {}, source_of(given), files)


def case_from[C: SceneCase](
    question: Question[C], data: dict[str, Plain], overrides: Given, source: str, files: Files | None = None
) -> C:
    """As `case_of`, from the content of a case and the name by which messages refer to it."""
    forget_numbers(data)
    merge(data, written(overrides, source), groups_of(question.model), source)
    return parse_case(question, data, source, files=files)


def source_of(given: AnyCase) -> str:
    """The name by which messages refer to a case."""
    return str(given) if isinstance(given, str | PathLike) else "case"


def content_of(given: AnyCase) -> dict[str, Plain]:
    """The keys and values of a file, of a dict or of a case; InputError for any other type."""
    if isinstance(given, SceneCase):
        return given.model_dump(mode="json", exclude_unset=True)
    if isinstance(given, Mapping):
        return written(given, "case")
    if isinstance(given, str | PathLike):
        return read_yaml(Path(given))
    raise InputError("case", "", type(given).__name__, "must be the path of a case file, a dict of its keys, or a case")


def written(keys: Given, source: str) -> dict[str, Plain]:
    """Keys and values as a file has them; InputError where one cannot be written to a file."""
    try:
        return dict(plain(_in_arrays(_with_blocks(keys))))
    except (TypeError, ValueError) as error:
        raise InputError(source, "", None, str(error)) from None


@runtime_checkable
class _LikeArray(Protocol):
    """What numpy can make an array from, such as a column of pandas."""

    def __array__(self) -> Any: ...


def _in_arrays(value: Any) -> Any:
    """Turn quantities of pint into texts with their units, and what is like an array into one; also nested values."""
    import numpy as np  # its threads begin while SIGTERM is blocked, see runtime/fenicsx

    value = as_texts(value)
    if isinstance(value, Mapping):
        return {key: _in_arrays(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_in_arrays(each) for each in value]
    if isinstance(value, _LikeArray) and not isinstance(value, np.ndarray | np.generic):
        return np.asarray(value)
    return value


def _with_blocks(keys: Given) -> dict[str, object]:
    """Replace laws in the keys of a case by blocks; the Ca_e of a solid becomes that of a case that has none."""
    found = dict(keys)
    for key in ("liquid", "solid"):
        value = found.get(key)
        each = value if isinstance(value, list | tuple) else [value]
        if not any(isinstance(law, Material) for law in each):
            continue
        use_laws(*(type(law) for law in each if isinstance(law, Material)))
        blocks = [_block(law) if isinstance(law, Material) else law for law in each]
        found[key] = blocks if isinstance(value, list | tuple) else blocks[0]
        Ca_es = [law.Ca_e for law in each if isinstance(law, Solid)]
        if Ca_es:
            found.setdefault("Ca_e", Ca_es if len(Ca_es) > 1 else Ca_es[0])
    return found


def _block(law: Material) -> dict[str, str | float]:
    return {"law": law.name, **{name: getattr(law, name) for name in law.parameters()}}
