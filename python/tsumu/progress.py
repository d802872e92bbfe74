"""How a long call is done: who hears of it, on how many threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

from .errors import BadInput
from .frames import needed

#: Called on the caller's own thread with the stage's word, the units done (None: the stage has ended) and all of them
#: (None: not known). An exception it raises stops the work and comes out unchanged.
Progress = Callable[[str, Union[int, None], Union[int, None]], Any]


def threads_of(threads: int | None) -> int | None:
    """Raises `BadInput` for less than one."""
    if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
        raise BadInput(f"threads: is {threads!r}, a whole number from 1 is needed, or None for one a core")
    return threads


@contextmanager
def asked(progress: Progress | bool | None, threads: int | None) -> Iterator[dict[str, Any]]:
    """What the library asks of a call. `progress=True` draws a bar with tqdm, which must be installed."""
    threads = threads_of(threads)
    if progress is not True:
        if progress is not None and progress is not False and not callable(progress):
            raise BadInput("progress: is neither a function of (stage, done, total) nor True")
        yield {"progress": progress or None, "threads": threads}
        return
    bars = Bars()
    try:
        yield {"progress": bars, "threads": threads}
    finally:
        bars.close()


class Bars:
    """One tqdm bar a stage."""

    def __init__(self) -> None:
        self._make: Any = needed("tqdm.auto", "tqdm").tqdm
        self._bar: Any = None
        self._stage = ""

    def __call__(self, stage: str, done: int | None, total: int | None) -> None:
        """Moves the stage's bar."""
        if stage != self._stage or (done == 0 and self._bar is not None and self._bar.total != total):
            self.close()
            self._stage, self._bar = stage, self._make(total=total, desc=stage, leave=False)
        if self._bar is not None and done is not None:
            self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Ends the bar in hand."""
        if self._bar is not None:
            self._bar.close()
        self._bar, self._stage = None, ""
