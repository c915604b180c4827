"""Whatever a damaged case file holds, a command ends with a result, or with a message and exit code 2."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from support.commands import in_process

CASE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd0: 0.1\nliquid: {law: giesekus, alpha: 0.1}\nmesh:\n  Np: 20\n"
PARTS = ("- 1", "{a: 1", "&a [*a]", "*b", "<<: [1]\n", "!!python/name:os.system", "\t1", "yes", ".nan", "-1", "50 um")


@pytest.mark.slow
def test_a_damaged_file_ends_a_command_in_order(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    codes = set[int]()
    place, part = st.integers(0, len(CASE)), st.sampled_from(PARTS) | st.text(max_size=5)

    @settings(derandomize=True, database=None, deadline=None, phases=[Phase.generate], max_examples=30)
    @given(place, place, part)
    def each(first: int, last: int, part: str) -> None:
        text = CASE[: min(first, last)] + part + CASE[max(first, last) :]
        (tmp_path / "case.yaml").write_bytes(text.encode("utf-8", "surrogateescape"))
        done = in_process(tmp_path, ("run", "case.yaml", "--dry-run"), capfd)
        assert done.returncode in (0, 2), (text, done)
        assert re.match(r"pairsim( \w+)?: ", done.stderr) if done.returncode else done.stdout, (text, done)
        assert "Traceback" not in done.stderr, (text, done)
        codes.add(done.returncode)

    each()
    assert codes == {0, 2}
    assert [path.name for path in tmp_path.iterdir()] == ["case.yaml"]
