"""`pairsim sweep` as a command: tables, restarts after any kind of end, isolated failures, shards, pictures."""

from __future__ import annotations

import csv
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from support.commands import Pairsim, words_of
from support.inputs import ROOT, TINY
from support.pictures import colours
from typer.testing import CliRunner

from pairsim import sweep as swept_into
from pairsim.cli.app import app
from pairsim.runtime.child_process import descendants, module_command
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid
from pairsim.sweeps.sweep_plots import plot_sweep

THREE = TINY + "grid: {d0: [0.1, 0.2], beta: [0.4, 0.3]}\nexclude: [{d0: 0.1, beta: 0.3}]\n"
ENDLESS = "time: {end: 500, max_step: 0.001}"


def command(*arguments: str, ranks: int = 0) -> list[str]:
    mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", str(ranks)] if ranks else []
    return [*mpirun, *module_command("pairsim", "sweep", "grid.yaml", "-o", "out", "-q", *arguments)]


def table(folder: Path, name: str = "results.csv") -> list[dict[str, str]]:
    """Rows of results.csv without the wall time, the only value that is not reproducible."""
    with (folder / name).open() as file:
        return [{key: value for key, value in row.items() if key != "wall_time"} for row in csv.DictReader(file)]


def ledger(folder: Path) -> dict[str, dict[str, Any]]:
    return {case["folder"]: case for case in json.loads((folder / "sweep.json").read_text())["cases"]}


def run_records(folder: Path) -> dict[str, str]:
    return {path.parent.name: path.read_text() for path in folder.glob("*/run.json")}


def counts(folder: Path) -> dict[str, int]:
    content = json.loads((folder / "sweep.json").read_text())["counts"]
    return {status: count for status, count in content.items() if count}


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three cases on two ranks."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "grid.yaml").write_text(THREE)
    done = subprocess.run(command(ranks=2), cwd=folder, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "out"
    return folder


@pytest.mark.slow
def test_table_has_a_row_a_case_and_the_promised_columns(swept: Path) -> None:
    rows = table(swept / "out")
    assert ",".join(rows[0]) == (
        "folder,status,reason,d0,beta,De,Ca_e,t,d,dU,U_L,U_T,D_L,D_T,dp,steps,unknowns,warnings"
    )
    assert [(row["d0"], row["beta"]) for row in rows] == [("0.1", "0.4"), ("0.2", "0.4"), ("0.2", "0.3")]
    for row in rows:
        assert (row["status"], row["reason"], row["t"]) == ("finished", "end", "0.01")
        series = (swept / "out" / row["folder"] / "series.csv").read_text().splitlines()
        last = dict(zip(series[0].split(","), series[-1].split(","), strict=True))
        assert all(last[name] == row[name] for name in ("d", "dU", "U_L", "U_T", "D_L", "D_T", "dp"))


@pytest.mark.slow
def test_both_ranks_compute_and_every_folder_says_how(swept: Path) -> None:
    assert {case["rank"] for case in ledger(swept / "out").values()} == {0, 1}
    for text in run_records(swept / "out").values():
        assert "pairsim run" in json.loads(text)["command"]
    assert {"versions", "machine", "command_line"} <= set(json.loads((swept / "out" / "sweep.json").read_text()))


@pytest.mark.slow
def test_the_same_command_again_computes_nothing(swept: Path) -> None:
    before, rows = run_records(swept / "out"), table(swept / "out")
    (swept / "out" / "sweep.json").unlink()  # it is recovered from the folders
    done = subprocess.run(command(), cwd=swept, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    assert run_records(swept / "out") == before
    assert table(swept / "out") == rows


@pytest.mark.slow
def test_another_grid_is_refused(swept: Path) -> None:
    other = subprocess.run(command("--set", "mesh.Np=9"), cwd=swept, capture_output=True, text=True, check=False)
    assert other.returncode == 2
    assert "another grid" in other.stderr
    assert "Traceback" not in other.stderr


def test_a_sweep_of_another_version_is_named(pairsim: Pairsim, tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(THREE)
    (tmp_path / "out").mkdir()
    earlier = {"grid": "of then", "versions": {"pairsim": "0.1.0"}, "updated": 0, "cases": []}
    (tmp_path / "out" / "sweep.json").write_text(json.dumps(earlier))
    done = pairsim("sweep", "grid.yaml", "-o", "out")
    assert done.returncode == 2
    assert "has a sweep by pairsim 0.1.0" in done.stderr


def test_folder_that_is_no_sweep_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(THREE)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("precious")
    done = subprocess.run(command(), cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["all", "a rank"])
def test_killed_sweep_is_finished_by_the_same_command(victim: str, swept: Path, tmp_path: Path) -> None:
    """kill -9: no process continues, no file is damaged, no finished case is repeated, and the table is the same."""
    (tmp_path / "grid.yaml").write_text(THREE)
    job = subprocess.Popen(command(ranks=2), cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    out = tmp_path / "out"
    while job.poll() is None and not any('"finished"' in text for text in run_records(out).values()):
        time.sleep(0.02)
    tree = descendants(job.pid)
    # Breadth first, so that a child that has not executed its command yet comes after the ranks.
    ranks = [pid for pid in tree if "sweep" in words_of(pid) and "mpirun" not in words_of(pid)[0]][:2]
    assert len(ranks) == 2
    for pid in [job.pid, *ranks] if victim == "all" else ranks[-1:]:
        with suppress(ProcessLookupError):  # ended with a process killed before
            os.kill(pid, signal.SIGKILL)
    assert job.wait(timeout=200) != 0
    deadline = time.monotonic() + 50
    while any("run" in words_of(pid) for pid in tree):
        assert time.monotonic() < deadline, "an orphan goes on"
        time.sleep(0.02)
    finished = {name: text for name, text in run_records(out).items() if '"finished"' in text}
    assert 0 < len(finished) < 3
    done = subprocess.run(command(ranks=2), cwd=tmp_path, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    assert finished.items() <= run_records(out).items()
    assert table(out) == table(swept / "out")


@pytest.mark.slow
@pytest.mark.parametrize(("how", "ranks"), [("SIGTERM", 2), ("--walltime", 0)])
def test_stopped_sweep_keeps_its_cases_pending(how: str, ranks: int, tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY.replace("time: {end: 0.01}", ENDLESS) + "grid: {d0: [0.1, 0.2, 0.3]}\n")
    arguments = command(*(["--walltime", "2"] if how == "--walltime" else []), ranks=ranks)
    job = subprocess.Popen(arguments, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if how == "SIGTERM":
        while (
            job.poll() is None
            and sum(file.read_text().count("\n") > 1 for file in tmp_path.glob("out/*/series.csv")) < 2
        ):
            time.sleep(0.02)
        job.terminate()
    try:
        _, complaint = job.communicate(timeout=200)
    finally:
        job.kill()  # the cases are endless
    assert job.returncode == 130, complaint
    assert ("SIGTERM" if how == "SIGTERM" else "the wall time of the sweep is over") in complaint
    assert counts(tmp_path / "out") == {"pending": 3}
    if how == "SIGTERM":
        assert [json.loads(text)["status"] for text in run_records(tmp_path / "out").values()] == ["interrupted"] * 2


@pytest.mark.slow
def test_failures_stay_alone_and_are_repeated_only_when_asked(tmp_path: Path, pairsim: Pairsim) -> None:
    hopeless = ["{d0: 0.4, limits.max_steps: 2}", "{d0: 0.6, limits.wall_time: 1e-3}"]
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\ncases: [" + ", ".join(hopeless) + "]\n")
    done = pairsim("sweep", "grid.yaml", "-o", "out", "-q", ranks=2)
    assert done.returncode == 3
    assert "1 of 3 cases finished, 2 failed" in done.stderr
    ends = [(case["status"], case["reason"]) for case in ledger(tmp_path / "out").values()]
    assert ends == [("finished", "end"), ("failed", "max_steps"), ("timeout", "wall_time")]
    assert [(row["status"], row["reason"]) for row in table(tmp_path / "out")] == ends
    shown = CliRunner().invoke(app, ["status", str(tmp_path / "out")]).output
    assert all(reason in shown for reason in ("max_steps", "wall_time"))
    assert repeated(tmp_path) == [1, 1, 1]
    assert repeated(tmp_path, only_failed=True) == [1, 2, 2]
    content = json.loads((tmp_path / "out" / "sweep.json").read_text())
    first = content["cases"][0]  # one that was stopped at its first attempt has not failed
    first["status"] = "pending"
    (tmp_path / "out" / first["folder"] / "run.json").write_text('{"status": "interrupted"}')
    (failed,) = (case for case in content["cases"] if case["reason"] == "max_steps")
    failed["status"], failed["again"] = "running", True  # killed while it repeats one of them: it goes on with that
    (tmp_path / "out" / failed["folder"] / "run.json").unlink()
    (tmp_path / "out" / "sweep.json").write_text(json.dumps(content))
    assert repeated(tmp_path, only_failed=True) == [1, 3, 3]


def repeated(folder: Path, *, only_failed: bool = False) -> list[int]:
    """How often each case of the sweep has been begun after the same sweep again, in which some fail."""
    result = swept_into(folder / "grid.yaml", folder=folder / "out", only_failed=only_failed)
    assert result.status == "failed"
    return [case["attempts"] for case in result.record["cases"]]


@pytest.mark.slow
def test_case_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + f"cases: [{{{ENDLESS}}}]\n".replace("{time", "{d0: 0.1, time"))
    done = subprocess.run(command("--case-timeout", "2"), cwd=tmp_path, capture_output=True, check=False, timeout=200)
    assert done.returncode == 3
    (case,) = ledger(tmp_path / "out").values()
    assert case["seconds"] > 2
    assert (case["status"], case["reason"]) == ("timeout", "case_timeout")


@pytest.mark.slow
def test_fail_fast_stops(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(
        TINY + "grid: {d0: [0.1, 0.2]}\ncases: [{d0: 0.3, mesh.Np: 20, limits.max_steps: 1}]\n"
    )
    done = subprocess.run(command("--fail-fast"), cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert counts(tmp_path / "out") == {"failed": 1, "pending": 2}  # the most expensive case is started first


@pytest.mark.slow
def test_files_that_cannot_be_written_are_tried_again(tmp_path: Path) -> None:
    """A full disk, simulated by a limit on file sizes: no case is lost."""
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\n")

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

    done = subprocess.run(
        command(), cwd=tmp_path, capture_output=True, text=True, check=False, preexec_fn=limited, timeout=200
    )
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    assert "finished" not in counts(tmp_path / "out")
    done = subprocess.run(command(), cwd=tmp_path, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stderr
    assert counts(tmp_path / "out") == {"finished": 1}


@pytest.mark.slow
def test_run_that_could_not_write_goes_on_with_the_next_command(tmp_path: Path) -> None:
    """The sweep was stopped before it heard of the full disk from its case, whose run.json tells of it."""
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\n")
    assert swept_into(tmp_path / "grid.yaml", folder=tmp_path / "out").status == "finished"
    (run,) = (tmp_path / "out").glob("*/run.json")
    for path, old, new in (
        (run, '"finished"', '"failed"'),
        (run, '"reason": "end"', '"reason": "write_failed"'),
        (tmp_path / "out" / "sweep.json", '"status": "finished"', '"status": "pending"'),
    ):
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
    assert swept_into(tmp_path / "grid.yaml", folder=tmp_path / "out").status == "finished"
    assert counts(tmp_path / "out") == {"finished": 1}


def test_ledger_that_cannot_be_written_stops_the_sweep(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: {start: 0.1, stop: 0.5, num: 9}}\n")

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2_000, 2_000))

    (tmp_path / "out").mkdir()
    done = subprocess.run(
        command(), cwd=tmp_path, capture_output=True, text=True, check=False, preexec_fn=limited, timeout=200
    )
    assert done.returncode == 3
    assert "cannot be written (File too large)" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_useless_checkpoint_does_not_make_a_case_hopeless(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\n")
    (case,) = read_grid(tmp_path / "grid.yaml").cases
    folder = tmp_path / "out" / case.folder
    folder.mkdir(parents=True)
    (tmp_path / "out" / "grid.yaml").touch()
    (folder / "run.json").write_text('{"status": "running"}')
    (folder / "checkpoint.npz").write_bytes(b"torn")
    assert swept_into(tmp_path / "grid.yaml", folder=tmp_path / "out").status == "finished"
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"


@pytest.mark.slow
def test_shards_share_a_folder_and_a_last_command_makes_one_table(swept: Path, tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2]}\n")
    jobs = [subprocess.Popen(command("--shard", f"{i}/2"), cwd=tmp_path) for i in (1, 2)]
    assert [job.wait(timeout=200) for job in jobs] == [0, 0]
    assert [len(table(tmp_path / "out", f"results-{i}-of-2.csv")) for i in (1, 2)] == [1, 1]
    assert "2 finished" in CliRunner().invoke(app, ["status", str(tmp_path / "out")]).output
    before = run_records(tmp_path / "out")
    assert swept_into(tmp_path / "grid.yaml", folder=tmp_path / "out").status == "finished"
    assert run_records(tmp_path / "out") == before
    alone = {row["folder"]: row for row in table(swept / "out")}
    assert [row.items() <= alone[row["folder"]].items() for row in table(tmp_path / "out")] == [True, True]


@pytest.mark.slow
def test_curves_are_swept_too(tmp_path: Path) -> None:
    """results.csv has points, zeros and peak of every curve, as in its folder; pictures are drawn."""
    base = TINY.replace("Ca_e: 0, ", "d: [0.1, 0.3], tol: 1, ").replace(", time: {end: 0.01}", "")
    (tmp_path / "grid.yaml").write_text("command: curve\n" + base + "grid: {Ca_e: [0, 0.05]}\n")
    result = swept_into(tmp_path / "grid.yaml", folder=tmp_path / "out", workers=2)
    assert result.status == "finished"
    assert ",".join(name for name in result.table if name != "wall_time") == (
        "folder,status,reason,Ca_e,beta,De,points,zeros,zeros_error,stable,d_peak,d_peak_error,dU_peak,dU_error,"
        "unknowns,warnings"
    )
    rigid, soft = (row for _, row in result.table.iterrows())
    assert (soft["status"], soft["points"], soft["zeros"], soft["stable"]) == ("finished", 3, [], [])
    curve = result.cases[1]
    points = curve.table.loc[curve.table["dU"].idxmax()]
    assert soft["dU_peak"] == pytest.approx(curve.dU(soft["d_peak"]), rel=1e-9)
    assert 0 <= soft["dU_peak"] - points["dU"] < soft["dU_error"]
    assert soft["dU_error"] > points["dU_error"] * (1 - 1e-9)
    assert abs(soft["d_peak"] - points["d"]) <= soft["d_peak_error"]
    assert abs(rigid["dU_peak"]) < 1e-9 < soft["dU_peak"]
    assert plot_sweep(tmp_path / "out") == [tmp_path / "out" / "sweep_curves.png"], "there is no zero to draw"


def test_pictures_of_critical_distances_show_the_zeros(tmp_path: Path) -> None:
    def case(Ca_e: float, De: float, zeros: str, stable: str) -> dict[str, object]:
        values = {"points": 2, "zeros": zeros, "stable": stable}
        parameters = {"Ca_e": Ca_e, "De": De}
        return {
            "folder": f"{Ca_e}-{De}",
            "status": "finished",
            "reason": "end",
            "parameters": parameters,
            "values": values,
        }

    cases = [case(0.1, 0.25, [0.18], [False]), case(0.02, 0.25, "[0.25]", "[false]"), case(0.1, 0.0, [], [])]
    content = {"name": "zeros", "command": "critical", "varying": ["Ca_e", "De"], "updated": 0, "cases": cases}
    (tmp_path / "sweep.json").write_text(json.dumps(content))
    assert [path.name for path in plot_sweep(tmp_path)] == ["sweep_zeros.png"], "four places are no map"
    many = [*cases, *(case(Ca_e, De, [0.2], [True]) for Ca_e in (0.04, 0.06) for De in (0.0, 0.5))]
    (tmp_path / "sweep.json").write_text(json.dumps(content | {"cases": many}))
    assert [path.name for path in plot_sweep(tmp_path)] == ["sweep_zeros.png", "sweep_map.png"]
    (tmp_path / "sweep.json").write_text(json.dumps(content | {"varying": ["Ca_e"], "cases": cases[2:]}))
    with pytest.raises(InputError, match="no zero of dU"):
        plot_sweep(tmp_path)


@pytest.mark.slow
def test_shipped_sweep_runs(tmp_path: Path, pairsim: Pairsim) -> None:
    shutil.copy(ROOT / "configs" / "sweep.yaml", tmp_path)
    done = pairsim("sweep", "sweep.yaml", "--limit", "1", "--set", "time.end=0.01")
    assert done.returncode == 0, done.stderr
    assert counts(tmp_path / "runs" / "sweep") == {"finished": 1, "pending": 23}


@pytest.mark.slow
def test_pictures_of_a_sweep(swept: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["plot", str(swept / "out"), "-o", str(tmp_path / "pictures"), "--group", "beta"])
    assert done.exit_code == 0, done.output
    names = ["sweep_series.png", "sweep_parameters.png"]
    assert [Path(line).name for line in done.output.split()] == names
    for name in names:
        assert colours(tmp_path / "pictures" / name) > 50
    with pytest.raises(InputError, match="a parameter that varies: d0, beta"):
        plot_sweep(swept / "out", tmp_path, "xi")


def test_launcher_whose_mpi_is_another_is_an_input_error(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(THREE)
    environment = {**os.environ, "SLURM_STEP_NUM_TASKS": "4"}
    done = subprocess.run(command(), cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "4 processes that do not see each other" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_case_without_a_steady_state_is_finished(tmp_path: Path, pairsim: Pairsim) -> None:
    base = "base: {beta: 0.4, De: 0, d: [0.2], ends: developed, length: 3, mesh: {Np: 8}}\n"
    (tmp_path / "grid.yaml").write_text(f"command: curve\n{base}grid: {{Ca_e: [0.4]}}\n")
    assert pairsim("sweep", "grid.yaml", "-o", "out").returncode == 0
    (row,) = table(tmp_path / "out")
    assert (row["status"], row["reason"]) == ("finished", "no_steady_state")
