"""`ask`: answers of an atlas in units, the part of the inputs in them, and where it has none."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.commands import Pairsim

import pairsim as api
from pairsim.atlas.atlas import Atlas
from pairsim.runtime.errors import InputError

BENCH = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "10kPa"}
ELASTIC = {**BENCH, "relaxation": "2ms", "liquid": "giesekus"}


def test_an_answer_is_that_of_the_atlas_in_units(atlas: Path) -> None:
    answer, case = api.ask(**ELASTIC, atlas=atlas), api.units(kind="curve", **ELASTIC).case
    table = Atlas.load(atlas).table(case.betas[0], case.De, case.Ca_es[0])
    at = 20  # an inner point
    assert answer.curve(table["d"][at]) == pytest.approx((table["dU"][at], table["dU_error"][at]), rel=0.01)
    assert answer.dU(f"{50 * table['d'][at]:.12g}um") == pytest.approx(table["dU"][at])
    (zero,) = answer.zeros.itertuples()
    assert abs(answer.dU(zero.d)) < 1e-3 * np.abs(table["dU"]).max()
    assert not zero.stable
    assert answer.findings()[0].startswith("The pair comes closer between d = ")
    assert answer.answer == "\n".join(answer.findings())
    assert answer.travel("15um", "30um").time > 0


def test_the_part_of_the_inputs_is_that_of_first_order_where_they_are_small(atlas: Path) -> None:
    answer = api.ask(**ELASTIC | {"modulus": "10 +- 0.4 kPa", "relaxation": "2 ms +- 2 %"}, atlas=atlas)
    of_modulus, of_time = (each["half_width"] / each["value"] for each in answer.record["inputs"] if each["half_width"])
    table, case = answer.columns, api.units(kind="curve", **ELASTIC).case
    by = [of_modulus * case.Ca_es[0] * table["by_Ca_e"], of_time * case.De * table["by_De"]]
    assert answer.record["dU_inputs"] == pytest.approx(1e6 * answer.scales.velocity * np.hypot(*by), rel=0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"relaxation": "20ms"}, r"De = 3.395 is not in 0 to 1; pairsim curve computes it \(about .* on one core\)"),
        ({"liquid": "oldroyd-b"}, "liquid is another one than in the atlas"),
        ({"solvent": "0.5 Pa.s"}, "liquid is another one"),
        ({"particle": ["20um", "22um"]}, "the beads differ"),
        ({"particle": ["20um", "20um", "20um"]}, "must be 2: the answers are those of pairs"),
        ({"solid": {"law": "mooney-rivlin", "c": 0.5}}, "the beads have another law"),
        ({"length": 20}, "length is another one"),
        ({"tube": "50kPa"}, "must be a length"),
    ],
)
def test_where_the_atlas_has_no_answer_it_says_why(atlas: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        api.ask(**(ELASTIC | change), atlas=atlas)


def test_of_the_atlases_that_ship_the_narrowest_answers(
    atlas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wide = replace(made := Atlas.load(atlas), widths=1000 * made.widths)
    narrow = replace(made, box={**made.box, "De": (0.0, 0.0)})  # as one of Newtonian liquids
    for name, each in (("a", wide), ("b", narrow)):
        each.save(tmp_path / f"{name}.npz")
    monkeypatch.setattr("pairsim.api.ask.SHIPPED", [tmp_path / "a.npz", tmp_path / "b.npz"])
    for given, file in ((ELASTIC, "a.npz"), (BENCH, "b.npz")):
        error = api.ask(**given).columns["dU_error"]
        assert error == pytest.approx(api.ask(**given, atlas=tmp_path / file).columns["dU_error"])
    with pytest.raises(InputError, match=r"De = 3\.395 is not in 0 to 1; pairsim curve"):
        api.ask(**ELASTIC | {"relaxation": "20ms"})
    replace(narrow, box={**narrow.box, "beta": (0.25, 0.5)}).save(tmp_path / "b.npz")
    with pytest.raises(InputError, match=r"beta = 0\.24 is not in 0\.25 to 0\.5; pairsim curve"):
        api.ask(**BENCH | {"particle": "12um"})


def test_the_command_loads_nothing_that_takes_long() -> None:
    words = "ask --tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 5kPa --at 8um"
    command = [sys.executable, "-X", "importtime", "-P", "-m", "pairsim", *words.split()]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    names = {line.rpartition("|")[2].strip().partition(".")[0] for line in loaded.splitlines()}
    assert "numpy" in names
    assert not {"dolfinx", "ufl", "pandas", "pint", "matplotlib"} & names
    assert "scipy.interpolate" not in loaded


def test_a_case_file_is_asked_about_too(atlas: Path, tmp_path: Path) -> None:
    file = tmp_path / "case.yaml"
    file.write_text(api.units(**ELASTIC, distance="8um").case_file("bench"))
    known = pytest.approx(api.ask(**ELASTIC, atlas=atlas).dU("8um"))
    assert api.ask(file, atlas=atlas).dU("8um") == known
    of_curve = {key: value for key, value in ELASTIC.items() if key != "liquid"} | {"distance": ["5um", "8um", "12um"]}
    assert api.ask({"physical": of_curve, "liquid": "giesekus"}, atlas=atlas).dU("8um") == known
    with pytest.raises(InputError, match="must have a pair: this is a case of pairsim train"):
        api.ask({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": 0.3, "row": {"beads": 30}}, atlas=atlas)


def test_the_command_answers_in_words(atlas: Path, pairsim: Pairsim) -> None:
    options = (
        "--tube 50um --particle 20um --flow 1ul/min --viscosity 1Pa.s --modulus 5kPa --at 20um --from 20um --to 30um"
    )
    done = pairsim(
        "ask", *options.split(), "--relaxation", "2 +- 0.4 ms", "--liquid", "giesekus", "--atlas", str(atlas)
    )
    assert done.returncode == 0, done.stderr
    assert "The half-widths of the inputs add +- " in done.stdout
    assert " um/s by the inputs." in done.stdout
    assert " of tube" in done.stdout
    refused = pairsim("ask", "--particle", "20um", "--atlas", str(atlas))
    assert refused.returncode == 2
    assert "--tube: must be given, or a case file" in refused.stderr
    refused = pairsim("ask", "--tube", "50um", "--from", "20um", "--atlas", str(atlas))
    assert "--to: must be given, too, for a travel" in refused.stderr
    refused = pairsim("ask", *options.split(), "--relaxation", "2ms", "--atlas", str(atlas))
    assert "--liquid: must be given with --relaxation" in refused.stderr


def test_what_is_not_known_or_does_not_move_is_not_in_the_answer(atlas: Path) -> None:
    start = next(line for line in api.ask(**BENCH | {"modulus": "1.8kPa"}).findings() if "that starts at" in line)
    assert "dU_held" not in start, "the atlas does not have it"
    rigid = {key: value for key, value in BENCH.items() if key != "modulus"}
    assert api.ask(**rigid, atlas=atlas).findings() == ["The pair keeps its distance: dU vanishes at every d."]


def test_the_command_names_options_and_answers_all_or_nothing(atlas: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    bench = ["ask", "--tube", "50um", "--particle", "20um", "--flow", "1ul/min", "--modulus", "5kPa"]
    refused = pairsim(*bench, "--atlas", str(atlas))
    assert "pairsim ask: --viscosity: is missing" in refused.stderr
    refused = pairsim(*bench, "--viscosity", "1Pa.s", "--at", "8ms", "--atlas", str(atlas))
    assert "--at: got '8ms'" in refused.stderr
    assert not refused.stdout
    (tmp_path / "case.yaml").write_text(api.units(**BENCH).case_file("bench"))
    refused = pairsim("ask", "case.yaml", "--flow", "2ul/min", "--atlas", str(atlas))
    assert "--flow: got '2ul/min'; must be left out" in refused.stderr


@pytest.mark.slow
def test_a_curve_is_computed_where_it_is_asked_for(atlas: Path, tmp_path: Path) -> None:
    small = BENCH | {"particle": "8um", "mesh": {"Np": 8}, "tol": 0.2}
    computed = api.ask(**small, atlas=atlas, compute=True, folder=tmp_path / "curve")
    assert computed.dU("8um") == api.open(tmp_path / "curve").dU("8um")
