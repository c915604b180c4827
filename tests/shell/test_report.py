"""report.html: what it says of every kind of folder, and that it is one file."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.field_samples import PAIR, scene
from support.result_folders import make_curve, make_run, make_sweep

from pairsim.app.html_report import report
from pairsim.app.sweep_results import SweepResult
from pairsim.record.folder import prepare_folder
from pairsim.record.tables import headings
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
    parameters = {}
    for i, Ca_e in enumerate((0.02, 0.05, 0.1)):
        failed = {"status": "failed", "reason": "newton", "message": "no <steady> state"}
        a_curve(folder / f"c{i}", warnings=["coarse"], **({} if i else failed))
        parameters[f"c{i}"] = {"Ca_e": Ca_e, "De": 0.5}
    for name in ("curve.csv", "equilibria.csv"):
        (folder / "c0" / name).unlink()
    columns = ["points", "zeros", "stable", "dU_peak"]
    return make_sweep(folder, "curve", parameters, ["Ca_e"], columns=columns, command_line="pairsim sweep grid.yaml")


def text_of(page: str) -> str:
    """What is read, without pictures and tags."""
    return " ".join(unescape(re.sub(r"<style.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL)).split())


def rows_of(page: str) -> list[list[str]]:
    """The cells of the table."""
    rows = re.findall(r"<tr>(.*?)</tr>", page.partition("<tbody>")[2], flags=re.DOTALL)
    return [[unescape(cell) for cell in re.findall(r"<td>(.*?)</td>", row)] for row in rows]


def test_report_of_a_curve_is_one_file_with_everything(tmp_path: Path) -> None:
    folder = a_curve(tmp_path / "a <b>")
    path = report(folder)
    assert path == folder / "report.html"
    page = path.read_text(encoding="utf-8")
    words = text_of(page)
    answer = "The pair comes closer between d = 0.05 and 0.2"
    for part in (answer, "a <b>", "a < b & c", "pairsim 1.2.3", "1 min 15 s", "pairsim curve case.yaml", "beta: 0.4"):
        assert part in words, part
    assert "<b>" not in page
    assert "<script" not in page
    loaded = re.findall(r'(?:src|srcset|href)="([^"]*)"|url\(([^)]*)\)|@import', page)
    assert loaded
    assert all(link.startswith("data:image/") for link, _ in loaded)
    assert [row[0] for row in rows_of(page)] == ["0.05", "0.1", "0.2", "0.4", "0.6"]
    prepare_folder(folder, overwrite=True)
    assert not path.exists()


def test_report_of_an_experiment_is_in_its_units(tmp_path: Path) -> None:
    scales = {"length": 50e-6, "velocity": 10e-3, "time": 5e-3, "stress": 170.0}
    folder = a_curve(tmp_path / "beads", scales=scales)
    page = report(folder).read_text(encoding="utf-8")
    words = text_of(page)
    assert "between d = 2.5 um and" in words
    assert " ± " in words
    assert "d [um] dU [um/s]" in words
    assert [row[0] for row in rows_of(page)] == ["2.5", "5", "10", "20", "30"]


def test_table_of_a_sweep_is_in_the_units_of_each_case(tmp_path: Path) -> None:
    parameters = {}
    for name, velocity in (("slow", 1e-3), ("fast", 10e-3)):
        scales = {"length": 50e-6, "velocity": velocity, "time": 50e-6 / velocity, "stress": 1.0}
        a_curve(tmp_path / "sweep" / name, scales=scales)
        parameters[name] = {"physical.velocity": f"{1e3 * velocity:g} mm/s"}
    columns = ["zeros", "dU_peak"]
    sweep = SweepResult(make_sweep(tmp_path / "sweep", "curve", parameters, ["physical.velocity"], columns=columns))
    table = sweep.frame("results", physical=None)
    assert headings(table)[3:6] == ["physical.velocity [mm/s]", "zeros [um]", "dU_peak [um/s]"]
    assert table["zeros"].to_list() == [pytest.approx([10.0])] * 2
    assert (table["dU_peak"] / sweep.table["dU_peak"]).to_list() == pytest.approx([1e3, 1e4])
    assert table["physical.velocity"].to_list() == [1.0, 10.0]
    assert headings(sweep.frame("results"))[4:6] == ["zeros [D_c]", "dU_peak [U_av]"]


@pytest.mark.slow
def test_report_of_a_run_shows_fields_and_leaves_rows_of_long_tables_out(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", 2, [scene(0.5, PAIR)], rows=5000)
    page = report(folder).read_text(encoding="utf-8")
    assert re.findall(r"<figcaption>(\w+)", page) == ["Velocities", "What"]
    assert "series.csv, one row in 10" in text_of(page)
    times = [float(row[0]) for row in rows_of(page)]
    assert (len(times), times[-1]) == (500, 1.0)


@pytest.mark.slow
def test_report_of_a_sweep_counts_and_names_failures_and_warnings(tmp_path: Path) -> None:
    page = report(a_sweep(tmp_path / "sweep")).read_text(encoding="utf-8")
    words = text_of(page)
    assert "2 finished, 1 failed" in words
    assert "c0: no <steady> state" in words
    assert "c2: coarse" in words
    assert len(rows_of(page)) == 3
    assert not {"None", "<NA>", "nan"} & {cell for row in rows_of(page) for cell in row}
    ended = {"status": "finished", "reason": "no_steady_state", "message": "the branch ends"}
    (tmp_path / "sweep" / "c2" / "run.json").write_text(json.dumps(ended | {"kind": "curve", "key": "c2"}))
    assert "c2: the branch ends" in text_of(report(tmp_path / "sweep").read_text(encoding="utf-8"))


def test_command_says_where_the_file_is_and_what_a_wrong_folder_is(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.json").write_text('{"kind": "run", "status": "running"}')
    for _ in range(2):  # it is replaced where it exists
        done = pairsim("report", "out")
        assert (done.returncode, done.stdout.strip()) == (0, "out/report.html"), done.stderr
        words = text_of((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
        assert "has no rows yet" in words
        assert "run, interrupted;" in words  # run.json says "running", but nobody is at work
        assert "Interrupted: the command was killed" in words
    done = pairsim("report", "nowhere")
    assert (done.returncode, done.stderr.strip()) == (2, "pairsim: nowhere: no such folder")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="is empty"):
        report(tmp_path / "empty")
