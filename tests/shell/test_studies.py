"""Studies: parts that are stored as they are done, statements that are judged, and pages made of what is stored."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

import pairsim

sys.path.append(str(ROOT / "scripts"))

import release
import study as runner
from book import code, overview, pages
from book.code import UNKNOWN, changed, digest_of
from book.statements import Judged
from book.study import Part, Study, names, study_of
from book.uses import off_axis, steady
from studies.atlas import judgement as of_atlases
from studies.quantities import cases, judgement
from studies.unequal_atlas import judgement as of_unequal_atlases

Run = Callable[..., int]
OF_OTHERS = {overview.MARK, overview.MARK_OF_HALF_WIDTHS}
"""Marks that no study fills."""


class Squares:
    """A study of squares, which counts how often each is computed."""

    def __init__(self, folder: Path, count: int = 3) -> None:
        self.computed, self.count, self.fails = list[str](), count, ""
        page = folder / "page.md"
        page.write_text("Text.\n<!-- sum -->\n<!-- end of sum -->\n")
        self.study = Study(folder, "squares", ("law",), self.parts, self.statements, self.blocks, page)

    def parts(self, quick: bool) -> list[Part]:
        return [Part(f"{i}^2", f"{i}", lambda _, i=i: self.rows(i)) for i in range(1, 1 + (1 if quick else self.count))]

    def rows(self, i: int) -> list[dict[str, float]]:
        if self.fails == f"{i}^2":
            raise KeyboardInterrupt
        self.computed.append(f"{i}^2")
        return [{"square": float(i * i)}]

    def statements(self, table: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
        return {"sum is at least 14": Judged(((table["square"].sum() - 13.0, 0.0),), f"{table['square'].sum():g}")}

    def blocks(self, table: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
        return {"sum": pages.prose(f"The sum is {table['square'].sum():g}.")}


@pytest.fixture
def squares(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Squares:
    (tmp_path / "squares").mkdir()
    found = Squares(tmp_path / "squares")
    monkeypatch.setattr(runner, "names", lambda: ["squares"])
    monkeypatch.setattr(runner, "study_of", lambda _: found.study)
    monkeypatch.setattr("book.study.code_of", lambda _: "law 1234")
    index = tmp_path / "index.md"
    index.write_text("<!-- index -->\n<!-- end of index -->\n")
    monkeypatch.setattr(overview, "INDEX", index)
    half_widths = tmp_path / "half-widths.md"
    half_widths.write_text("<!-- half-widths-that-hold -->\n<!-- end of half-widths-that-hold -->\n")
    monkeypatch.setattr(overview, "HALF_WIDTHS", half_widths)
    return found


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    def command(*words: str) -> int:
        monkeypatch.setattr(sys, "argv", ["study", "squares", "-o", str(tmp_path / "runs"), *words])
        return runner.main()

    return command


def test_a_study_goes_on_where_it_was_stopped(squares: Squares, run: Run) -> None:
    squares.fails = "3^2"
    assert run() == runner.STOPPED
    squares.fails = ""
    assert run() == 0
    assert sorted(squares.computed) == ["1^2", "2^2", "3^2"]


def test_parts_whose_code_has_changed_are_named_and_computed_again(
    squares: Squares, run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run()
    monkeypatch.setattr("book.study.code_of", lambda _: "law 5678")
    run("--keep")
    assert len(squares.computed) == 3
    assert "3 parts are stale, as law has changed" in capsys.readouterr().out
    run()
    assert len(squares.computed) == 6


def test_a_release_says_which_studies_are_to_be_computed(
    squares: Squares, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdicts = pd.DataFrame({"verdict": ["stale", "old"]}, index=["a.png", "b.png"])
    for name, value in {"names": runner.names, "study_of": runner.study_of, "judged": lambda: verdicts}.items():
        monkeypatch.setattr(release, name, value)
    run()
    run("--page")
    assert [fault for _, fault in release.results()] == ["", "1 are, see scripts/pictures"]
    monkeypatch.setattr("book.study.code_of", lambda _: "law 5678")
    point, fault = next(release.results())
    assert point == "the results of the study squares are those of this code"
    assert fault == "3 of 3 parts are to be computed, see scripts/study squares"


@pytest.mark.parametrize("before", [UNKNOWN, "commit 8e62446e"])
def test_results_of_code_that_was_not_recorded_are_stale(
    before: str, squares: Squares, run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = runner.Results(squares.study.stored)
    for part in squares.parts(False):
        results.add(part, before, part.compute(tmp_path))
    run()
    assert f"3 parts are stale, as they are of {before}" in capsys.readouterr().out
    assert len(squares.computed) == 6


def test_files_of_a_study_are_written_with_its_page(squares: Squares, run: Run, tmp_path: Path) -> None:
    path = tmp_path / "squares" / "squares.txt"
    squares.study = replace(squares.study, files=lambda table, _: {path: " ".join(f"{x:g}" for x in table["square"])})
    run("--quick")
    assert not path.exists()
    assert (tmp_path / "runs" / "squares-quick" / "squares.txt").read_text() == "1"
    run()
    run("--page")
    assert path.read_text() == "1 4 9"


def test_parts_are_chosen_by_their_names(squares: Squares, run: Run) -> None:
    assert run("--only", r"^3\^") == 1
    assert squares.computed == ["3^2"]


def test_a_part_that_is_another_one_now_is_computed(squares: Squares, run: Run) -> None:
    run()
    squares.study = Study(
        **vars(squares.study) | {"parts": lambda _: [Part("1^2", "other", lambda _: squares.rows(4))]}
    )
    run()
    assert squares.computed[3:] == ["4^2"]


def test_a_part_may_depend_on_less_code_than_others(
    squares: Squares, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = [*squares.parts(False)[:2], Part("3^2", "3", lambda _: squares.rows(3), ("other",))]
    squares.study = Study(**vars(squares.study) | {"parts": lambda _: parts})
    code = {("law",): "law 1234", ("other",): "other 1"}
    monkeypatch.setattr("book.study.code_of", lambda uses: code[tuple(uses)])
    run()
    code["law",] = "law 5678"
    run()
    assert sorted(squares.computed) == ["1^2", "1^2", "2^2", "2^2", "3^2"]


def test_the_exit_code_says_whether_statements_hold(
    squares: Squares, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--quick") == 1
    assert "does not hold: sum is at least 14 (1)" in capsys.readouterr().out
    assert not squares.study.stored.exists()
    assert run() == 0


def test_a_page_is_written_of_what_is_stored_and_goes_on_elsewhere(squares: Squares, run: Run, tmp_path: Path) -> None:
    run()
    run("--page")
    assert "The sum is 14." in squares.study.page.read_text()
    assert "| squares | 1 of 1 |" in overview.INDEX.read_text()
    assert run("-o", str(tmp_path / "another machine")) == 0
    assert len(squares.computed) == 3


def test_code_is_known_by_what_it_does(tmp_path: Path) -> None:
    def digest(text: str) -> str:
        (tmp_path / "law.py").write_text(text)
        digest_of.cache_clear()
        return digest_of(tmp_path / "law")

    first = digest('"""A law."""\ndef stress(rate):\n    """Stress."""\n    return 2 * rate\n')
    assert digest("def stress(rate):\n\n    return (2 * rate)  # of a Newtonian liquid\n") == first
    assert digest("def stress(rate):\n    return 3 * rate\n") != first
    assert changed("pairsim.fem ab, pairsim.physics cd", "pairsim.fem ab, pairsim.physics ef") == ["pairsim.physics"]
    assert changed("pairsim.fem ab", "pairsim.fem ab, pairsim.physics ef") == ["pairsim.physics"]
    assert not changed("pairsim.fem ab, pairsim.physics cd", "pairsim.physics cd"), "no order, and less is enough"


def test_laws_that_a_study_does_not_use_are_no_part_of_its_code(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / f"{name}.py").write_text(f"class Law:\n    label = '{name}'\n")
    (tmp_path / "forms.py").write_text("FORM = 1\n")

    def digest() -> str:
        digest_of.cache_clear()
        code._has_law.cache_clear()
        return digest_of(tmp_path, ("one",))

    first = digest()
    (tmp_path / "other.py").write_text("class Law:\n    label = 'changed'\n")
    assert digest() == first
    (tmp_path / "one.py").write_text("class Law:\n    label = 'changed'\n")
    assert digest() != first
    with pytest.raises(FileNotFoundError, match="has no laws third"):
        digest_of(tmp_path, ("third",))


def test_packages_that_a_study_does_not_use_are_no_part_of_its_code(tmp_path: Path) -> None:
    (tmp_path / "off_axis").mkdir()
    (tmp_path / "forms.py").write_text("FORM = 1\n")
    (tmp_path / "off_axis" / "forms.py").write_text("FORM = 2\n")

    def digest() -> str:
        digest_of.cache_clear()
        return digest_of(tmp_path, None, ("off_axis",))

    first = digest()
    (tmp_path / "off_axis" / "forms.py").write_text("FORM = 3\n")
    assert digest() == first
    (tmp_path / "forms.py").write_text("FORM = 3\n")
    assert digest() != first
    with pytest.raises(FileNotFoundError, match="has no folder third"):
        digest_of(tmp_path, None, ("third",))


def test_a_change_off_the_axis_leaves_curves_as_they_are() -> None:
    focus = set(off_axis("newtonian")) - set(steady("newtonian"))
    assert "pairsim.fem.azimuthal" in focus
    assert "pairsim.fem" not in steady("newtonian")


@pytest.fixture(scope="module", autouse=True)
def judged_once() -> Iterator[None]:
    """Points of the atlases, whose judgement takes seconds, are judged once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((of_atlases, "samples"), (of_unequal_atlases, "judged")):
            patch.setattr(module, name, once(getattr(module, name)))
        yield


def once(judge: Callable[[pd.DataFrame], Any]) -> Callable[[pd.DataFrame], Any]:
    """A judgement that knows what it has found of the same rows."""
    known: dict[bytes, Any] = {}

    def found(results: pd.DataFrame) -> Any:
        rows = pd.util.hash_pandas_object(results).to_numpy().tobytes()
        if rows not in known:
            known[rows] = judge(results)
        return known[rows]

    return found


@cache
def made(name: str) -> tuple[pd.DataFrame, Mapping[str, str]]:
    """The stored results of a study, and what stands between its marks."""
    study = study_of(name)
    parts = study.parts(False)
    table = runner.Results(study.stored).of(parts)
    return table, study.blocks(table, parts)


SLOW = {"atlas"}  # whose judgement takes seconds


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=pytest.mark.slow if each in SLOW else ()) for each in names()]
)
def test_page_of_a_study_is_that_of_its_stored_results(name: str) -> None:
    study, (table, blocks) = study_of(name), made(name)
    text, parts = study.page.read_text(), study.parts(False)
    assert set(blocks) <= pages.marks(text)
    assert pages.filled(text, blocks) == text, f"written by scripts/study {name} --page"
    for path, content in study.files(table, parts).items():
        assert path.exists()
        assert isinstance(content, bytes) or path.read_text() == content, f"written by scripts/study {name} --page"


@pytest.mark.slow
def test_tables_of_all_studies_are_those_of_their_stored_results() -> None:
    studies = [study_of(name) for name in names()]
    for page, mark, table in (
        (overview.INDEX, overview.MARK, overview.overview(studies)),
        (overview.HALF_WIDTHS, overview.MARK_OF_HALF_WIDTHS, overview.half_widths(studies)),
    ):
        text = page.read_text()
        assert pages.filled(text, {mark: pages.markdown(table)}) == text, "written by scripts/study all --page"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sample", "count", "half_width"),
    [
        ("Giesekus: dU of curves at twelve distances", 480, 2.0),
        ("Newtonian: random places", 200, 1.2),
        ("Giesekus: random places", 200, 1.2),
        ("Giesekus: random places with beta above 0.42, De below 0.1, Ca_e above 0.06", 50, 1.2),
    ],
)
def test_intervals_of_the_atlases_that_ship_hold_points_they_were_not_made_of(
    sample: str, count: int, half_width: float
) -> None:
    """Also in the corner of large, soft beads in liquids with hardly a memory, where one was off by eight of them."""
    points = of_atlases.samples(made("atlas")[0])[sample]
    assert len(points) == count
    assert (points["error"].abs() <= points["half_width"]).mean() >= 0.95
    assert points["half_width"].median() < half_width


@pytest.mark.slow
def test_the_atlas_that_ships_is_right_in_the_signs_of_curves_of_which_it_is_certain() -> None:
    points = of_atlases.samples(made("atlas")[0])["Giesekus: dU of curves at twelve distances"]
    certain = points[points["certain"]]
    assert len(certain) > 400
    assert certain["right"].all()


def test_how_many_half_widths_hold_is_told_of_the_studies_that_state_it(squares: Squares) -> None:
    other, held = squares.study, {"at least 95 % of dU are inside their half-widths": Judged(((0.05, 0.0),), "9 of 9")}
    squares.study.stored.write_text("part,identity,code,computed,square\n1^2,6b86b273ff,law 1234,2026-11-30,1\n")
    this = replace(other, statements=lambda *_: held)
    table = overview.half_widths([other, this], squares.study.folder / "all.md")
    assert table.to_numpy().tolist() == [["[`squares`](page.md)", *held, "holds", "9 of 9"]]


@pytest.mark.slow
def test_every_mark_of_a_page_belongs_to_one_study() -> None:
    marks: dict[Path, list[str]] = {}
    for name in names():
        marks.setdefault(study_of(name).page, []).extend(made(name)[1])
    for page, found in marks.items():
        assert sorted(found) == sorted(pages.marks(page.read_text()) - OF_OTHERS)


@pytest.mark.parametrize("name", names())
def test_parts_of_a_study_have_names_of_their_own(name: str) -> None:
    for quick in (False, True):
        found = [part.name for part in study_of(name).parts(quick)]
        assert len(found) == len(set(found)) > 0


def test_scenes_of_the_quantities_are_valid_cases() -> None:
    for asked in cases.QUESTIONS:
        for scene in asked.scenes(2).values():
            assert pairsim.load(scene, kind=asked.question).n == 1


@pytest.mark.slow
def test_a_case_has_a_row_for_each_printed_quantity(tmp_path: Path) -> None:
    part = next(each for each in cases.parts(True) if each.name == "dragged-00-newtonian+5%")
    rows = {str(row["quantity"]): row for row in part.compute(tmp_path / "case")}
    assert rows.keys() == {"U", "F", "dp_plus"}
    assert all(row["kind"] == "case" and row["accuracy"] == "5%" and not row["said"] for row in rows.values())
    assert 0 < float(rows["F"]["half_width"]) < 0.05 * float(rows["F"]["value"])


def results(**quantities: tuple[tuple[float, float], ...]) -> pd.DataFrame:
    """A row for each quantity at each accuracy: its value and half-width."""
    same = {"question": "shape", "liquid": "newtonian", "scene": 0, "unknowns": 1000, "said": False, "ended": None}
    accuracies = zip(("1%", "0.1%", "0.02%"), ("case", "case", "reference"), strict=True)
    rows = [
        {
            **same,
            "part": accuracy,
            "accuracy": accuracy,
            "kind": kind,
            "quantity": name,
            "value": x,
            "half_width": error,
        }
        for i, (accuracy, kind) in enumerate(accuracies)
        for name, solutions in quantities.items()
        for x, error in solutions[i : i + 1]
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("solutions", "verdicts"),
    [
        (((1.005, 0.01), (1.0002, 0.001), (1.0, 1e-4)), ["inside", "inside"]),
        (((1.015, 0.01), (1.003, 0.001), (1.0, 1e-4)), ["outside", "beyond two"]),
        (((1.005, 0.01), (1.0002, 0.001), (1.0, 5e-4)), ["inside", "not judged"]),
        (((1.005, 0.01), (1.0002, 0.001)), ["inside", "not judged"]),
        (((1.005, 0.01),), ["not judged"]),
        (((1.005, 0.002), (1.0, 0.001)), ["beyond two", "not judged"]),  # whatever the exact value, it is outside
    ],
)
def test_a_quantity_is_judged_by_a_reference_that_knows_it_better(
    solutions: tuple[tuple[float, float], ...], verdicts: list[str]
) -> None:
    assert judgement.judged(results(D=solutions))["verdict"].tolist() == verdicts


def test_an_accuracy_that_is_neither_kept_nor_said_to_be_missed_is_found() -> None:
    table = results(D=((1.03, 0.04), (1.0, 1e-4)))
    stated = "the accuracy of each is kept, or a warning says that it is not"
    assert judgement.statements(table, [])[stated].verdict == "does not hold"
    assert judgement.statements(table.assign(said=True), [])[stated].verdict == "holds"


def test_a_case_without_an_answer_counts_and_is_named() -> None:
    ended = results(D=((1.0, 0.01),)).assign(ended="no_steady_state", quantity=np.nan)
    verdict = judgement.statements(pd.concat([ended, results(D=((1.0, 0.01),)).assign(scene=1)]), [])
    assert verdict["every case has an answer"].verdict == "does not hold"
    assert "1% (no_steady_state)" in verdict["every case has an answer"].numbers


def test_the_page_names_what_is_outside() -> None:
    table = results(D=((1.015, 0.01), (1.0, 1e-4))).assign(computed="2026-11-29", code="")
    blocks = judgement.blocks(table, cases.parts(True))
    assert "| 1% | D | 1.015 | 0.01 | 0.015 | 1.50 | 0.01 |" in blocks["outside"]
    assert "| shape | D | 1% | 1 | 1 | 0 | 1 | 0 | 1.50 |" in blocks["quantities"]


def test_a_study_whose_output_is_no_longer_read_ends_without_a_complaint(tmp_path: Path) -> None:
    words = [str(ROOT / "scripts" / "study.py"), "rigid", "--only", "none", "-o", str(tmp_path)]
    with subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as study:
        assert study.stdout is not None
        study.stdout.close()
        assert study.stderr is not None
        assert study.stderr.read() == b""
    assert study.returncode == runner.STOPPED


USUAL = ("codes", "hard", "soft")
"""Studies whose quick form takes seconds: the usual tier runs it, too."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in USUAL else pytest.mark.long) for name in names()]
)
def test_the_quick_form_of_a_study(name: str, tmp_path: Path) -> None:
    script = [sys.executable, str(ROOT / "scripts" / "study.py"), name, "--quick", "-o", str(tmp_path)]
    done = subprocess.run([*script, "--workers", "2"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    table = pd.read_csv(tmp_path / f"{name}-quick" / "results.csv")
    assert set(table["part"]) == {part.name for part in study_of(name).parts(True)}
