"""Exceptions by whose fault it is, and the warning that goes with a result."""

from __future__ import annotations

import warnings


class TsumuError(Exception):
    """All exceptions of this package."""


class BadInput(TsumuError, ValueError):
    """What was given is wrong; the message names the argument, file, key or line and says what to do."""


class Failed(TsumuError, RuntimeError):
    """The work failed for another reason: disk, rights, no result."""


class TryAgain(Failed):
    """The same call may succeed later: a file that is still being written, a store that did not answer."""


class Stopped(TsumuError):
    """The work was asked to stop."""


class TsumuWarning(UserWarning):
    """Something a user should know of a result that was made all the same."""


def warn(lines: list[str]) -> None:
    """Raises each line as a `TsumuWarning` at the place that called the package."""
    import sys

    # The first caller that is no file of this package.
    depth, frame = 1, sys._getframe(0)
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "tsumu":
        depth, frame = depth + 1, frame.f_back  # type: ignore[assignment]
    for line in lines:
        warnings.warn(line, TsumuWarning, stacklevel=depth)
