"""`ask`: answers of an atlas in units, the part of the inputs in them, and where it has none."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.atlases import CASE, exact
from support.commands import Pairsim

import pairsim as api
from pairsim.analysis.input_ranges import DrawnRange
from pairsim.atlas.atlas import Atlas
from pairsim.cases.coverage import beyond
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.questions.curve import CurveCase
from pairsim.runtime.errors import InputError

BENCH = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "10kPa"}
ELASTIC = {**BENCH, "relaxation": "2ms", "liquid": "giesekus"}


def test_an_answer_is_that_of_the_atlas_in_units(atlas: Path) -> None:
    answer, case = api.ask(**ELASTIC, atlas=atlas), api.units(kind="curve", **ELASTIC).case
    table = curve_of_atlas(Atlas.load(atlas), beta=case.betas[0], De=case.De, Ca_e=case.Ca_es[0]).table
    at = 20  # an inner point
    assert answer.curve(table["d"][at]) == pytest.approx((table["dU"][at], table["dU_error"][at]), rel=0.01)
    there = answer.dU(f"{50 * table['d'][at]:.12g}um").to("m/s").magnitude
    assert there == pytest.approx(table["dU"][at] * answer.scales.velocity)
    (zero,) = answer.zeros.itertuples()
    assert abs(answer.dU(zero.d)) < 1e-3 * np.abs(table["dU"]).max()
    assert not zero.stable
    assert answer.findings()[0].startswith("The pair comes closer between d = ")
    assert answer.answer == "\n".join(answer.findings())
    assert answer.travel("15um", "30um").time > 0


def test_keys_of_a_case_may_be_given_without_a_dict(atlas: Path) -> None:
    numbers = {"beta": 0.4, "De": 0.3, "Ca_e": 0.05}
    assert api.ask(**numbers, atlas=atlas).answer == api.ask(numbers, atlas=atlas).answer
    with pytest.raises(InputError, match="unknown key; did you mean beta"):
        api.ask(**numbers, bta=0.4, atlas=atlas)
    with pytest.raises(InputError, match=r"physical\.tube: is missing"):
        api.ask(atlas=atlas)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        pytest.param({}, None, id="a viscous liquid"),
        pytest.param({"viscosity": "1mPa.s"}, r"as much as the softness.*Re beta\^2 = 0\.068 against", id="water"),
        pytest.param({"viscosity": "1mPa.s", "density": "0.01 kg/m^3"}, None, id="a light liquid"),
        pytest.param({"modulus": None}, "only inertia, neglected here, changes it", id="rigid"),
    ],
)
def test_an_answer_warns_where_inertia_may_matter_as_units_does(
    given: dict[str, str | None], said: str | None, atlas: Path
) -> None:
    quantities = {name: value for name, value in (BENCH | given).items() if value is not None}
    warnings = api.ask(**quantities, atlas=atlas).warnings
    assert ("warning: inertia" in repr(api.units(**quantities))) == any("as much as" in each for each in warnings)
    assert bool(warnings) == (said is not None)
    if said is not None:
        assert re.search(said, warnings[0])


def test_the_part_of_the_inputs_is_that_of_first_order_where_they_are_small(atlas: Path) -> None:
    answer = api.ask(**ELASTIC | {"modulus": "10 +- 0.4 kPa", "relaxation": "2 ms +- 2 %"}, atlas=atlas)
    of_modulus, of_time = (each["half_width"] / each["value"] for each in answer.record["inputs"] if each["half_width"])
    table, case = answer.columns, api.units(kind="curve", **ELASTIC).case
    by = [of_modulus * case.Ca_es[0] * table["by_Ca_e"], of_time * case.De * table["by_De"]]
    drawn = answer.record["dU_inputs"]
    half = (drawn["largest"] - drawn["least"])[::4] / 2  # at the distances of the table
    assert half == pytest.approx(1e6 * answer.scales.velocity * np.hypot(*by), rel=0.1)
    assert (drawn["outside"] == 0).all()


@pytest.mark.parametrize(
    ("particle", "modulus", "few"),
    [("20um", "6 +- 3 kPa", True), ("16.5 +- 1.7 um", "10 +- 1 kPa", True), ("16 +- 3 um", "10 +- 1 kPa", False)],
)
def test_a_range_holds_dU_of_most_draws_of_uncertain_inputs(
    particle: str, modulus: str, few: bool, atlas: Path
) -> None:
    """Also where dU is not linear in them, and where some draws are outside of the box, of which dU is invented."""
    answer, loaded = api.ask(**ELASTIC | {"particle": particle, "modulus": modulus}, atlas=atlas), Atlas.load(atlas)
    drawn, draws, d = DrawnRange.of(answer.record), 4000, 8 / 50
    assert drawn is not None
    normal = iter(np.random.default_rng(5).standard_normal((2, draws)))
    sizes = {"particle": 1.0, "modulus": 1.0}
    for each in answer.record["inputs"]:
        if each["half_width"]:
            sizes[each["key"]] = 1 + each["half_width"] / each["value"] / 2 * next(normal)
    case = answer.case
    places = np.stack(
        [np.broadcast_to(x, draws) for x in (case.beta * sizes["particle"], case.De, case.Ca_e / sizes["modulus"])],
        axis=1,
    )
    low, high = np.array([loaded.box[name] for name in ("beta", "De", "Ca_e")]).T
    outside = ((places < low) | (places > high)).any(axis=1)
    dU = 1e6 * answer.scales.velocity * exact(*places.T, d)
    least, largest = map(float, re.findall(r"[+-][\d.]+", drawn.words(d)))
    held = (dU >= least) & (dU <= largest)
    said = drawn.outside_at(d)
    if few:
        assert (held & ~outside).mean() == pytest.approx(0.95, abs=0.015)
        assert not said or "count as outside this range" in said
    else:
        assert held[~outside].mean() == pytest.approx(0.95, abs=0.015)
        assert float(said.partition(" %")[0]) == pytest.approx(100 * outside.mean(), abs=2)
        assert "outside the atlas, beta below 0.3, and are not known: the range is that of the others" in said
    assert bool(said) == bool(outside.any())


def test_a_zero_of_most_draws_is_where_both_signs_are(atlas: Path) -> None:
    answer = api.ask(**ELASTIC | {"modulus": "10 +- 2 kPa"}, atlas=atlas)
    drawn, zero = DrawnRange.of(answer.record), answer.zeros["d"][0]
    assert drawn is not None
    ends = drawn.around(zero)
    zeros = [api.ask(**ELASTIC | {"modulus": f"{G} kPa"}, atlas=atlas).zeros["d"][0] for G in (8, 12)]
    assert sorted(zeros) == pytest.approx(sorted(ends), rel=0.02)
    assert f"the zero at d = {50 * zero:.4g} um is between" in " ".join(answer.findings())


def test_a_difference_of_the_diameters_has_its_part_in_the_range(atlas: Path) -> None:
    answer = api.ask(**ELASTIC | {"particle_difference": "0 +- 0.1 %"}, atlas=atlas)
    drawn = answer.record["dU_inputs"]
    half = 1e6 * answer.scales.velocity * 1e-3 * np.abs(answer.columns["by_difference"])
    assert (drawn["largest"] - drawn["least"])[::4] / 2 == pytest.approx(half, rel=0.05)
    assert not drawn["missing"]


def test_what_an_input_changes_that_the_atlas_has_one_value_of_is_said(atlas: Path) -> None:
    answer = api.ask(**ELASTIC | {"solvent": "90 +- 5 mPa.s"}, atlas=atlas)
    assert "The effect of solvent on xi is not included: the atlas has one xi." in answer.findings()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"relaxation": "20ms"},
            r"De = 3.395 is not between 0 and 1; pairsim curve computes it \(about .* on one core",
        ),
        ({"liquid": "oldroyd-b"}, "the liquid is Oldroyd-B, that of the atlas Giesekus"),
        (
            {"liquid": {"law": "giesekus", "alpha": 0.071}},
            r"answer: alpha = 0\.071, but 0\.2 in the atlas; pairsim curve",
        ),
        ({"solvent": "0.5 Pa.s"}, r"xi = 0\.5, but 0\.09 in the atlas; pairsim curve"),
        ({"particle": ["20um", "22um"]}, "the beads differ"),
        ({"particle": ["20um", "20um", "20um"]}, "must be 2: an atlas answers for pairs"),
        ({"solid": {"law": "mooney-rivlin", "c": 0.5}}, "the beads are Mooney-Rivlin, those of the atlas neo-Hookean"),
        ({"length": 20}, "length is 20, but auto in the atlas"),
        ({"ends": "periodic", "length": 20}, "ends is periodic, but developed in the atlas"),
        ({"tube": "50kPa"}, "must be a length"),
    ],
)
def test_where_the_atlas_has_no_answer_it_says_why(atlas: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        api.ask(**(ELASTIC | change), atlas=atlas)


def test_quantities_of_a_block_count_as_those_beside_it(atlas: Path) -> None:
    with pytest.raises(InputError, match=r"xi = 0\.5, but 0\.09 in the atlas"):
        api.ask(**ELASTIC, physical={"solvent": "0.5 Pa.s"}, atlas=atlas)


class Heavy(CurveCase):
    """A curve with a key that no atlas knows."""

    gravity: float = 0.0


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("gravity", 50.0, "gravity is 50, but 0 in the atlas"),
        ("after", 1.0, "after is 1, but not given in the atlas"),
        ("velocity", 0.5, "velocity is 0.5, but not given in the atlas"),
        ("flow", 0, "flow is 0, but 1 in the atlas"),
        ("max_points", 7, ""),
        ("name", "bench", ""),
    ],
)
def test_a_key_is_compared_unless_it_is_known_not_to_matter(key: str, value: Any, why: str, atlas: Path) -> None:
    case = {**CASE, "beta": 0.4, "De": 0.3, "Ca_e": 0.05, "d": [0.1, 0.2]}
    loaded = Atlas.load(atlas)
    assert beyond(Heavy.model_validate(case), loaded) == []
    assert beyond(Heavy.model_validate(case | {key: value}), loaded) == ([why] if why else [])


@pytest.mark.parametrize(
    ("more", "key"),
    [({"d0": 0.1, "hold": True}, "hold"), ({"d": [0.02, 0.8], "along": {"Ca_e": [0.05, 0.1]}}, "along")],
)
def test_a_key_that_no_curve_has_is_refused_where_it_matters(more: dict[str, Any], key: str, atlas: Path) -> None:
    with pytest.raises(InputError, match=f"{key}: .*must be left out: atlases do not cover it"):
        api.ask({"beta": 0.4, "De": 0, "Ca_e": 0.05, **more}, atlas=atlas)
    assert api.ask({"beta": 0.4, "De": 0, "Ca_e": 0.05, "d0": 0.1, "time": {"end": 3}}, atlas=atlas).dU(0.1)


@pytest.fixture
def two_atlases(atlas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """One of Newtonian liquids with wide intervals, and one of Giesekus liquids, in place of those that ship."""
    made = Atlas.load(atlas)
    newtonian = {key: value for key, value in CASE.items() if key != "liquid"}
    wide = replace(made, box={**made.box, "De": (0.0, 0.0), "beta": (0.25, 0.5)}, widths=10 * made.widths)
    wide = replace(wide, provenance={"case": {**newtonian, "De": 0.0}})
    files = tmp_path / "newtonian.npz", tmp_path / "giesekus.npz"
    for file, each in zip(files, (wide, made), strict=True):
        each.save(file)
    monkeypatch.setattr("pairsim.lab.ask_atlas.SHIPPED", [files[1], files[0]])
    return files


def test_of_several_atlases_that_of_the_law_of_the_liquid_answers(two_atlases: tuple[Path, Path]) -> None:
    """Also where intervals of another one are narrower: these may be the ones that are too narrow."""
    for given, file in ((BENCH, two_atlases[0]), (ELASTIC, two_atlases[1])):
        expected = api.ask(**given, atlas=file).columns["dU_error"]
        assert api.ask(**given).columns["dU_error"] == pytest.approx(expected)
    assert api.ask(**BENCH).warnings == []
    assert "The liquid of the atlas is Giesekus with xi = 0.09 and alpha = 0.2." in api.ask(**ELASTIC).findings()
    assert not any("liquid" in each for each in api.ask(**BENCH).findings())


def test_the_box_that_a_case_is_outside_of_is_that_of_its_law(two_atlases: tuple[Path, Path]) -> None:
    for given, why in (
        (ELASTIC | {"relaxation": "6.19ms"}, r"answer: De = 1\.051 is not between 0 and 1; "),
        (ELASTIC | {"particle": "14.5um"}, r"answer: beta = 0\.29 is not between 0\.3 and 0\.5; "),
        (BENCH | {"particle": "12um"}, r"answer: beta = 0\.24 is not between 0\.25 and 0\.5; "),
    ):
        with pytest.raises(InputError, match=why):
            api.ask(**given)


def test_atlases_that_disagree_are_told_of(two_atlases: tuple[Path, Path], tmp_path: Path, pairsim: Pairsim) -> None:
    other = Atlas.load(two_atlases[0])
    curves = replace(other.curves, dU=1.5 * other.curves.dU, gradients=1.5 * other.curves.gradients)
    replace(other, curves=curves).save(two_atlases[0])
    (warning,) = api.ask(**BENCH).warnings
    assert warning.startswith("two atlases disagree: at d = ")
    assert api.ask(**BENCH).dU(0.2) == pytest.approx(1.5 * api.ask(**BENCH, atlas=two_atlases[1]).dU(0.2), rel=0.05)
    words = "ask --tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 10kPa"
    assert f"Warning: {warning}" in pairsim(*words.split()).stdout


@pytest.fixture
def answer(atlas: Path) -> Any:
    return api.ask(**ELASTIC | {"modulus": "10 +- 1 kPa"}, atlas=atlas)


def test_an_answer_has_all_that_a_curve_has(answer: Any, tmp_path: Path) -> None:
    frame = answer.frame()
    assert list(frame) == list(answer.table)
    assert len(frame) == 41
    assert answer.physical["dU"].to_numpy() == pytest.approx(1e6 * answer.scales.velocity * answer.columns["dU"])
    assert answer.frame("equilibria")["d"].to_numpy() == pytest.approx(answer.zeros["d"].to_numpy())
    assert answer.frame(at=["8um"], physical=True)["dU"][0] == pytest.approx(answer.dU("8um").to("um/s").magnitude)
    assert (answer.case.beta, answer.case.kind) == (0.4, "curve")
    assert [path.name for path in answer.plot(tmp_path)] == ["curve.png"]
    assert answer.advice == "Next: travel(start, stop) gives the time and tube that a pair needs."
    assert answer.places.size == 0
    assert (answer.status, answer.kind, answer.folder) == ("finished", "curve", None)
    with pytest.raises(InputError, match="pairsim ask: stop"):
        answer.travel("5um", "30um")


def test_an_answer_is_pickled_with_its_data(answer: Any, tmp_path: Path) -> None:
    again = pickle.loads(pickle.dumps(answer))
    assert again.frame().equals(answer.frame())
    assert again.case == answer.case
    assert again.findings() == answer.findings()
    assert again.dU("8um") == answer.dU("8um")
    assert (again.advice, repr(again)) == (answer.advice, repr(answer))
    assert again.plot(tmp_path)[0].stat().st_size > 10_000


def test_the_command_loads_nothing_that_takes_long() -> None:
    words = "ask --tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 5kPa --at 8um"
    command = [sys.executable, "-X", "importtime", "-P", "-m", "pairsim", *words.split()]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    names = {line.rpartition("|")[2].strip().partition(".")[0] for line in loaded.splitlines()}
    assert "numpy" in names
    assert not {"dolfinx", "ufl", "pandas", "pint", "matplotlib"} & names
    assert not {"scipy.interpolate", "scipy.optimize", "scipy.linalg"} & set(re.findall(r"scipy\.\w+", loaded))


def test_a_case_file_is_asked_about_too(atlas: Path, tmp_path: Path) -> None:
    file = tmp_path / "case.yaml"
    file.write_text(api.units(**ELASTIC, distance="8um").case_file("bench"))
    known = pytest.approx(api.ask(**ELASTIC, atlas=atlas).dU("8um").magnitude)
    assert api.ask(file, atlas=atlas).dU("8um").magnitude == known
    of_curve = {key: value for key, value in ELASTIC.items() if key != "liquid"} | {"distance": ["5um", "8um", "12um"]}
    assert api.ask({"physical": of_curve, "liquid": "giesekus"}, atlas=atlas).dU("8um").magnitude == known
    with pytest.raises(InputError, match="must be the case of a pair, not one of pairsim train"):
        api.ask({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": 0.3, "row": {"beads": 30}}, atlas=atlas)


def test_the_command_answers_in_words(atlas: Path, pairsim: Pairsim) -> None:
    options = (
        "--tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 5kPa --at 20um --from 20um --to 30um"
    )
    done = pairsim(
        "ask", *options.split(), "--relaxation", "2 +- 0.4 ms", "--liquid", "giesekus", "--atlas", str(atlas)
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"In 95 % of random draws of the inputs, dU at d = \S+ um is \S+ to \S+ um/s", done.stdout)
    assert re.search(
        r"At d = 20 um: dU = \S+ \+- \S+ um/s; with the uncertainty of the inputs \S+ to \S+ um/s\.", done.stdout
    )
    assert " of tube" in done.stdout
    refused = pairsim("ask", "--particle", "20um", "--atlas", str(atlas))
    assert refused.returncode == 2
    assert "--tube: must be given, or a case file" in refused.stderr
    refused = pairsim("ask", "--tube", "50um", "--from", "20um", "--atlas", str(atlas))
    assert "--to: must be given, too, to compute a travel" in refused.stderr


def test_commands_take_the_law_of_a_case_that_names_none_and_say_so(atlas: Path, pairsim: Pairsim) -> None:
    bench = "--tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 5kPa --relaxation 2ms"
    asked = pairsim("ask", *bench.split(), "--atlas", str(atlas))
    assert "No law of the liquid is given, so Giesekus is assumed" in asked.stdout
    named = pairsim("ask", *bench.split(), "--liquid", "giesekus", "--atlas", str(atlas))
    assert asked.stdout.splitlines()[0] == named.stdout.splitlines()[0]
    assert "is assumed" not in named.stdout
    assert "default used: liquid: giesekus with alpha = 0.2" in pairsim("units", *bench.split()).stdout


def test_the_command_takes_the_modulus_of_young(atlas: Path, pairsim: Pairsim) -> None:
    bench = "--tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s"
    of_young, of_shear = (
        pairsim("ask", *bench.split(), *modulus, "--atlas", str(atlas)).stdout.splitlines()
        for modulus in (("--young", "15kPa"), ("--modulus", "5kPa"))
    )
    assert of_young[0] == of_shear[0]
    both = pairsim("ask", *bench.split(), "--young", "15kPa", "--modulus", "5kPa", "--atlas", str(atlas))
    assert "--young: got '15kPa'; must be left out if --modulus is given" in both.stderr


def test_what_is_not_known_or_does_not_move_is_not_in_the_answer(atlas: Path) -> None:
    start = next(line for line in api.ask(**BENCH | {"modulus": "1.8kPa"}).findings() if "that starts at" in line)
    assert "dU_held" not in start, "the atlas does not have it"
    rigid = api.ask(**{key: value for key, value in BENCH.items() if key != "modulus"}, atlas=atlas)
    still, unequal = rigid.findings()
    assert still == "The pair keeps its distance: dU vanishes at every d."
    assert "for each per cent by which the leading one is larger, dU at d = 1 um changes by -" in unequal
    with pytest.raises(InputError, match="must be left out: dU = 0 at every distance, so that the pair never moves"):
        rigid.travel("5um", "10um")


def test_the_command_names_options_and_answers_all_or_nothing(atlas: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    bench = ["ask", "--tube", "50um", "--particle", "20um", "--flow", "1ul/min", "--modulus", "5kPa"]
    refused = pairsim(*bench, "--atlas", str(atlas))
    assert "pairsim ask: --viscosity: is missing" in refused.stderr
    refused = pairsim(*bench, "--liquid", "power-law", "--set", "liquid.n=0.6", "--atlas", str(atlas))
    assert "pairsim ask: --set consistency: is missing" in refused.stderr
    refused = pairsim(*bench, "--viscosity", "1Pa.s", "--at", "8ms", "--atlas", str(atlas))
    assert "--at: got '8ms'" in refused.stderr
    assert not refused.stdout
    (tmp_path / "case.yaml").write_text(api.units(**BENCH).case_file("bench"))
    refused = pairsim("ask", "case.yaml", "--flow", "2ul/min", "--atlas", str(atlas))
    assert "--flow: got '2ul/min'; must be left out" in refused.stderr


def test_a_travel_that_the_pair_does_not_make_loses_no_other_answer(atlas: Path, pairsim: Pairsim) -> None:
    bench = "--tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 10kPa --relaxation 2ms"
    words = ["ask", *bench.split(), "--liquid", "giesekus", "--at", "8um", "--atlas", str(atlas)]
    done = pairsim(*words, "--from", "5um", "--to", "30um")
    assert done.returncode == 2
    assert "At d = 8 um: dU = " in done.stdout
    assert "pairsim ask: --to: got '30um'; must be on the same side of the zeros of dU" in done.stderr
    refused = pairsim(*words, "--from", "5ms", "--to", "30um")
    assert "pairsim ask: --from: got '5ms'" in refused.stderr
    assert not refused.stdout


@pytest.mark.slow
def test_a_curve_is_computed_where_it_is_asked_for(atlas: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    options = "--tube 50um --particle 8um --flow 1ul/min --viscosity 1Pa.s --modulus 10kPa --at 8um --compute -o curve"
    coarse = ["--set", "mesh.Np=8", "--set", "tol=0.2"]
    done = pairsim("ask", *options.split(), *coarse, "--atlas", str(atlas))
    computed = api.open(tmp_path / "curve")
    assert computed.answer in done.stdout
    assert "At d = 8 um: dU = " in done.stdout
    assert computed.findings()[0] not in done.stderr  # the answer is given once
    assert (tmp_path / "curve" / "curve.png").exists()


def test_a_computation_that_finds_nothing_ends_as_that_of_a_curve_does(
    tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    failed = api.curve({"beta": 0.2, "De": 0, "Ca_e": 0, "d": [0.1, 0.2]}, folder=tmp_path / "curve", budget="1ms")
    assert (failed.status, failed.reason) == ("failed", "budget")
    monkeypatch.setattr(api, "ask", lambda *_, **__: failed)
    done = pairsim("ask", "case.yaml", "--compute", "--at", "0.1")
    assert done.returncode == 3
    assert failed.answer in done.stdout
    assert done.stdout.startswith("Failed: ")


def test_beads_that_differ_are_refused(atlas: Path, pairsim: Pairsim) -> None:
    options = [part for name, value in BENCH.items() for part in (f"--{name.replace('flow_rate', 'flow')}", value)]
    done = pairsim("ask", "--atlas", str(atlas), *options, "--particle", "21um")
    assert done.returncode == 2
    assert "the beads differ" in done.stderr
