"""What became of a sample, in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ._errors import InputError
from ._rodsweep import Table
from ._status import Status
from .scene import Scene

if TYPE_CHECKING:
    from .sweep import Sweep


def why(sweep: Sweep, table: Table, sample: int) -> str:
    """For a row of a sweep."""
    places = np.flatnonzero(table["sample"] == sample)
    if not places.size:
        raise InputError(f"`sample`: there is no row of sample {sample}", "sample")
    row = int(places[0])
    values = {name: float(table[name][row]) for name in sweep.names if name in table}
    words = [status for status in Status if status.word == table["status"][row]]
    return why_values(sweep.scene, values, words[0])


def why_values(scene: Scene, values: Mapping[str, float], status: Status) -> str:
    """For values of a scene."""
    text = f"{status.word}: {status.meaning}"
    if status != Status.BAD_PARAMETER:
        return text
    broken = [name for name, value in values.items() if not np.isfinite(value)]
    if broken:
        return f"{text} `{broken[0]}` is {values[broken[0]]}."
    try:
        scene._native.assigned([f"{name}={value!r}" for name, value in values.items()])
    except InputError as error:
        return f"{text} {error}."
    return text
