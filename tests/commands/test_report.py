"""report.html: what it says of every kind of folder, that it is one file, and what a browser makes of it."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest
from support.browser import chromium, rendered, screenshot
from support.commands import Pairsim
from support.field_samples import PAIR, scene
from support.pictures import colours
from support.result_folders import make_curve, make_run

from pairsim.api.report import report
from pairsim.results.output import RunFolder
from pairsim.runtime.errors import InputError

RECORD = {
    "kind": "curve",
    "status": "finished",
    "reason": "end",
    "message": "5 points",
    "command": "pairsim curve case.yaml",
    "wall_time": 75.0,
    "machine": {"node": "here", "system": "Linux"},
    "versions": {"pairsim": "1.2.3", "python": "3.13"},
    "warnings": ["the mesh is coarse: a < b & c"],
}


def a_curve(folder: Path, **changes: object) -> Path:
    make_curve(folder, 0.1)
    (folder / "run.json").write_text(json.dumps(RECORD | changes))
    return folder


def a_sweep(folder: Path) -> Path:
    """Three curves, of which one has failed."""
    cases = []
    for i, Ca_e in enumerate((0.02, 0.05, 0.1)):
        a_curve(folder / f"c{i}", warnings=["coarse"])
        zeros = {"zeros": [0.2], "stable": [False], "dU_peak": 0.1 * Ca_e, "points": 5}
        ended = {"status": "finished", "reason": "end", "message": "5 points"}
        ended = ended if i else {"status": "failed", "reason": "newton", "message": "no <steady> state"}
        parameters = {"Ca_e": Ca_e, "De": 0.5}
        cases.append({"folder": f"c{i}", "parameters": parameters, "values": zeros if i else {}, "attempts": 1} | ended)
    columns = {"columns": ["points", "zeros", "stable", "dU_peak"], "parameters": ["Ca_e", "De"]}
    sweep = {"name": "grid", "command": "curve", "varying": ["Ca_e"], "updated": 0, "cases": cases, **columns}
    (folder / "sweep.json").write_text(json.dumps(sweep | {"command_line": "pairsim sweep grid.yaml"}))
    return folder


def text_of(page: str) -> str:
    """What is read, without pictures and tags."""
    return unescape(re.sub(r"<(style|script).*?</\1>|<[^>]*>", " ", page, flags=re.DOTALL))


def table_of(page: str) -> list[dict[str, str]]:
    """The rows of the table that are seen, in their order."""
    (table,) = re.findall(r'<table id="results">.*?</table>', page, flags=re.DOTALL)
    names = re.findall(r'data-name="([^"]*)"', table)
    rows = re.findall(r"<tr([^>]*)>(.*?)</tr>", table.partition("<tbody>")[2], flags=re.DOTALL)
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", row) for attributes, row in rows if "hidden" not in attributes]
    return [dict(zip(names, (unescape(re.sub("<[^>]*>", "", cell)) for cell in row), strict=True)) for row in cells]


def test_report_of_a_curve_is_one_file_with_everything(tmp_path: Path) -> None:
    folder = a_curve(tmp_path / "a <b>")
    path = report(folder)
    assert path == folder / "report.html"
    page = path.read_text(encoding="utf-8")
    assert "The pair comes closer between d = 0.05 and 0.2" in page
    words = text_of(page)
    for part in ("a <b>", "a < b & c", "pairsim 1.2.3", "1 min 15 s", "pairsim curve case.yaml", "beta: 0.4"):
        assert part in words, part
    assert "<b>" not in page
    loaded = re.findall(r'(?:src|srcset)="([^"]*)"|url\(([^)]*)\)|@import', page)
    assert loaded
    assert all(link.startswith("data:image/") for link, _ in loaded)
    assert set(re.findall(r'href="([^"]*)"', page)) == {"curve.csv", "case.yaml"}, "files beside it"
    assert "default-src 'none'" in page
    assert len(table_of(page)) == 5
    RunFolder.create(folder, overwrite=True)
    assert not path.exists()


def test_report_of_an_experiment_is_in_its_units(tmp_path: Path) -> None:
    scales = {"length": 50e-6, "velocity": 10e-3, "time": 5e-3, "stress": 170.0}
    folder = a_curve(tmp_path / "beads", scales=scales)
    case = folder / "case.yaml"
    case.write_text(case.read_text() + "physical: {tube: 50um, flow_rate: 1 ul/min}\n")
    words = " ".join(text_of(report(folder).read_text(encoding="utf-8")).split())
    top = words.partition("Pictures")[0]
    for part in ("tube 50µm", "flow rate 1 µl/min", "beta 0.4", "In physical units: ", " ± "):
        assert part in top, part
    assert "+-" not in top
    assert [row["d"] for row in table_of((folder / "report.html").read_text())] == ["2.5", "5", "10", "20", "30"]
    assert "d µm dU µm/s" in words


@pytest.mark.slow
def test_report_of_a_run_shows_fields_and_leaves_rows_of_long_tables_out(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", 2, [scene(0.5, PAIR)], rows=5000)
    page = report(folder).read_text(encoding="utf-8")
    assert re.findall(r"<figcaption>(\w+)", page) == ["Velocities", "What", "Streamlines"]
    times = [float(row["t"]) for row in table_of(page)]
    assert 1000 < len(times) <= 2001
    assert (times[0], times[-1]) == (0.1, 1.0)
    assert f"{5000 - len(times)} rows are left out" in " ".join(text_of(page).split())


@pytest.mark.slow
def test_report_of_a_sweep_counts_groups_warnings_and_names_failures(tmp_path: Path) -> None:
    page = report(a_sweep(tmp_path / "sweep")).read_text(encoding="utf-8")
    words = " ".join(text_of(page).split())
    assert "3 cases of pairsim curve: 2 finished, 1 failed." in words
    assert "a zero of dU in 2" in words
    assert "coarse 3 cases c0 c1 c2" in words
    assert "newton no <steady> state" in words
    assert [row["zeros"] for row in table_of(page)] == ["", "0.2", "0.2"]


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        ({"kind": "run", "status": "running"}, ["interrupted", "has no rows yet"]),
        (
            {"kind": "run", "status": "failed", "reason": "newton", "message": "it <diverged>"},
            ["it <diverged>", "newton"],
        ),
        ({"kind": "critical", "status": "failed", "reason": "fold", "message": "none"}, ["fold", "has no rows yet"]),
    ],
)
def test_folders_that_are_not_finished_have_a_report(
    tmp_path: Path, record: dict[str, str], expected: list[str]
) -> None:
    (tmp_path / "run.json").write_text(json.dumps(record))
    words = text_of(report(tmp_path).read_text(encoding="utf-8"))
    assert "No picture" in words
    for part in expected:
        assert part in words, part


def test_command_says_where_the_file_is_and_what_a_wrong_folder_is(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.json").write_text('{"kind": "run", "status": "running"}')
    for _ in range(2):  # it is replaced where it exists
        done = pairsim("report", "out")
        assert (done.returncode, done.stdout.strip()) == (0, "out/report.html"), done.stderr
    done = pairsim("report", "nowhere")
    assert (done.returncode, done.stderr.strip()) == (2, "pairsim: nowhere: no such folder")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="is empty"):
        report(tmp_path / "empty")


@pytest.mark.slow
def test_a_browser_sorts_and_filters(tmp_path: Path) -> None:
    chromium()
    path = report(a_curve(tmp_path / "curve"))
    assert [row["d"] for row in table_of(rendered(path))] == ["0.05", "0.1", "0.2", "0.4", "0.6"]
    page = rendered(path, "sort=-dU&filter=d%3E0.1+dU%3C%3D0.07")
    assert [row["d"] for row in table_of(page)] == ["0.4", "0.2"]
    assert "2 of 5 rows" in text_of(page)
    assert re.findall(r'data-name="(\w+)" aria-sort="descending"', page) == ["dU"]
    page = rendered(report(a_sweep(tmp_path / "sweep")), "sort=dU_peak&filter=status%3Dfinished")
    assert [row["folder"] for row in table_of(page)] == ["c1", "c2"]
    page = rendered(tmp_path / "sweep" / "report.html", "sort=dU_peak")
    assert [row["folder"] for row in table_of(page)] == ["c1", "c2", "c0"], "empty cells come last"
    page = rendered(tmp_path / "sweep" / "report.html", "filter=NEWTON")
    assert [row["folder"] for row in table_of(page)] == ["c0"], "words, in capitals or not"


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_draws_it(tmp_path: Path, width: int) -> None:
    chromium()
    path = report(make_run(tmp_path / "run", 2, [scene(0.1, PAIR)]))
    screenshot(path, tmp_path / "shot.png", width, 2600)
    assert colours(tmp_path / "shot.png") > 500, "pictures are shown"
