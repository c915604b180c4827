"""The Python interface, as used in a notebook."""

from __future__ import annotations

import _thread
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pint
import pytest

import pairsim
from pairsim.computing.fields_grid import grid_of
from pairsim.computing.progress import Reporter
from pairsim.lab.films.film import film_of
from pairsim.quantities.scales import Scales
from pairsim.questions.registry import QUESTIONS
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import FieldFrame

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8, "max_size": 0.3}}
CURVE = PAIR | {"d": [0.1, 0.3], "fields": [0.1]}
RUN = PAIR | {"d0": 0.1, "time": {"end": 0.01}}


@pytest.fixture(scope="module")
def curve() -> pairsim.CurveResult:
    return pairsim.curve(CURVE)


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def default_sigint() -> Iterator[None]:
    """Python's own handler of SIGINT, which the workers of pytest-xdist do without."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_computation_without_a_folder_prints_and_leaves_nothing(
    empty: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scratch = empty / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    result = pairsim.run(RUN)
    assert result.status == "finished"
    assert result.folder is None
    assert capfd.readouterr() == ("", "")
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
    assert len(result.table) == result.record["steps"]
    assert result.fields(0.01).n_points > 0
    assert list(empty.iterdir()) == [scratch]
    del result
    assert not list(scratch.iterdir())


def test_a_curve_is_its_interpolant_and_an_error_outside(curve: pairsim.CurveResult) -> None:
    d, dU, held, slope, error = (
        curve.table[name].to_numpy() for name in ("d", "dU", "dU_discrete", "slope", "dU_error")
    )
    assert curve.dU(d) == pytest.approx(dU)
    assert curve.curve(d)[1] == pytest.approx(error)
    value, half_width = curve.curve(0.2)
    assert value == curve.dU(0.2)
    assert half_width > np.interp(np.log(0.2), np.log(d), error)
    assert isinstance(curve.dU(0.2), float)
    assert curve.dU([[0.1, 0.2]]).shape == (1, 2)
    rest = np.gradient(dU - held, np.log(d), edge_order=2)[0] / d[0]
    assert (curve.dU(0.1 + 1e-6) - curve.dU(0.1)) / 1e-6 == pytest.approx(slope[0] + rest, rel=1e-3)
    for outside in (0.09, 0.31, float("nan"), [0.2, 0.4]):
        with pytest.raises(pairsim.InputError, match=r"must be from 0\.1 to 0\.3"):
            curve.dU(outside)
    with pytest.raises(ValueError, match="gap"):
        curve.dU(0.2, gap=2)


@pytest.mark.slow
def test_a_result_is_pickled_with_its_files_and_computed_in_one_thread_at_a_time() -> None:
    """Two at once in PETSc, MUMPS or gmsh end the process."""
    with ThreadPoolExecutor(2) as threads:
        first, second = threads.map(lambda Ca_e: pairsim.run(RUN, Ca_e=Ca_e), (0.05, 0.1))
    assert all(pickle.loads(pickle.dumps(question)) is question for question in QUESTIONS.values())
    content = pickle.dumps(second)
    copied = pickle.loads(content)
    pd.testing.assert_frame_equal(copied.table, second.table)
    assert (copied.status, copied.case) == ("finished", second.case)
    assert copied.fields(0.01).n_points == second.fields(0.01).n_points
    assert first.table["dU"].iloc[-1] != second.table["dU"].iloc[-1]


def test_a_file_of_another_command_is_known_by_its_keys() -> None:
    assert pairsim.load(CURVE).kind == "curve"
    assert pairsim.load(RUN).kind == pairsim.load({"beta": 0.4, "De": 0, "Ca_e": 0, "particles": 1}).kind == "run"
    with pytest.raises(pairsim.InputError, match="one for `pairsim curve`"):
        pairsim.load(CURVE, kind="run")


def test_a_curve_knows_its_peak_its_travel_and_its_units(curve: pairsim.CurveResult) -> None:
    assert curve.curve.peak.dU == pytest.approx(curve.dU(curve.curve.peak.d))
    assert [region.sign for region in curve.curve.regions] == [np.sign(curve.dU(0.2))]
    ends = (0.1, 0.3) if curve.dU(0.2) > 0 else (0.3, 0.1)
    way = curve.travel(*ends)
    assert way.time == pytest.approx(0.2 / abs(curve.dU(0.2)), rel=0.5)
    assert str(way).startswith(f"from d = {ends[0]} to {ends[1]}: ")
    assert list(curve.zeros.columns) == ["d", "stable", "slope", "peak", "d_error", "certain"]
    assert len(curve.zeros) == 0
    assert repr(curve).startswith(f"<pairsim curve: finished, {len(curve.table)} rows")
    assert curve.table.attrs["units"] | {"d": "D_c", "dU": "U_av", "D_L": ""} == curve.table.attrs["units"]
    asked = (lambda: curve.scales, lambda: curve.physical, lambda: curve.travel("5um", 0.3), lambda: curve.dU("5um"))
    for missing in asked:
        with pytest.raises(pairsim.InputError, match="physical block"):
            missing()


@pytest.mark.slow
def test_a_result_without_a_folder_is_drawn(curve: pairsim.CurveResult, tmp_path: Path) -> None:
    assert curve.folder is None
    assert [path.name for path in curve.plot(tmp_path)] == ["curve.png", "fields.png"]


def test_units_make_a_case_of_an_experiment() -> None:
    """The first example of docs/how-to/units.md."""
    beads = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "relaxation": "2ms"}
    found = pairsim.units(**beads, modulus="5kPa")
    assert (found.case.De, found.case.Ca_e) == pytest.approx((0.3395, 0.03395), rel=1e-3)
    assert "inertia is negligible" in repr(found)
    rigid = pairsim.units(**beads, kind="curve", distance=["2um", "20um"])
    assert (rigid.case.Ca_e, rigid.case.range_of_d) == (0, pytest.approx((0.04, 0.4)))
    with pytest.raises(pairsim.InputError, match="flow_rate"):
        pairsim.units(tube="50um")


def test_the_package_shows_its_interface_and_nothing_else() -> None:
    assert {"run", "curve", "critical", "shape", "sweep", "units", "open", "RunResult"} < set(dir(pairsim))
    assert not {"os", "Any", "import_module", "runtime", "api"} & set(dir(pairsim))
    assert all(getattr(pairsim, name) is not None for name in dir(pairsim))


@pytest.mark.slow
def test_fields_are_those_of_the_file(empty: Path) -> None:
    import pyvista as pv

    result = pairsim.curve(CURVE, folder="out")
    grid = result.fields(0.1)
    reader = pv.get_reader("out/fields.xdmf")
    reader.set_active_time_value(0.1)
    read = reader.read()
    read = read[0] if isinstance(read, pv.MultiBlock) else read
    assert result.places == pytest.approx([0.1])
    assert np.array_equal(grid.points, read.points)
    assert np.array_equal(grid.cell_data["region"], read.cell_data["region"])
    assert set(grid.point_data.keys()) | {"position"} == set(read.point_data.keys())
    for name in grid.point_data:
        known = ~np.isnan(grid.point_data[name])
        assert np.array_equal(grid.point_data[name][known], read.point_data[name][known]), name
        assert not read.point_data[name][~known].any(), name
    with pytest.raises(pairsim.InputError, match=r"one of 0\.1"):
        result.fields(0.2)


def test_fields_are_in_units_on_demand_and_unknown_where_there_are_none() -> None:
    cells, region = np.arange(12).reshape(2, 6), np.array([0, 1])
    names = ("velocity", "tau_s", "tau_p", "tr_c", "pressure")
    fields = [np.ones((12, 2)), np.ones((12, 4)), np.ones((12, 4)), np.ones(12), np.ones(12)]
    frame = FieldFrame(0.1, np.ones((12, 2)), cells, region, dict(zip(names, fields, strict=True)))
    grid = grid_of(frame, Scales(50e-6, 10e-3, 0.85))
    shown = {name: np.unique(values.T[0] if values.ndim > 1 else values) for name, values in grid.point_data.items()}
    assert grid.points[0] == pytest.approx([50, 50, 0])
    assert (shown["velocity"], shown["pressure"]) == (pytest.approx([1e4]), pytest.approx([170]))
    for name, value, where in (("tau_s_zz", 170, slice(6, 12)), ("tau_p_rr", 170, slice(6)), ("tr_c", 1, slice(6))):
        assert shown[name] == pytest.approx([value, np.nan], nan_ok=True), name
        assert grid.point_data[name][where] == pytest.approx(value), name


def test_overrides_change_keys_within_groups() -> None:
    case = pairsim.load(RUN, Ca_e=np.float64(0.05), mesh={"Np": 10}, **{"time.end": 0.5})
    assert (case.Ca_e, case.mesh.Np, case.mesh.max_size, case.time.end) == (0.05, 10, 0.3, 0.5)
    again = pairsim.load(case, De=0.5)
    assert (again.De, again.mesh.Np, again.Ca_e) == (0.5, 10, 0.05)
    assert RUN["mesh"] == {"Np": 8, "max_size": 0.3}, "the given dict stays as it was"


def test_quantities_of_pint_columns_of_pandas_and_all_numbers_of_numpy_are_values() -> None:
    registry = pint.UnitRegistry()
    block = {"tube": registry.Quantity(0.05, "mm"), "particle": pd.Series(["20 um", "19 um"], index=[3, 5])}
    block |= {"flow_rate": registry.Quantity(1, "ul/min"), "viscosity": registry.Quantity(1, "Pa*s")}
    block |= {"modulus": registry.Quantity(np.array([5, 6]), "kPa"), "distance": "5 um"}
    case = pairsim.load({"physical": block})
    assert case.beta == pytest.approx((0.4, 0.38))
    assert case.Ca_e == pytest.approx((0.033953, 0.028294), rel=1e-4)
    assert case.physical.given["tube"] == "0.05 mm"
    of_units = pairsim.units(**block, density=None, relaxation=None)
    assert of_units.case.beta == pytest.approx(case.beta)
    numbers = {"beta": registry.Quantity(0.4, ""), "Ca_e": np.longdouble(0.1), "d": pd.Series([0.1, 0.2])}
    curve = pairsim.load({"De": 0, **numbers}, kind="curve")
    assert (curve.beta, curve.Ca_e, curve.d) == (0.4, 0.1, (0.1, 0.2))
    with pytest.raises(pairsim.InputError, match="Ca_e: is missing"):
        pairsim.units(**block | {"modulus": None})
    several = pairsim.load({"beta": np.array([0.4, 0.3], dtype=np.longdouble), "De": 0, "Ca_e": 0, "d0": 0.1})
    assert several.beta == (0.4, 0.3)


def test_a_viscosity_of_none_is_that_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "flow.csv").write_text("rate [1/s],viscosity [Pa.s]\n1,2\n2,2\n5,2.01\n10,2\n20,1.99\n50,2\n")
    block = {"tube": "50um", "particle": ("20um", "19um", "20um"), "flow_rate": "1ul/min", "viscosity": None}
    of_file = pairsim.units(**block, rheology=tmp_path / "flow.csv", liquid="newtonian")
    assert of_file.case.scales is not None
    assert of_file.case.scales.viscosity == pytest.approx(2, rel=0.01)
    assert of_file.case.particles == 3


def test_a_case_may_be_its_keys_alone() -> None:
    keys = {"beta": 0.4, "De": 0, "Ca_e": 0, "d": [0.2], "mesh": {"Np": 8}}
    rigid = pairsim.curve(**keys)
    assert rigid.case.resolved() == pairsim.load(keys, kind="curve").resolved()
    with pytest.raises(pairsim.InputError, match="beta: is missing"):
        pairsim.curve()


WRONG: dict[str, tuple[Any, dict[str, Any], str]] = {
    "key": (RUN, {"betta": 0.4}, "did you mean beta"),
    "type": (3, {}, "the path of a case file, a dict of its keys, or a case"),
    "object": (
        RUN,
        {"De": object()},
        "De: must be a number, text, true or false, or a list or group of these, not a object",
    ),
    "nan": (RUN, {"De": float("nan")}, "De: must be a number, not nan"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_cases_are_typed_errors(name: str) -> None:
    given, overrides, message = WRONG[name]
    with pytest.raises(pairsim.InputError, match=message):
        pairsim.load(given, **overrides)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: pairsim.sweep({"base": RUN, "grid": {"De": [float("nan")]}}),
            r"grid.De\[0\]: must be a number, not nan",
        ),
        (lambda: pairsim.sweep({"base": RUN | {"De": object()}}), "grid: base.De: must be a number, text"),
        (lambda: pairsim.curve(CURVE, workers="2"), "workers: got '2'; must be a whole number of at least 1"),
        (lambda: pairsim.curve(CURVE, workers=1.5), "workers: got 1.5; must be a whole number of at least 1"),
        (lambda: pairsim.fit(pd.DataFrame({"t [s]": [0.0]}), RUN), "must be given: the quantities of the experiment"),
        (lambda: film_of(pd.DataFrame()), "film: got 'DataFrame'; must be the path of a table"),  # type: ignore[arg-type]
    ],
)
def test_arguments_of_another_type_are_typed_errors(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(pairsim.InputError, match=message):
        call()


def test_a_failure_is_a_result_whose_check_raises_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> Iterator[Any]:
        raise pairsim.errors.NoSteadyState("there is none", advice="softer words")

    monkeypatch.setattr("pairsim.questions.curve.computation.trace", none)
    result = pairsim.curve(CURVE, fields=[])
    assert (result.status, result.reason) == ("failed", "not_resolved")
    with pytest.raises(pairsim.errors.NoSteadyState) as caught:
        result.check()
    assert str(caught.value) == result.message


class Interrupting(Reporter):
    """Interrupts the main thread some time after the fifth step."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.seconds = seconds

    def update(self, done: float, text: str, count: int) -> None:
        if count == 5:
            threading.Timer(self.seconds, _thread.interrupt_main).start()


@pytest.mark.parametrize("seconds", [0.0, 0.041])
def test_a_keyboard_interrupt_leaves_a_partial_result(
    seconds: float, default_sigint: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it comes: in Python, or in a function that PETSc has called, where an exception would be lost."""
    monkeypatch.setattr("pairsim.questions.compute.Reporter", lambda *_: Interrupting(seconds))
    try:
        result = pairsim.run(RUN, time={"end": 1000.0, "tol": 1e-6})
    except KeyboardInterrupt:
        pytest.fail("the interrupt was not caught")
    assert result.status == "interrupted"
    assert len(result.table) >= 5
    assert result.fields(result.places[0]).n_points > 0
    with pytest.raises(KeyboardInterrupt):
        result.check()


def test_a_table_is_that_of_its_file_and_open_gives_the_results_again(empty: Path) -> None:
    computed, file = pairsim.run(RUN, folder="out"), read_table("out/series.csv")
    assert list(computed.table.columns) == list(file)
    for name, values in file.items():
        assert np.array_equal(computed.table[name], values), name
        assert (computed.table[name].dtype == np.int64) == (name in ("newton", "mesh")), name
    opened = pairsim.open("out")
    assert isinstance(opened, pairsim.RunResult)
    pd.testing.assert_frame_equal(opened.table, computed.table)
    assert opened.folder == computed.folder == Path("out")
    assert opened.case == computed.case == pairsim.load(RUN, length=3.0)
    assert (opened.status, opened.reason, opened.record["kind"]) == ("finished", "end", "run")


def test_open_refuses_what_it_does_not_know(empty: Path) -> None:
    with pytest.raises(pairsim.InputError, match="no such folder"):
        pairsim.open("missing")
    with pytest.raises(pairsim.InputError, match="but is empty"):
        pairsim.open(empty)
    (empty / "run.json").write_text("{}")
    with pytest.raises(pairsim.InputError, match="new or empty folder"):
        pairsim.run(RUN, folder=empty)


@pytest.mark.slow
def test_processes_of_a_job_compute_cases_of_their_own(empty: Path) -> None:
    """Also one alone, while the others do something else."""
    script = "\n".join(
        [
            "import pairsim",
            "from mpi4py import MPI",
            "from pathlib import Path",
            "rank = MPI.COMM_WORLD.rank",
            f"pairsim.curve({CURVE | {'Ca_e': 0, 'fields': []}!r}).check() if rank == 0 else None",
            f"result = pairsim.curve({CURVE | {'beta': [0.4, 0.3], 'Ca_e': 0, 'tol': 1}!r}, folder=f'out{{rank}}')",
            "Path(f'rank{rank}').write_text(' '.join(map(str, (repr(result.dU(0.2)), result.fields(0.1).n_cells))))",
        ]
    )
    words = [str(Path(sys.executable).parent / "mpirun"), "-n", "2", sys.executable, "-c", script]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    first, second = ((empty / f"rank{rank}").read_text() for rank in (0, 1))
    assert first == second
