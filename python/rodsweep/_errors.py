"""What can go wrong."""

from __future__ import annotations


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
