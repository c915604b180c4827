"""Grid files: expansion into cases, input errors, and the identity of cases."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
import yaml
from support.inputs import ROOT, examples

import pairsim
from pairsim.cases.identity import identity_of, key_of
from pairsim.cases.values import Range, spelled_out
from pairsim.computing.case_files import parse_case
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import Grid, read_grid

BASE = "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, mesh: {Np: 10}}\n"


def grid_of(tmp_path: Path, text: str, *settings: str) -> Grid:
    (tmp_path / "grid.yaml").write_text(BASE + text)
    return read_grid(tmp_path / "grid.yaml", settings)


def column(grid: Grid, key: str) -> list[object]:
    return [case.case.resolved()[key] for case in grid.cases]


def test_grid_is_a_product_in_the_order_of_the_file(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, "grid: {Ca_e: [0, 0.1], d0: [0.3, 0.2]}\n")
    assert [(c.parameters["Ca_e"], c.parameters["d0"]) for c in grid.cases] == [
        (0, 0.3),
        (0, 0.2),
        (0.1, 0.3),
        (0.1, 0.2),
    ]
    assert grid.varying == ("Ca_e", "d0")


def test_zip_advances_its_keys_together(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, "zip: {De: [0, 1], d0: [0.3, 0.2]}\ngrid: {Ca_e: [0, 0.1]}\n")
    assert list(zip(column(grid, "Ca_e"), column(grid, "De"), column(grid, "d0"), strict=True)) == [
        (0, 0, 0.3), (0, 1, 0.2), (0.1, 0, 0.3), (0.1, 1, 0.2),
    ]  # fmt: skip


def test_ranges_have_round_values_and_exact_ends() -> None:
    assert spelled_out(Range(start=0, stop=0.3, num=4, spacing="linear")) == [0, 0.1, 0.2, 0.3]
    assert spelled_out(Range(start=0.01, stop=1, num=3)) == [0.01, 0.1, 1]
    assert spelled_out(Range(start=0.05, stop=0.7, num=5))[-1] == 0.7


def test_dotted_and_nested_keys_are_the_same(tmp_path: Path) -> None:
    dotted = grid_of(tmp_path, "grid: {mesh.Np: [12, 14]}\n")
    nested = grid_of(tmp_path, "cases: [{mesh: {Np: 12}}, {mesh: {Np: 14}}]\n")
    assert dotted.varying == nested.varying == ("mesh.Np",)
    assert dotted.key == nested.key


def test_a_range_takes_nothing_over_from_the_base(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(
        "command: curve\nbase: {beta: 0.4, De: 0, Ca_e: 0.1, d: {start: 0.1, stop: 0.5, num: 3, spacing: linear}}\n"
        "cases: [{Ca_e: 0.2}, {d: {start: 0.01, stop: 1, num: 3}}, {mesh: {Np: 10}, mesh.growth: 0.2}]\n"
    )
    grid = read_grid(tmp_path / "grid.yaml")
    assert [list(case.case.resolved()["d"]) for case in grid.cases[:2]] == [[0.1, 0.3, 0.5], [0.01, 0.1, 1]]
    assert grid.cases[2].case.resolved()["mesh"].items() >= {"Np": 10, "growth": 0.2}.items(), "groups are merged"


def test_groups_of_every_question_are_merged(tmp_path: Path) -> None:
    base = "beta: 0.4, De: 1, Ca_e: 0, d: 0.1, row: {beads: 8, seed: 3}"
    (tmp_path / "grid.yaml").write_text(f"command: train\nbase: {{{base}}}\ncases: [{{row: {{seed: 4}}}}]\n")
    (case,) = read_grid(tmp_path / "grid.yaml").cases
    assert case.case.resolved()["row"].items() >= {"beads": 8, "seed": 4}.items()
    case = parse_case(QUESTIONS["train"], yaml.safe_load(f"{{{base}}}"), "case")
    assert pairsim.load(case, row={"seed": 4}).resolved()["row"].items() >= {"beads": 8, "seed": 4}.items()


def test_quantities_of_every_question_take_their_numbers_along(tmp_path: Path) -> None:
    block = "{particle: 20 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min, modulus: 5 kPa, spacing: 30 um}"
    (tmp_path / "grid.yaml").write_text(
        f"command: train\nbase: {{physical: {block}}}\ngrid: {{physical.tube: [50 um, 60 um]}}\n"
    )
    grid = read_grid(tmp_path / "grid.yaml")
    assert grid.varying == ("physical.tube", "beta", "Ca_e", "train.spacing")
    assert [case.parameters["train.spacing"] for case in grid.cases] == [0.6, 0.5]


def test_an_item_that_is_a_list_is_one_value_for_the_particles(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, "grid: {Ca_e: [0.1, [0.1, 0]]}\n")
    assert column(grid, "Ca_e") == [0.1, [0.1, 0]]


def test_the_same_case_twice_is_computed_once(tmp_path: Path) -> None:
    text = "grid: {d0: [0.1, 0.2, 0.1]}\ncases: [{d0: 2e-1}, {Ca_e: [0.1, 0.1]}, {xi: 0.5}, {name: other}, {d0: 0.3}]\n"
    grid = grid_of(tmp_path, text)
    assert column(grid, "d0") == [0.1, 0.2, 0.3]
    assert grid.duplicates == 5
    assert len(grid_of(tmp_path, "grid: {Ca_e: [0, -0.0]}\n").cases) == 1


def test_outputs_and_limits_make_another_case(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, "cases: [{}, {output.fields: false}, {limits.max_steps: 7}, {time.end: 1}]\n")
    assert len({case.key for case in grid.cases}) == 4


def test_exclusions_are_values_or_bounds_and_spare_explicit_cases(tmp_path: Path) -> None:
    text = "grid: {Ca_e: [0, 0.1], d0: [0.1, 0.2, 0.3]}\ncases: [{Ca_e: 0, d0: 0.3}]\n"
    grid = grid_of(tmp_path, text + "exclude: [{Ca_e: 0, d0: {min: 0.2}}]\n")
    assert (len(grid.cases), grid.excluded) == (5, 2)
    assert [grid.cases[-1].parameters[key] for key in grid.varying] == [0, 0.3]


def test_settings_change_every_case(tmp_path: Path) -> None:
    text = "grid: {d0: [0.1, 0.2], mesh.Np: [10, 12]}\n"
    grid = grid_of(tmp_path, text, "mesh.Np=20")
    assert [case.case.resolved()["mesh"]["Np"] for case in grid.cases] == [20, 20]
    assert grid.duplicates == 2
    assert grid.key != grid_of(tmp_path, text).key


def test_base_may_be_a_path_and_incomplete(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0\n")
    (tmp_path / "grid.yaml").write_text("base: base.yaml\ngrid: {d0: [0.1, 0.2]}\n")
    assert column(read_grid(tmp_path / "grid.yaml"), "d0") == [0.1, 0.2]


def test_cases_may_be_files_which_give_their_names_and_override_the_base(tmp_path: Path) -> None:
    (tmp_path / "hard.yaml").write_text("De: 5\nd0: 0.3\n")
    grid = grid_of(tmp_path, "cases: [hard.yaml, {De: 1}]\n")
    assert (column(grid, "De"), column(grid, "d0"), column(grid, "Ca_e")) == ([5, 1], [0.3, 0.1], [0.1, 0.1])
    assert grid.cases[0].folder.startswith("hard-")
    with pytest.raises(InputError, match=r"cases.0.: got 'missing\.yaml'; no such file"):
        grid_of(tmp_path, "cases: [missing.yaml]\n")


def test_comments_and_order_do_not_make_another_grid(tmp_path: Path) -> None:
    first = grid_of(tmp_path, "grid: {Ca_e: [0, 0.1], d0: [0.1, 0.2]}\n")
    second = grid_of(tmp_path, "# the same\ngrid: {d0: [0.2, 0.1], Ca_e: [0.1, 0]}\n")
    assert first.key == second.key
    assert first.key != grid_of(tmp_path, "grid: {Ca_e: [0, 0.1], d0: [0.1, 0.3]}\n").key


def test_folders_are_slug_and_hash(tmp_path: Path) -> None:
    (case,) = grid_of(tmp_path, "cases: [{}]\n").cases
    assert case.folder == f"beta0.4-De0-Cae0.1-d0.1-{case.key[:10]}"


@pytest.mark.parametrize(
    "changes",
    [
        "{}",
        "{De: 1}",
        "{De: 1, liquid: {law: fene-p, L2: 50}, solid: {law: kelvin-voigt, eta: 1}}",
        "{De: 1, liquid: {law: modes, modes: ["
        "{law: giesekus, time: 1, weight: 2}, {law: oldroyd-b, time: 0.1, weight: 1}]}}",
        "{ends: developed, length: auto}",
    ],
)
def test_a_resolved_case_is_the_same(changes: str, tmp_path: Path) -> None:
    """case.yaml in the folder of a case is a file of the same case, and so is what is sent to a child process."""
    (case,) = grid_of(tmp_path, f"cases: [{changes}]\n").cases
    for again in (parse_case(QUESTIONS["run"], case.case.resolved(), "again"), pickle.loads(pickle.dumps(case.case))):
        assert key_of("run", identity_of(again)) == case.key
        assert again.resolved() == case.case.resolved()


def test_estimated_unknowns_are_near_the_true_ones(tmp_path: Path) -> None:
    """Against counts of actual runs (default tube, N_p 20 and 40; developed ends at De 1)."""
    grid = grid_of(
        tmp_path,
        "cases: [{mesh.Np: 20}, {mesh.Np: 40}, {mesh.Np: 20, mesh.max_size: 0.1, mesh.rows: 0, De: 1, ends: developed, "
        "length: 5}]\n",
    )
    for case, true in zip(grid.cases, (6404, 15240, 16781), strict=True):
        assert grid.question.estimate(case.case).unknowns == pytest.approx(true, rel=0.25)


def test_shipped_grids_have_their_cases() -> None:
    assert len(read_grid(ROOT / "configs" / "sweep.yaml").cases) == 24
    assert len(read_grid(ROOT / "configs" / "thinning" / "sweep.yaml").cases) == 7


def test_examples_of_the_docs_are_grids(tmp_path: Path) -> None:
    (text,) = examples("how-to/sweep.md")
    (tmp_path / "other.yaml").write_text("{beta: 0.3, De: 0, Ca_e: 0, d0: 0.5}")
    (tmp_path / "grid.yaml").write_text(text)
    assert len(read_grid(tmp_path / "grid.yaml").cases) == 2 * 6 * 2 - 2 + 2


def test_a_range_of_whole_numbers_varies_a_key_that_takes_no_others(tmp_path: Path) -> None:
    base = "command: stream\nbase: {De: 0, Ca_e: 0, beta: 0.4, stream: {concentration: 0.01}}\n"
    (tmp_path / "grid.yaml").write_text(base + "grid: {stream.seed: {start: 1, stop: 3, num: 3}}\n")
    assert len(read_grid(tmp_path / "grid.yaml").cases) == 3


EXPERIMENT = "tube: 50um, viscosity: 1Pa.s, flow_rate: 1ul/min, particle: 20um, modulus: 5kPa, distance: 5um"


@pytest.mark.parametrize(
    ("entries", "count"),
    [
        ("grid: {physical.modulus: [5kPa, 5000 Pa, 5e3 Pa, 0.005 MPa, 5.0 kPa]}", 1),
        ("grid: {physical.modulus: {start: 5kPa, stop: 0.01 MPa, num: 3}}\ncases: [{physical.modulus: 7500 Pa}]", 3),
        ("zip: {physical.modulus: [5kPa, 5000 Pa], physical.particle: [20um, 0.02mm]}", 1),
        ("grid: {physical.particle: [20um, 0.02 mm, [20um, 20000nm]]}", 1),
        ("grid: {physical.flow_rate: [1ul/min, 60 ul/h, 1e-3 ml/min, 16.6666666666666666 nl/s]}", 1),
        ("grid: {physical.modulus: [5 +- 1 kPa, 5kPa +- 1000Pa, 5000 Pa +- 20 %]}", 1),
        ("grid: {physical.modulus: [5 kPa, 5 +- 1 kPa, 5 +- 2 kPa]}", 3),
        ("grid: {physical.modulus: [5 kPa, 5.0001 kPa]}", 2),
        ("cases: [{}, {physical.modulus: null, physical.young: 15 kPa}]", 1),
        ("grid: {physical.density: [1000 kg/m^3, 1 g/cm^3, 1.1 g/cm^3]}", 2),
        ("grid: {De: [0]}\ncases: [{mesh.growth: 0.1}, {mesh.growth: 0.1000000000000001}]", 2),
    ],
)
def test_a_quantity_in_another_unit_makes_no_other_case(entries: str, count: int, tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(f"base: {{physical: {{{EXPERIMENT}}}}}\n{entries}\n")
    assert len(read_grid(tmp_path / "grid.yaml").cases) == count


def test_exclusions_match_quantities_in_other_units(tmp_path: Path) -> None:
    text = f"base: {{physical: {{{EXPERIMENT}}}}}\ngrid: {{physical.modulus: [5kPa, 10kPa]}}\n"
    (tmp_path / "grid.yaml").write_text(text + "exclude: [{physical.modulus: 5000 Pa}]\n")
    assert column(read_grid(tmp_path / "grid.yaml"), "Ca_e") == [pytest.approx(0.0169765, rel=1e-5)]
