"""Pages of HTML as a browser shows them, without a screen."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")


def chromium() -> str:
    """The browser; the test is skipped, with the way to get one, where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("NO CHROMIUM, pages are not looked at: scripts/chromium installs it")
    return found


def _browse(address: str, *options: str) -> str:
    """Load a page without any network, and return what the browser prints."""
    basic = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    command = [chromium(), *basic, "--host-resolver-rules=MAP * ~NOTFOUND", *options, address]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout


def screenshot(page: Path, picture: Path, width: int = 1280, height: int = 1000) -> None:
    """Draw a page from disk, without any network."""
    picture.unlink(missing_ok=True)
    _browse(page.resolve().as_uri(), f"--window-size={width},{height}", f"--screenshot={picture}")
