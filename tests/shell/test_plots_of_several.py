"""Pictures of several runs or curves: legends, groups, small print, and differences."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.field_samples import PAIR, scene
from support.pictures import drawn_figures, overlapping
from support.result_folders import make_curve, make_run, make_sweep

from pairsim.app.open_and_plot import plot
from pairsim.plots.chart import Line
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import common_parts, equation, parts_along, varying_keys
from pairsim.plots.parameters import Parameters, ShownCase, measured
from pairsim.plots.runs_and_curves import _differences
from pairsim.plots.units import Units
from pairsim.record.column import names_of
from pairsim.record.columns import DISTANCE, DP, DU, DU_ERROR, TAYLOR, F, T, U
from pairsim.record.table_files import table_text
from pairsim.runtime.errors import InputError


def test_twelve_curves_of_two_parameters_are_told_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [make_curve(tmp_path / f"{a}-{b}", a, b) for a in (0.02, 0.05, 0.1, 0.15) for b in (0.25, 0.5, 1.0)]
    with drawn_figures(monkeypatch) as figures:
        plot(*folders, out=tmp_path / "out", width="85mm")
    (axis,) = figures[0].axes
    smooth = [line for line in axis.lines if len(line.get_xdata()) > 100]
    assert len({(line.get_color(), str(line._dash_pattern)) for line in smooth}) == 12
    assert len(axis.collections) == 12, "a band each"
    entries = {text.get_text() for text in figures[0].legends[0].get_texts()}
    assert {r"$\mathrm{Ca}_e = 0.02$", r"$\mathrm{De} = 1$", r"error of $\Delta U$", "unstable zero"} <= entries
    assert r"$\beta = 0.4$" in figures[0].get_supxlabel()
    assert r"\mathrm{De}" not in figures[0].get_supxlabel()


def curve_of_experiment(folder: Path, flow_rate: str, modulus: str, Ca_e: float, De: float) -> Path:
    """A curve of an experiment in a tube of 50 um, as if its number gave the flow rate in ul/min."""
    make_curve(folder, Ca_e, De)
    case = yaml.safe_load((folder / "case.yaml").read_text())
    block = {"tube": "50 um", "particle": "20 um", "flow_rate": flow_rate, "modulus": modulus, "viscosity": "1 Pa.s"}
    (folder / "case.yaml").write_text(yaml.safe_dump(case | {"physical": block | {"relaxation": "2 ms"}}))
    velocity = 8.5e-3 * De
    scales = {"length": 50e-6, "velocity": velocity, "time": 50e-6 / velocity, "stress": velocity / 50e-6}
    (folder / "run.json").write_text(json.dumps({"kind": "curve", "status": "finished", "scales": scales}))
    return folder


@pytest.mark.parametrize("swept", [False, True])
def test_figures_are_grouped_along_a_quantity(tmp_path: Path, swept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """De and Ca_e follow from the flow rate: they are told by it, and what else differs is told as a quantity."""
    cases = {
        "a": ("1 ul/min", "5 kPa", 0.1, 1),
        "b": ("2 ul/min", "5 kPa", 0.2, 2),
        "c": ("2 ul/min", "10 kPa", 0.1, 2),
    }
    folders = [curve_of_experiment(tmp_path / name, *each) for name, each in cases.items()]
    keys = ["physical.flow_rate", "physical.modulus", "Ca_e", "De"]
    if swept:
        folders = [
            make_sweep(tmp_path, "curve", {n: dict(zip(keys, each, strict=True)) for n, each in cases.items()}, keys)
        ]
    with drawn_figures(monkeypatch) as figures:
        plot(*folders, out=tmp_path / "out", group="physical.flow_rate")
    entries = {text.get_text() for text in figures[0].legends[0].get_texts()} - {
        r"error of $\Delta U$",
        "unstable zero",
    }
    assert entries == {"$Q$ = 1 μl/min", "$Q$ = 2 μl/min", "$G_p$ = 5 kPa", "$G_p$ = 10 kPa"}
    smooth = [line for line in figures[0].axes[0].lines if len(line.get_xdata()) > 100]
    assert len({line.get_color() for line in smooth}) == 2
    assert "not the same" not in figures[0].get_supxlabel()


def test_curves_are_grouped_along_any_key_in_which_they_differ(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mesh follows from De here, and is not told unless it is asked for."""
    folders = [make_curve(tmp_path / f"{De}", 0.1, De) for De in (0, 0.5)]
    for group, told in ((None, r"$\mathrm{De} = 0$"), ("mesh.Np", "$N_p = 8$")):
        with drawn_figures(monkeypatch) as figures:
            plot(*folders, out=tmp_path / "out", group=group)
        assert figures[0].legends[0].get_texts()[0].get_text() == told
    with pytest.raises(InputError, match=r"must be a parameter that varies: De, .*mesh\.Np"):
        plot(*folders, out=tmp_path / "out", group="beta")


def test_what_follows_from_another_difference_is_not_named() -> None:
    newtonian = {"beta": 0.4, "De": 0, "mesh.Np": 10, "name": "a"}
    elastic = {"beta": 0.4, "De": 1, "liquid": "giesekus", "liquid.alpha": 0.2, "mesh.Np": 20, "name": "b"}
    cases = [Parameters(each) for each in (newtonian, elastic, elastic | {"mesh.Np": 28})]
    assert varying_keys(cases[:2]) == ["De"]
    assert varying_keys(cases) == ["De", "mesh.Np"]


def test_a_case_without_a_parameter_of_others_has_none_in_legends() -> None:
    assert equation("De", 1.0) == r"$\mathrm{De} = 1$"
    assert equation("liquid.yielding.Bn", None).startswith("no ")


def test_small_print_states_what_all_cases_share_alone() -> None:
    giesekus = {"beta": 0.4, "De": 1, "Ca_e": 0.1, "d0": 0.1, "xi": 0.09, "liquid": {"law": "giesekus", "alpha": 0.2}}
    ptt = giesekus | {"beta": 0.2, "Ca_e": 0.05, "liquid": {"law": "ptt"}}
    assert common_parts([ShownCase(giesekus), ShownCase(ptt)], ["beta"]) == [
        r"$d_0 = 0.1\ D_c$", r"$\mathrm{De} = 1$", r"$\xi = 0.09$", r"not the same: $\mathrm{Ca}_e$, liquid",
    ]  # fmt: skip
    newtonian = ShownCase({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1})
    assert common_parts([ShownCase(giesekus), newtonian], ["De"])[-1] == r"$\alpha = 0.2$"
    from_rest = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": [0.1, 0.2], "after": 0.25}
    later = ShownCase(from_rest | {"after": 1})
    assert r"$T = 0.25\ D_c/U_{av}$" in common_parts([ShownCase(from_rest)], [])
    assert common_parts([ShownCase(from_rest), later], [])[-1] == "not the same: $T$"


def test_small_print_has_the_quantities_of_an_experiment_and_none_that_varies() -> None:
    block = {"tube": "6 mm", "flow_rate": "2 ml/min", "particle": "2 mm", "modulus": "1.5 kPa", "viscosity": "4 Pa.s"}
    one = {"beta": 0.4, "De": 0, "Ca_e": 0.05, "d": [0.1, 0.2], "physical": block | {"distance": ["1 mm", "2 mm"]}}
    two = one | {"Ca_e": 0.15, "physical": one["physical"] | {"flow_rate": "20 ml/min", "modulus": "5 kPa"}}
    cases = [ShownCase(one), ShownCase(two)]
    shared = ["$D_c$ = 6 mm", "$D_p$ = 2 mm", "$\\eta_0$ = 4 Pa\u22c5s", "not the same: $G_p$"]
    assert common_parts(cases, ["physical.flow_rate"], True) == shared
    assert common_parts(cases[:1], ["physical.flow_rate"], True, ["physical.modulus"]) == shared
    assert parts_along(cases[0], "Ca_e", True) == ["$D_c$ = 6 mm", "$Q$ = 2 ml/min", *shared[1:3]]
    assert equation("physical.distance", ["5um", "12um"]) == "$d_0$ = 5, 12 μm"
    assert equation("physical.modulus", "5 kPa +- 20 %") == "$G_p$ = 5 kPa ± 20 %"
    assert equation("physical.viscosity", "0.3 +- 0.01 Pa.s") == "$\\eta_0$ = 0.3 ± 0.01 Pa\u22c5s"


def test_lines_that_lie_on_each_other_may_differ_in_numbers_that_follow() -> None:
    x = np.linspace(1, 2, 9)
    both = {"physical.modulus": "1 kPa", "Ca_e": 0.1}, {"physical.modulus": "5 kPa", "Ca_e": 0.02}
    parameters = [Parameters(each) for each in both]
    columns = DISTANCE.with_suffix(""), DU.with_suffix("")
    lines = [Line(0, x, x + i / 100, columns=columns, parameters=each) for i, each in enumerate(parameters)]
    keys = ["physical.modulus"]
    found = _differences(lines, Encoding.of(parameters, keys), Units(), keys)
    assert found is not None
    assert found[1][0].y == pytest.approx(0.01)


def test_particles_of_one_case_are_not_compared_with_each_other() -> None:
    x = np.linspace(1, 2, 9)
    parameters = [Parameters({"beta": beta}) for beta in (0.3, 0.3, 0.4)]
    columns = [(DISTANCE.with_suffix(""), F.with_suffix(suffix)) for suffix in ("_L", "_T", "_L")]
    lines = [
        Line(0, x, x + y, columns=named, parameters=each)
        for y, named, each in zip((0, 0.01, 5), columns, parameters, strict=True)
    ]
    assert _differences(lines, Encoding.of(parameters, ["beta"]), Units(), ["beta"]) is None


def test_last_values_of_a_sweep_have_their_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parameters = {f"{beta}": {"beta": beta} for beta in (0.2, 0.4)}
    for name, own in parameters.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / "run.json").write_text('{"kind": "run", "status": "finished", "reason": "end"}')
        (folder / "case.yaml").write_text(json.dumps(own))
        names = names_of(2, T, DISTANCE, U, DU, DU_ERROR, TAYLOR, DP)
        (folder / "series.csv").write_text(table_text(names, [[0.5] * len(names)]))
    with drawn_figures(monkeypatch) as figures:
        plot(make_sweep(tmp_path, "run", parameters, ["beta"]))
    bars = [path.vertices[:, 1] for bar in figures[-1].axes[0].collections for path in bar.get_paths()]
    assert np.array(bars) == pytest.approx(np.array([[0.0, 1.0]] * 2))


def test_small_print_has_what_varies_where_all_other_cases_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_curve(tmp_path / "soft", 0.1)
    (tmp_path / "softest").mkdir()
    (tmp_path / "softest" / "case.yaml").write_text(json.dumps({"beta": 0.4, "De": 0.5, "Ca_e": 0.8}))
    for name, reason in (("soft", "end"), ("softest", "no_steady_state")):
        (tmp_path / name / "run.json").write_text(json.dumps({"status": "finished", "reason": reason}))
    with drawn_figures(monkeypatch) as figures:
        plot(make_sweep(tmp_path, "curve", {"soft": {"Ca_e": 0.1}, "softest": {"Ca_e": 0.8}}, ["Ca_e"]))
    assert r"$\mathrm{Ca}_e = 0.1$" in figures[0].get_supxlabel()


def test_more_values_than_styles_get_panels_or_are_named_as_unseen() -> None:
    sizes = {"a": 9, "b": 5, "c": 2, "e": 2}
    cases = [Parameters(dict(zip(sizes, each, strict=True))) for each in product(*map(range, sizes.values()))]
    encoding = Encoding.of(cases, ["a", "b", "c", "e"])
    assert (encoding.colour, encoding.line, encoding.panel, encoding.untold) == ("a", "c", "e", ("b",))
    assert len({tuple(encoding.look(case)["color"]) for case in cases}) == 9
    with pytest.raises(InputError, match="a parameter that varies: a, b"):
        Encoding.of(cases, ["a", "b"], "c")


def test_folders_that_cannot_be_laid_over_each_other_are_refused(tmp_path: Path) -> None:
    run, curve = (
        make_run(tmp_path / "run", 2, [scene(0.1, PAIR), scene(0.5, PAIR)]),
        make_curve(tmp_path / "curve", 0.1),
    )
    with pytest.raises(InputError, match="must be all runs or all curves"):
        plot(run, curve, out=tmp_path / "out")
    with pytest.raises(InputError, match="out: must be given with several folders"):
        plot(run, run)
    with pytest.raises(InputError, match="must be named once"):
        plot(run, run, out=tmp_path / "out")


def test_lines_that_lie_on_each_other_have_a_panel_of_their_differences(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = [make_curve(tmp_path / f"{a}", a) for a in (0.1, 0.102)]
    with drawn_figures(monkeypatch) as figures:
        plot(*folders, out=tmp_path / "out")
    _, right = figures[0].axes
    assert right.get_ylabel().startswith(r"$\Delta U - \Delta U$($\mathrm{Ca}_e = 0.1$)")
    (difference,) = (line for line in right.lines if len(line.get_xdata()) > 100)
    d, values = difference.get_data()
    assert values == pytest.approx(0.002 * np.log(d / 0.2), abs=1e-6)
    assert overlapping(figures[0]) == []


def test_quantities_of_an_experiment_are_numbers_in_the_unit_of_the_first() -> None:
    assert measured(["2 ms", "0.01 s", "500 us"]) == (pytest.approx([2, 10, 0.5]), "ms")
    assert measured(["2 ms", "3 um"]) is None
    assert measured(["giesekus", "ptt"]) is None
    times = [Parameters({"physical.relaxation": value}) for value in ("10 ms", "2 ms", "0.5 ms")]
    handles = Encoding.of(times, ["physical.relaxation"]).handles()
    assert [handle.get_label() for handle in handles] == [
        r"$\lambda$ = 0.5 ms", r"$\lambda$ = 2 ms", r"$\lambda$ = 10 ms",
    ]  # fmt: skip
