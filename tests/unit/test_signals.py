"""SIGINT and SIGTERM as flags: what the first one, further ones and contexts within each other do."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import pytest
from support.scenes import soft_pair

import pairsim as package
from pairsim.cli import app as cli
from pairsim.fem import form_cache
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.runtime.child_process import descendants
from pairsim.runtime.signals import Signals, Stopped, no_interrupt_lost, received
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.transient.transient import Transient


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """The handlers of pytest come back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_further_sigterms_are_ignored() -> None:
    with Signals(impatient=True) as signals:
        for _ in range(3):
            signal.raise_signal(signal.SIGTERM)
        assert signals.number == signal.SIGTERM


def test_second_interrupt_is_impatient() -> None:
    with Signals(impatient=True) as signals:
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGINT)
        assert signals.number == signal.SIGINT
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_contexts_hand_a_signal_to_each_other() -> None:
    """Inwards, if it came before the inner one, and outwards, if that has ended."""
    with Signals() as outer:
        signal.raise_signal(signal.SIGTERM)
        with Signals() as inner:
            assert inner.number == received() == signal.SIGTERM
    with Signals() as outer:
        with Signals():
            signal.raise_signal(signal.SIGTERM)
        assert outer.number == signal.SIGTERM
    assert received() == 0


class Interrupted:
    """Its destructor is interrupted."""

    def __del__(self) -> None:
        raise KeyboardInterrupt


def interrupted_sleep(**_: object) -> None:
    """Sleep after an interrupt that Python ignores."""
    Interrupted()
    time.sleep(30)


@pytest.mark.parametrize("context", [no_interrupt_lost, lambda: Signals(installed=False)])
def test_interrupt_within_a_destructor_comes_again(context: Callable[[], AbstractContextManager[object]]) -> None:
    """Python ignores exceptions of destructors; that would be the end of the Ctrl-C."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    hook, begin = sys.unraisablehook, time.monotonic()
    with pytest.raises(KeyboardInterrupt), context():
        interrupted_sleep()
    assert time.monotonic() - begin < 10
    assert sys.unraisablehook == hook


def test_interrupt_within_a_destructor_is_a_signal_where_there_is_a_handler() -> None:
    with Signals() as signals:
        Interrupted()
        time.sleep(1)
        assert signals.number == received() == signal.SIGINT


def test_command_ends_though_a_destructor_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before it listens to signals, too, as while it imports libraries."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(cli, "app", interrupted_sleep)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130


def test_run_ends_though_a_destructor_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen once: the run went on."""
    solve, pressed = Newton.solve, iter([Interrupted])

    def interrupted(*words: Any) -> Any:
        for press in pressed:
            press()
        return solve(*words)

    signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(Newton, "solve", interrupted)
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "length": 3, "ends": "developed", "mesh": {"Np": 8}}
    result = package.run(case, time={"end": 20.0}, output={"fields": False})
    assert (result.status, result.reason) == ("interrupted", "interrupted")


@pytest.mark.parametrize("number", [0, signal.SIGTERM])
def test_process_that_ends_after_a_signal_ignores_sigterm(number: int) -> None:
    with Signals(final=True):
        before = signal.getsignal(signal.SIGTERM)
        if number:
            signal.raise_signal(number)
    after = signal.getsignal(signal.SIGTERM)
    assert (after == signal.SIG_IGN) == bool(number)
    assert after != before


def test_newtons_method_stops_before_the_next_factorisation() -> None:
    transient = Transient(soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=6), length=2.0))
    newton = transient.newton
    arguments = (np.zeros(transient.constraints.size), transient.history.h[0], 0.01, 1.7)
    with Signals():
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Stopped, match="SIGTERM"):
            newton.solve(*arguments)
        assert newton.matrix_state is None, "no matrix was factorised"
    assert newton.solve(*arguments)[1].factorisations > 0
    transient.close()


def test_compilation_ends_within_a_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    sleep = [sys.executable, "-c", "import time; time.sleep(60)"]
    monkeypatch.setattr(form_cache, "missing", lambda forms: list(forms))
    monkeypatch.setattr(form_cache, "module_command", lambda *words: sleep)
    begin = time.monotonic()
    with Signals():
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM)).start()
        form_cache.compile_apart(["newtonian:fixed"], print)
    assert time.monotonic() - begin < 30
    assert len(descendants(os.getpid())) == 1, "the compilation has ended"


def test_signal_after_the_last_file_changes_nothing() -> None:
    """Python resets handlers when it ends, and libraries need a while for their own end."""
    program = (
        "import atexit, os, signal, sys, time\n"
        "from pairsim.runtime.signals import Signals\n"
        "atexit.register(lambda: (os.kill(os.getpid(), 15), time.sleep(0.05)))\n"
        "with Signals(final=True):\n"
        "    os.kill(os.getpid(), 15)\n"
        "sys.exit(130)\n"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 130
