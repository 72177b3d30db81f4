"""What became of a sample, as codes and words."""

from __future__ import annotations

import enum

from . import _rodsweep


class Status(enum.IntEnum):
    """What became of a sample. Arrays of statuses hold these numbers: ``solution.status == Status.FOLD``."""

    OK = 0
    """Solved straight from rest."""
    REFINED = 1
    """Solved by a second attempt."""
    RAMPED = 2
    """Solved in several load steps."""
    FOLD = 3
    """The path from rest ends in a snap before the full load, or before the wall is in its place."""
    UNSTABLE = 4
    """In balance, but not stable."""
    STEP_LIMIT = 5
    """The load could not be raised to the end in as many steps as are allowed."""
    NOT_CONVERGED = 6
    """No equilibrium was found."""
    BAD_PARAMETER = 7
    """The values make no rod: a length below zero, or a value that is not finite."""
    NON_FINITE = 8
    """Numbers overflowed."""
    PENDING = 9
    """Not solved; no result has it."""
    TOO_NEAR_MAGNET = 10
    """A part of the rod comes nearer to a magnet than its clearance."""
    OUTSIDE_MAP = 11
    """A magnetic part of the rod leaves a field that is known on a grid only."""
    DOUBTFUL = 12
    """Two paths from rest end at different equilibria, and the reference has not decided which is right."""
    THROUGH_WALL = 13
    """In balance, but another part of the rod than its tip is in the wall."""
    OUT_OF_REACH = 14
    """The tip is to be held farther from the base than the rod is long; not tried."""

    @property
    def word(self) -> str:
        """The word in files, such as ``step-limit``."""
        return _rodsweep.STATUSES[self]

    @property
    def meaning(self) -> str:
        """What it means, in a sentence."""
        return _MEANINGS[self]

    def __str__(self) -> str:
        return self.word

    def __format__(self, form: str) -> str:
        # `{status:d}` is the code, `{status}` and `{status:>12}` the word.
        return format(int(self) if form[-1:] in ("d", "x", "b", "n") else self.word, form)


_MEANINGS = (
    "Solved straight from rest.",
    "Solved by a second attempt.",
    "Solved in several load steps.",
    "The path from rest ends in a snap before the full load, or before the wall is in its place.",
    "In balance, but not stable.",
    "The load could not be raised to the end in as many steps as are allowed.",
    "No equilibrium was found.",
    "The values make no rod: a length below zero, or a value that is not finite.",
    "Numbers overflowed.",
    "Not solved.",
    "A part of the rod comes nearer to a magnet than its clearance.",
    "A magnetic part of the rod leaves a field that is known on a grid only.",
    "Two paths from rest end at different equilibria, and the reference has not decided which is right.",
    "In balance, but another part of the rod than its tip is in the wall.",
    "The tip is to be held farther from the base than the rod is long; not tried.",
)
