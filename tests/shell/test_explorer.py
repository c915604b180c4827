"""The explorer in a real browser: its numbers are those of `ask`, also after a slider was moved."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.commands import Pairsim

import pairsim as api
from pairsim.atlas.atlas import Atlas
from pairsim.atlas.explorer import page_of
from pairsim.lab.atlas_curve import curve_of_atlas

BROWSER = shutil.which("chromium") or shutil.which("google-chrome") or ""
PLACE = 20  # a distance of the atlas, at which intervals are those of its table


def shown(page: Path, **given: float) -> str:
    """The page as a browser shows it with these values."""
    address = page.as_uri() + "#" + "&".join(f"{name}={value!r}" for name, value in given.items())
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", address]
    text = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    return text.partition("<script>")[0]


def numbers(text: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r'data-(\w+)="([^"]*)"', text)}


@pytest.mark.slow
@pytest.mark.skipif(not BROWSER, reason="needs a browser: chromium")
def test_the_page_shows_the_numbers_of_ask(atlas: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    done = pairsim("atlas", "explore", "-o", "page.html", "--atlas", str(atlas))
    assert done.returncode == 0, done.stderr
    page, at = tmp_path / "page.html", float(50 * Atlas.load(atlas).d[PLACE])
    experiment = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "10kPa"}
    moved = page.with_name("moved.html")
    move = 'element("modulus-slider").value = 0.5; element("modulus-slider").oninput(); </script>'
    moved.write_text(page.read_text().replace("</script>", move))
    found = numbers(shown(page, modulus=10, relaxation=2, at=at, to=1.5 * at))
    answer = api.ask(**experiment, relaxation="2ms", liquid="giesekus", atlas=atlas)
    value, half_width = answer.curve(at / 50)
    um_s = 1e6 * answer.scales.velocity
    assert found["value"] == pytest.approx(um_s * value, rel=1e-6)
    assert found["half"] == pytest.approx(um_s * half_width, rel=0.02)  # a small difference of large numbers
    assert found["time"] == pytest.approx(answer.scales.time * answer.travel(at / 50, 1.5 * at / 50).time, rel=1e-3)
    assert found["zero"] == pytest.approx(answer.zeros["d"].iloc[0], rel=1e-3)
    slid = numbers(shown(moved, modulus=3, at=at))["value"]
    there = api.ask(**experiment, atlas=atlas)  # the middle of a logarithmic slider from 0.1 to 1000 is 10 kPa
    assert slid == pytest.approx(um_s * there.curve(at / 50)[0], rel=1e-6)


@pytest.mark.slow
@pytest.mark.skipif(not BROWSER, reason="needs a browser: chromium")
def test_the_page_says_what_is_outside(atlas: Path, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(page_of([("Giesekus", Atlas.load(atlas))]))
    text = shown(tmp_path / "page.html", modulus=1, relaxation=30)
    assert "The atlas has no answer: De = 5.09 is not between 0 and 1, and Ca_e = 0.17 is not between 0 and 0.1" in text


@pytest.mark.slow
@pytest.mark.skipif(not BROWSER, reason="needs a browser: chromium")
def test_the_page_takes_the_atlas_of_the_law_and_says_where_another_one_disagrees(atlas: Path, tmp_path: Path) -> None:
    giesekus = Atlas.load(atlas)
    newtonian = replace(giesekus, box={**giesekus.box, "De": (0.0, 0.0)}, widths=5 * giesekus.widths)
    for factor, disagree in ((1.0, False), (1.5, True)):
        scaled = replace(
            newtonian.curves, dU=factor * newtonian.curves.dU, gradients=factor * newtonian.curves.gradients
        )
        atlases = [("Giesekus with alpha = 0.2", giesekus), ("Newtonian", replace(newtonian, curves=scaled))]
        (tmp_path / "page.html").write_text(page_of(atlases))
        still, moving = (shown(tmp_path / "page.html", modulus=10, relaxation=each) for each in (0, 2))
        assert ("Two atlases disagree: at d = " in still) == disagree
        assert "The liquid of the atlas is" not in still
        assert "The liquid of the atlas is Giesekus with alpha = 0.2." in moving
        assert "disagree" not in moving
        table = curve_of_atlas(atlases[1][1], beta=0.4, De=0.0, Ca_e=numbers_of(10.0)).table
        expected = np.interp(np.log(8 / 50), np.log(table["d"]), table["dU_error"])
        assert numbers(still)["half"] == pytest.approx(1e6 * 4 / np.pi * 1e-9 / 60 / (50e-6) ** 2 * expected, rel=0.02)


def numbers_of(modulus: float) -> float:
    """Ca_e of the page with a modulus [kPa], other quantities as it begins with."""
    return 4 / np.pi * 1e-9 / 60 / (50e-6) ** 3 / (1e3 * modulus)
