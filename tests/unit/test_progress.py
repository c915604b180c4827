"""Progress on stderr without a terminal."""

from __future__ import annotations

import pytest

from pairsim.questions import progress


def test_time_left_is_that_at_the_latest_pace(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A tenth in the first 90 s and a tenth in the next 10 s: eight more tenths take 80 s, not 400 s."""
    now = 1000.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    reporter = progress.LineReporter()
    reporter.start("beads", "to t = 2", 2.0)
    for seconds, t in ((90.0, 0.2), (92.0, 0.25), (100.0, 0.4)):
        now = 1000.0 + seconds
        reporter.update(t, f"t = {t:g}", 2)
    assert capsys.readouterr().err.splitlines() == [
        "beads: to t = 2",
        "   10%  t = 0.2  (1 min 30 s, 13 min 30 s left)",
        "   20%  t = 0.4  (1 min 40 s, 1 min 20 s left)",
    ]
