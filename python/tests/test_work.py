"""Long calls: others may work, Ctrl-C stops, callbacks are heard, exceptions come out."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from typing import Any

import pytest

import tsumu


def test_other_threads_work_meanwhile(site: tsumu.Site) -> None:
    ticks, stop = [0], threading.Event()

    def tick() -> None:
        while not stop.wait(0.002):
            ticks[0] += 1

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        site.segment(threads=1)
    finally:
        stop.set()
        thread.join()
    assert ticks[0] > 20


def test_progress_is_heard_on_the_callers_thread(site: tsumu.Site) -> None:
    heard: list[tuple[str, Any, Any]] = []
    threads = set()

    def progress(stage: str, done: int | None, total: int | None) -> None:
        heard.append((stage, done, total))
        threads.add(threading.get_ident())

    site.recognise(progress=progress)
    assert {"segment", "pose"} <= {stage for stage, _, _ in heard}
    assert threads == {threading.get_ident()}
    for stage in ("segment", "pose"):
        own = [(done, total) for s, done, total in heard if s == stage and done is not None]
        assert own[0][0] == 0 and all(total is None or done <= total for done, total in own)


def test_an_exception_of_the_callback_comes_out_unchanged(site: tsumu.Site) -> None:
    class Mine(Exception):
        pass

    def progress(stage: str, done: int | None, total: int | None) -> None:
        raise Mine(stage)

    with pytest.raises(Mine):
        site.recognise(progress=progress)


def test_a_bar_is_drawn(site: tsumu.Site, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    site.segment(progress=True)
    assert "segment" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
def test_ctrl_c_stops_the_work() -> None:
    code = """
import sys, tsumu
site = tsumu.Site.load(sys.argv[1])
print("at work", flush=True)
try:
    for _ in range(100):
        site.recognise(threads=1)
except KeyboardInterrupt:
    sys.exit(42)
"""
    from conftest import SAMPLE

    child = subprocess.Popen([sys.executable, "-c", code, str(SAMPLE)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "at work\n"
    time.sleep(0.5)
    child.send_signal(signal.SIGINT)
    assert child.wait(timeout=60) == 42


def test_warnings_are_raised_at_the_callers_line() -> None:
    import numpy as np

    grid = np.mgrid[0:20:0.2, 0:20:0.2].reshape(2, -1).T
    flat = np.column_stack([grid, np.zeros(len(grid))])
    with pytest.warns(tsumu.TsumuWarning, match="no block found among 10000 points") as heard:
        tsumu.recognise(flat, tsumu.Catalog.tetrapod(2.0))
    assert heard and all(one.filename == __file__ for one in heard)


def test_kinds_of_exceptions() -> None:
    assert issubclass(tsumu.BadInput, ValueError) and issubclass(tsumu.Failed, RuntimeError)
    for kind in (tsumu.BadInput, tsumu.Failed, tsumu.Stopped):
        assert issubclass(kind, tsumu.TsumuError)
