"""Whatever is typed, a command ends with a result, or with a message and exit code 2: hypothesis makes the inputs.

2,000 inputs in forked processes and 50 real commands at every change; 10,000 inputs with `scripts/test --long`. The
seed is fixed; as hypothesis also takes constants from the modules that are loaded, inputs differ with the code and with
the tests that ran before in the same process.
"""

from __future__ import annotations

import subprocess
from collections import Counter
from collections.abc import Iterator
from itertools import batched
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from support.fuzz import KINDS, Ended, Input, Runner
from support.fuzz_runner import write_files

from pairsim.runtime.child_process import module_command
from pairsim.runtime.text import control_characters

LONGEST_MESSAGE = 30_000  # characters: 20 mistakes, each with what is allowed
BATCH = 25  # inputs that a child runs one after another
FIXED = settings(
    derandomize=True,
    database=None,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


@pytest.fixture(scope="session")
def runner() -> Iterator[Runner]:
    """A process that has imported pairsim, whose children run the inputs."""
    each = Runner()
    yield each
    each.close()


def check(given: Input, ended: Ended) -> None:
    """A command ended with a result, or with a message on what is wrong, and wrote nothing."""
    said = f"{given}\n{ended}"  # as a text it is not shortened
    assert ended.code in (0, 2), said
    assert "Traceback" not in ended.err, said
    assert ended.length <= LONGEST_MESSAGE, said
    assert not any(map(control_characters, ended.err.splitlines())), said
    assert not ended.new or "init" in ended.out, said
    if ended.code == 0:
        assert ended.out, said
    else:
        assert ended.err.startswith(("pairsim: ", "pairsim units: ", "pairsim schema: ", "Usage: ")), said
        assert ended.out == "", said


def inputs(make: st.SearchStrategy[Input], count: int) -> list[Input]:
    """Different inputs made by a strategy."""
    found: dict[str, Input] = {}

    @settings(FIXED, max_examples=2 * count)  # hypothesis repeats itself
    @given(make)
    def each(given: Input) -> None:
        found[repr(given)] = given

    each()
    return list(found.values())[:count]


def fuzz(kind: str, count: int, runner: Runner) -> Counter[int]:
    """Run inputs of a kind; returns how often each exit code came."""
    codes: Counter[int] = Counter()
    for batch in batched(inputs(KINDS[kind][0](), count), BATCH):
        for each, ended in zip(batch, runner(batch), strict=True):
            check(each, ended)
            codes[ended.code] += 1
    return codes


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_input_ends_with_a_traceback(kind: str, runner: Runner) -> None:
    count = KINDS[kind][1]
    codes = fuzz(kind, count, runner)
    assert codes.total() == count
    assert codes[0] > 0
    assert codes[2] > count / 5


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_nor_do_five_times_as_many(kind: str, runner: Runner) -> None:
    count = 5 * KINDS[kind][1]
    codes = fuzz(kind, count, runner)
    print(f"{kind}: {sum(codes.values())} inputs, exit codes {dict(codes)}")
    assert codes.total() == count


@pytest.mark.slow
@pytest.mark.parametrize("part", range(5))
def test_real_commands_end_in_order(part: int, tmp_path: Path) -> None:
    """Ten inputs of each part, of all kinds."""
    of_all_kinds = st.sampled_from(list(KINDS)).flatmap(lambda kind: KINDS[kind][0]())
    for i, each in enumerate(inputs(of_all_kinds, 50)[part::5]):
        place = tmp_path / str(i)
        place.mkdir()
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(place)
            write_files(each.files)
        command = module_command("pairsim", *each.arguments)
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, timeout=60, check=False)
        check(each, Ended(done.returncode, done.stdout, done.stderr, len(done.stderr), []))
