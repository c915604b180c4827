"""Rows and streams of beads that differ: what their studies state of rows of results."""

import numpy as np
import pandas as pd
from book.comparison import PLUS_MINUS
from studies.rows import cases as row_cases
from studies.rows import judgement as of_rows
from studies.streams import judgement as of_streams

import pairsim


def row_of_three(by: str, d: dict[int, tuple[float, ...]], near: dict[int, float], half_width: float) -> pd.DataFrame:
    """Distances of both gaps of a row at t = 1, 2, ..., and when they become near."""
    same = {"material": "soft", "beads": 3, "spread": 2, "by": by, "part": by, "seconds": 9.0, "computed": "2026-11-29"}
    rows = [
        {**same, "gap": gap, "t": t, "d": x, "half_width": half_width, "near": np.nan}
        for gap, values in d.items()
        for t, x in enumerate(values, 1)
    ]
    rows += [{**same, "gap": gap, "t": np.nan, "d": 0.02, "near": t} for gap, t in near.items()]
    return pd.DataFrame(rows)


def test_rows_by_the_model_are_judged_by_the_half_widths_of_both() -> None:
    run = row_of_three("run", {1: (0.1, 0.05), 2: (0.2, 0.3)}, {1: 3.0}, 0.001)
    model = row_of_three("rows of 3", {1: (0.101, 0.052), 2: (0.2, 0.3)}, {1: 3.2, 2: 9.0}, 0.002)
    inside, order = list(of_rows.statements(pd.concat([run, model]), []).values())[:2]
    assert inside.verdict == order.verdict == "holds"
    assert "4 of 4; largest difference over half-widths 0.67" in inside.numbers
    farther = row_of_three("rows of 3", {1: (0.101, 0.054), 2: (0.2, 0.3)}, {2: 1.0, 1: 3.0}, 0.002)
    inside, order = list(of_rows.statements(pd.concat([run, farther]), []).values())[:2]
    assert inside.verdict == order.verdict == "does not hold"
    assert "| soft | 3 | 2 | rows of 3 | 1 | 2, 1 | False |" in of_rows.blocks(pd.concat([run, farther]), [])["order"]


def test_the_same_rows_are_drawn_for_all_materials_and_are_valid_runs() -> None:
    drawn = {(row.beads, row.spread): row.drawn for row in row_cases.ROWS}
    assert len(row_cases.ROWS) == len(drawn) * len(row_cases.MATERIALS)
    for row in row_cases.ROWS:
        assert row.drawn == drawn[row.beads, row.spread]
        assert pairsim.load(row.case("1%"), kind="run").betas == tuple(row.drawn[0])


def stream(case: str, shows: str, single: tuple[float, float], spread: float = 1.0) -> pd.DataFrame:
    """A case at the inlet and at the outlet, whose drops get one bead in so many cases there."""
    same = {"shows": shows, "case": case, "part": case, "d": 0.8, "poisson": 0.3, "computed": "2026-11-29"}
    of = [{"position": z, "single": share, "d_spread": spread} for z, share in zip((0.0, 100.0), single, strict=True)]
    width = {f"{name}_{kind}": 0.01 for name in ("single", "d_spread", "in_contact") for kind in ("error", "model")}
    return pd.DataFrame([{**same, **each, "in_contact": 0.1, **width} for each in of])


def test_streams_are_judged_at_the_outlet() -> None:
    table = pd.concat(
        [
            stream("rigid, Newtonian", "exact", (0.3, 0.31)),
            stream("De 1, equal", "drops", (0.3, 0.45)),
            stream("2 % of size", "order", (np.nan, np.nan), 0.6),
            stream("2 % of stiffness", "order", (np.nan, np.nan), 0.2),
        ]
    )
    verdicts = [each.verdict for each in of_streams.statements(table, []).values()]
    assert verdicts[:4] == ["holds", "holds", "holds", "does not hold"]
    line = "| De 1, equal | 100 | 100 | 100.0 ± 1.4 | 10.0 ± 1.4 | 30 | 45.0 ± 1.4 | 30 |"
    assert line.replace(" ± ", PLUS_MINUS) in of_streams.blocks(table, [])["drops"]
    other = of_streams.statements(stream("rigid, Newtonian", "exact", (0.3, 0.35)), [])
    assert next(iter(other.values())).verdict == "does not hold"


def test_pairs_are_judged_by_the_power_of_their_size() -> None:
    def pairs_with(power: float) -> pd.DataFrame:
        same = {"shows": "pair", "computed": "2026-11-29", "d_spread": np.nan, "dU_error": 1e-6}
        rows = [
            {**same, "part": f"pair: beta {beta:g}", "case": f"beta {beta:g}", "beta": beta, "d": d, "dU": beta**power}
            for beta in (0.2, 0.4)
            for d in (0.4, 0.8)
        ]
        return pd.DataFrame(rows)

    for power, verdict in ((4.2, "holds"), (5.0, "does not hold")):
        assert next(each.verdict for each in of_streams.statements(pairs_with(power), []).values()) == verdict
    line = "| 0.4 | 100.00 ± 0.06 | 100.000 ± 0.004 |".replace(" ± ", PLUS_MINUS)
    assert line in of_streams.blocks(pairs_with(4.0), [])["pairs"]
