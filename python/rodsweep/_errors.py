"""What can go wrong."""

from __future__ import annotations

import errno
import warnings
from collections.abc import Mapping
from typing import Any


class RodsweepError(Exception):
    """Every error of this package is one."""


class InputError(RodsweepError, ValueError):
    """A file, a name, a value or an argument that makes no sense.

    Attributes
    ----------
    key : str or None
        What is wrong, such as ``segment[1].length``, ``coil.current.x`` or ``tolerance``.
    file : str or None
        The file that it stands in, where it came from a file.
    line : int or None
        The line of that file, from 1.
    """

    def __init__(self, message: str, key: str | None = None, file: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.key = key
        self.file = file
        self.line = line

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str | None, str | None, int | None]]:
        return type(self), (str(self), self.key, self.file, self.line)


class EngineError(RodsweepError, RuntimeError):
    """An engine that cannot be used here, or that failed."""


class ResultsError(RodsweepError, RuntimeError):
    """A file or a result directory that cannot be read or written, or that holds something else."""


class MissingFileError(InputError, ResultsError, FileNotFoundError):
    """A file or a result directory that is not there: an `InputError`, a `ResultsError` and a `FileNotFoundError`."""

    def __init__(self, message: str, key: str | None = None, file: str | None = None, line: int | None = None) -> None:
        super().__init__(message, key, file, line)
        self.errno = errno.ENOENT
        self.filename = file

    def __str__(self) -> str:
        return str(self.args[0])


class UnitWarning(UserWarning):
    """A bare number that is out of proportion to the scene, as one in another unit would be."""


class DistrustedRun(RodsweepError, RuntimeError):
    """Rows that are not to be trusted. The text says which inputs, what is wrong, what helps and how to see it.

    Attributes
    ----------
    run : Run, Results, Solution, Workspace, Sensitivity, Control or Fit
        What was solved or opened all the same.
    verdict : dict
        What speaks against it, as in ``manifest.json``.
    """

    def __init__(self, message: str, run: Any = None, verdict: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.run = run
        self.verdict = dict(verdict or {})

    def __reduce__(self) -> tuple[type[DistrustedRun], tuple[str, Any, dict[str, Any]]]:
        return type(self), (str(self), self.run, self.verdict)


class DistrustedWarning(UserWarning):
    """Rows that are not to be trusted, where ``allow_distrusted=True`` goes on."""


def judge(run: Any, text: str | None, verdict: Mapping[str, Any] | None, allow_distrusted: bool) -> None:
    """Raises, or warns, where something speaks against what was solved."""
    if not text:
        return
    if not allow_distrusted:
        raise DistrustedRun(f"{text.rstrip()}\n`allow_distrusted=True` goes on all the same.", run, verdict)
    warnings.warn(text.rstrip(), DistrustedWarning, stacklevel=3)
