"""Pictures of a run: they exist, are not blank, and show the deformed particles."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure
from matplotlib.tri import TriContourSet
from PIL import Image
from support.field_samples import PAIR, scene
from support.pictures import colours, drawn_figures, overlapping
from support.result_folders import curve_of, curve_table, make_curve, make_run

from pairsim.analysis.time_series import Series
from pairsim.app.open_and_plot import plot
from pairsim.physics import declared
from pairsim.plots.chart import draw_series, leave_out_spikes, notes, point
from pairsim.plots.frames import FIELDS, outlines
from pairsim.plots.lines import curve_lines, run_lines
from pairsim.plots.parameters import Parameters
from pairsim.plots.sections import _streamlines, views_of
from pairsim.plots.style import GREY, MM, Page
from pairsim.plots.units import Units
from pairsim.record.columns import DISTANCE, DU, F, T
from pairsim.record.folder import FIELD_NAMES
from pairsim.record.xdmf import FieldFrame
from pairsim.runtime.errors import InputError

CASES = {
    "pipe": (0, [scene(0.5, [])]),
    "single": (1, [scene(0.1, [(0.0, 0.2, 0.2)]), scene(0.5, [(0.2, 0.23, 0.19)])]),
    "pair": (2, [scene(0.1, PAIR), scene(0.5, PAIR)]),
    "rigid pair": (2, [scene(0.1, PAIR, rigid=True)]),
    "three": (3, [scene(0.1, [(-0.6, 0.2, 0.2), (0.0, 0.2, 0.2), (0.6, 0.2, 0.2)])]),
}


def test_pictures_are_drawn_to_scale_and_not_blank(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", *CASES["rigid pair"])
    files = plot(folder, out=tmp_path / "pictures", width="85mm")
    assert [file.relative_to(tmp_path) for file in files] == [
        Path("pictures/series.png"), Path("pictures/fields.png"),
    ]  # fmt: skip
    assert colours(files[0]) > 50
    assert colours(files[1]) > 500
    # The grey pixels of two ellipses reach as far along the tube as across it as the ellipses do.
    above_the_bar = image.imread(files[1])[:-300, :, :3]
    grey = np.all(np.abs(above_the_bar - float(GREY)) < 0.003, axis=2)
    along, across = (np.ptp(np.flatnonzero(grey.sum(axis=i) > 10)) for i in (0, 1))
    (z_0, a_0, b_0), (z_1, a_1, b_1) = PAIR
    assert along / across == pytest.approx((z_1 + a_1 - z_0 + a_0) / (2 * max(b_0, b_1)), rel=0.02)


def test_run_without_fields_has_a_series_and_one_row_is_enough(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", 2, [], rows=1)
    assert plot(folder) == [folder / "series.png"]


def test_start_up_of_a_run_is_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = make_run(tmp_path / "run", 2, [])
    entry = {"d": [0.2], "dU": [0.01], "dU_error": [1e-3], "t_relax": 0.1, "start": "rest", "accuracy": 0.01}
    (folder / "run.json").write_text(json.dumps({"kind": "run", "settled": entry}))
    with drawn_figures(monkeypatch) as figures:
        plot(folder)
    (figure,) = figures
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["start-up"]
    assert [patch.get_bbox().x1 for patch in figure.axes[0].patches] == pytest.approx([0.3])
    assert not overlapping(figure)


def test_folder_without_anything_to_draw_is_an_input_error(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"kind": "run"}')
    with pytest.raises(InputError, match="not the folder of a run that has begun"):
        plot(tmp_path)
    (tmp_path / "series.csv").write_text("t,dp,dp_plus\n")
    with pytest.raises(InputError, match="no rows"):
        plot(tmp_path)
    folder = make_run(tmp_path / "run", 2, [])
    with pytest.raises(InputError, match=r"case.yaml.*: must be a writable file"):
        plot(folder, out=folder / "case.yaml")


@pytest.mark.parametrize("rigid", [False, True])
def test_outlines_are_the_curved_surfaces_from_upstream(rigid: bool) -> None:
    found = outlines(scene(0.1, PAIR, rigid=rigid))
    assert len(found) == 2
    for line, (z, a, b) in zip(found, PAIR, strict=True):
        assert line[0] == pytest.approx([z - a, 0], abs=1e-12)
        assert line[-1] == pytest.approx([z + a, 0], abs=1e-12)
        assert np.abs(((line - [z, 0]) / [a, b]) ** 2 @ [1, 1] - 1).max() < 1e-3
        assert np.all(np.diff(line[:, 0]) > 0)


def test_a_matplotlibrc_has_no_say_and_a_legend_can_be_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make_curve(tmp_path / "curve", 0.1)
    (plain,) = plot(folder, out=tmp_path / "a", width="85mm")
    with mpl.rc_context({"text.usetex": True, "text.color": "white", "savefig.transparent": True}):
        (same,) = plot(folder, out=tmp_path / "b", width="85mm")
    assert same.read_bytes() == plain.read_bytes()
    with drawn_figures(monkeypatch) as figures:
        plot(folder, out=tmp_path / "c", legend=False)
    assert not figures[0].legends
    assert not figures[0].get_supxlabel()
    assert not any(axis.get_legend() for axis in figures[0].axes)


def test_curve_is_drawn_as_its_interpolant_with_its_error() -> None:
    d = np.array([0.1, 0.2, 0.4])
    table = curve_table(d, np.log(d) ** 3, 3 * np.log(d) ** 2 / d, dU_error=np.ones(3))
    (line,) = curve_lines(curve_of(table), Parameters())
    assert line.y == pytest.approx(np.log(line.x) ** 3, rel=1e-12), "a cubic in log d is met exactly"
    assert line.error == pytest.approx(np.ones(len(line.x)), rel=1e-12)


def test_of_moved_particles_the_forces_are_drawn_with_their_errors() -> None:
    d = np.array([0.1, 0.2, 0.4])
    forces = {"F_L": 5 + d, "F_T": 6 - d, "F_error_L": d / 10, "F_error_T": d / 20}
    lines = curve_lines(curve_of(curve_table(d, 0 * d, 0 * d, **forces)), Parameters())
    assert [line.panel for line in lines] == [(DISTANCE, F)] * 2
    for line, name in zip(lines, "LT", strict=True):
        assert line.error is not None
        assert line.y[list(line.marked)] == pytest.approx(forces[f"F_{name}"])
        assert line.error[list(line.marked)] == pytest.approx(forces[f"F_error_{name}"])
    assert [each.get_label() for each in notes(lines)] == ["error of $F$"]


def test_run_is_drawn_with_the_band_of_its_error() -> None:
    t = np.array([1.0, 2.0, 3.0])
    table = {"t": t, "d": t / 10, "dU": t**2, "dU_error": t / 10}
    for shown, bands in ((table, 1), ({name: table[name] for name in ("t", "d", "dU")}, 0)):
        axis = Figure().subplots()
        (series,) = (each for each in run_lines(Series(shown), Parameters()) if each.panel == (T, DU))
        draw_series(axis, replace(series, look={"color": "C0"}))
        assert len(axis.collections) == len(notes([series])) == bands
        if bands:
            edge = axis.collections[0].get_paths()[0].vertices
            assert (edge[:, 1].min(), edge[:, 1].max()) == pytest.approx((0.9, 9.3))


@pytest.mark.slow
@pytest.mark.parametrize("width", [85, 170])
def test_nothing_overlaps_and_every_axis_has_a_label_with_a_unit(
    tmp_path: Path, width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = CASES if width == 85 else ("pair",)  # where there is more room
    runs = [make_run(tmp_path / name, *CASES[name]) for name in names]
    curves = [make_curve(tmp_path / f"c{a}", a) for a in (0.02, 0.15)]
    with drawn_figures(monkeypatch, written=True) as figures:
        for folder in runs:
            series, fields = plot(folder, out=tmp_path / "out", width=width)
            assert colours(series) > 50
            assert colours(fields) > 500
        plot(curves[0], out=tmp_path / "out", width=width)
        plot(*curves, out=tmp_path / "out", width=width)
    assert len(figures) == 2 * len(runs) + 2
    for figure in figures:
        assert overlapping(figure) == []
        for axis in figure.axes:
            labels = [axis.get_xlabel(), axis.get_ylabel()]
            panels_below = axis.get_title().startswith("$t") and not axis.get_xlabel()
            bar = axis.get_label() == "<colorbar>"
            named = [label for label in labels if "[$" in label or r"\ [" in label]
            assert len(named) == 2 - (bar or panels_below), labels


@pytest.mark.slow
def test_pictures_are_in_the_units_of_the_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a tube of 50 um and 8 mm/s: t in s, d in um, velocities in um/s; curves as their points and their zeros."""
    scales = {"length": 50e-6, "time": 6.25e-3, "velocity": 8e-3, "stress": 160.0}
    run, curve = make_run(tmp_path / "run", *CASES["pair"]), make_curve(tmp_path / "curve", 0.1)
    for folder in (run, curve):
        (folder / "run.json").write_text(json.dumps({"kind": folder.name, "status": "finished", "scales": scales}))
    with drawn_figures(monkeypatch) as figures:
        for physical in (None, False):
            for folder in (run, curve):
                plot(folder, out=tmp_path / "out", physical=physical)
    in_units, plain = figures[: len(figures) // 2], figures[len(figures) // 2 :]
    labels = [axis.get_xlabel() for figure in in_units for axis in figure.axes]
    assert {"$t$  [s]", "$d$  [µm]", "$z$  [µm]"} <= set(labels)
    assert not any("D_c" in label or "U_{av}" in label for label in labels)
    factors = {"$t$  [s]": 6.25e-3, "$d$  [µm]": 50.0, "$z$  [µm]": 50.0}
    for figure, other in zip(in_units, plain, strict=True):
        for axis, same in zip(figure.axes, other.axes, strict=True):
            if (factor := factors.get(axis.get_xlabel())) is not None:
                assert axis.get_xlim() == pytest.approx(np.array(same.get_xlim()) * factor, rel=1e-6)
                if "µm/s" in axis.get_ylabel():
                    assert axis.get_ylim() == pytest.approx(np.array(same.get_ylim()) * 8e3, rel=1e-6)


@pytest.mark.slow
def test_gaps_of_a_row_are_lines_below_a_scale_of_positions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with drawn_figures(monkeypatch) as figures:
        plot(make_run(tmp_path / "run", 5, []))
    panels = {axis.get_ylabel().partition("  ")[0]: axis for axis in figures[0].axes}
    distances, places = (next(axis for label, axis in panels.items() if label.startswith(f"${q}_")) for q in "dz")
    assert len(distances.get_lines()) == 4
    assert places.get_ylabel().startswith("$z_{1}$, $z_{2}$, $z_{3}$, ... from their mean")
    (above,) = distances.child_axes
    assert above.get_xlabel().startswith("position along the tube")
    figures[0].draw_without_rendering()
    assert above.get_xlim() == pytest.approx(1.5 * (np.array(distances.get_xlim()) - 0.1), rel=0.03)
    assert overlapping(figures[0]) == []


@pytest.mark.slow
def test_files_are_fit_for_print(tmp_path: Path) -> None:
    """Fonts are embedded as TrueType, the width is that of a column, and the same picture is the same file."""
    folder = make_curve(tmp_path / "curve", 0.1)
    files = plot(folder, out=tmp_path / "a", formats="svg,pdf, png", width="85mm")
    assert [file.name for file in files] == ["curve.png", "curve.pdf", "curve.svg"]
    with Image.open(files[0]) as picture:
        assert abs(picture.width - 85 * MM * Page().dpi) <= 1
    assert b"/TrueType" in files[1].read_bytes() or b"/CIDFontType2" in files[1].read_bytes()
    assert b"/Type3" not in files[1].read_bytes()
    again = plot(folder, out=tmp_path / "b", formats=["png", "pdf", "svg"], width=85)
    assert [file.read_bytes() for file in again] == [file.read_bytes() for file in files]
    assert not list(tmp_path.glob("*/.*"))


@pytest.mark.parametrize(
    ("options", "allowed"),
    [
        ({"formats": "jpg"}, "one or more of png, pdf, svg"),
        ({"width": "3mm"}, "50mm to 400mm"),
        ({"width": "wide"}, "50mm to 400mm"),
        ({"field": "speed"}, "one or more of velocity"),
        ({"field": "tr_c"}, "one of velocity, streamlines"),
        ({"group": "De"}, "is for a sweep or several folders"),
    ],
)
def test_wrong_options_say_what_is_allowed(tmp_path: Path, options: dict[str, str], allowed: str) -> None:
    folder = make_run(tmp_path / "run", *CASES["pair"])
    with pytest.raises(InputError, match=allowed):
        plot(folder, **options)


@pytest.mark.slow
def test_fields_by_name_and_as_an_animation(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", *CASES["pair"])
    names = [file.name for file in plot(folder, field="all", width="85mm")]
    assert names == [
        f"field-{name}.png" for name in ("velocity", "streamlines", "N1", "tau_zz", "pressure", "velocity_extra")
    ]
    assert all(colours(folder / name) > 300 for name in names)
    (animation,) = plot(folder, animate=True, field="velocity", width="85mm")
    assert animation.name == "field-velocity.gif"
    with Image.open(animation) as picture:
        assert picture.n_frames == 2
    with pytest.raises(InputError, match="has 1 frame of fields"):
        plot(make_run(tmp_path / "still", 2, [scene(0.1, PAIR)]), animate=True)
    with pytest.raises(InputError, match="got 'mp4'; must be left out with `animate`"):
        plot(folder, animate=True, formats="mp4")


def test_the_yield_surface_is_a_contour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def with_plug(moment: FieldFrame) -> FieldFrame:
        return replace(moment, point_data=moment.point_data | {"yielding": moment.points[:, 1] / 0.3})

    folder = make_run(tmp_path / "run", 2, [with_plug(scene(t, PAIR)) for t in (0.0, 0.1)])
    with drawn_figures(monkeypatch) as figures:
        plot(folder, field="velocity")
    contours = [line for axis in figures[0].axes for line in axis.collections if isinstance(line, TriContourSet)]
    radii = np.abs(np.concatenate([path.vertices[:, 1] for each in contours for path in each.get_paths()]))
    assert len(contours) == 4, "above and below the axis at both times"
    assert radii == pytest.approx(0.3, abs=1e-6)


def test_every_picture_of_a_field_is_one_that_overwrite_removes() -> None:
    assert tuple(FIELDS) == (*FIELD_NAMES, *declared.FIELDS)


def test_intervals_of_critical_distances() -> None:
    """Upright at a distance, lying where two zeros meet, none without an error."""
    axis = Figure().subplots()
    for d_error, parameter_error in ((0.01, np.nan), (np.nan, 0.2), (np.nan, np.nan)):
        draw_series(axis, point(0, 1.0, 0.1, "stable zero", d_error, parameter_error))
    drawn = [np.array(collection.get_segments()[0]) for collection in axis.collections]
    assert len(drawn) == 2
    assert drawn[0] == pytest.approx(np.array([[1.0, 0.09], [1.0, 0.11]]))
    assert drawn[1] == pytest.approx(np.array([[0.8, 0.1], [1.2, 0.1]]))


def test_brief_start_up_reaches_out_of_the_axis() -> None:
    t = np.concatenate([np.linspace(0, 1e-3, 50), np.linspace(0.01, 1, 100)])
    axis = Figure().subplots()
    spike = np.where(t < 1e-3, -100.0, np.sin(t))
    axis.plot(t, spike)
    assert leave_out_spikes(axis, [(t, spike)])
    low, high = axis.get_ylim()
    assert -0.5 < low < 0
    assert 0.8 < high < 10
    assert not leave_out_spikes(smooth := Figure().subplots(), [(t, np.sin(t))])
    assert smooth.get_autoscaley_on(), "nothing is left out"


def test_lines_of_many_gaps_are_told_apart_by_a_scale_of_colours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make_run(tmp_path / "run", 12, [])
    with drawn_figures(monkeypatch) as figures:
        plot(folder, width=85)
    distances = figures[0].axes[0]
    lines = [line for line in distances.lines if len(line.get_xdata()) > 2]
    assert len({str(line.get_color()) for line in lines}) == 11
    (legend,) = [axis.get_legend() for axis in (distances,)]
    assert [text.get_text() for text in legend.get_texts()] == ["$d_{1}$", "$d_{11}$"]


def test_streamlines_end_before_the_particles() -> None:
    view = views_of([scene(0.1, PAIR, rays=16)], Units(), curve=False)[0]
    axis = Figure().subplots()
    _streamlines(axis, view)
    drawn = np.vstack([path.vertices for lines in axis.collections for path in lines.get_paths() if len(path.vertices)])
    for z, a, b in PAIR:
        assert (((drawn[:, 0] - z) / a) ** 2 + (drawn[:, 1] / b) ** 2).min() > 0.95
