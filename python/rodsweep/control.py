"""Currents for a trajectory, or for many targets at once."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _rodsweep
from ._errors import InputError, judge
from ._progress import Listener, Shown
from ._rodsweep import NativeControl, Table
from ._told import Told
from ._units import doubt, doubt_length, is_bare, number
from ._values import Floats, forces_of, names_of
from .scene import Scene, _quantity, check_scene
from .solve import _count
from .studies import points


def control(
    scene: Scene,
    positions: Any,
    tangents: Any = None,
    *,
    normal_forces: Any = None,
    inputs: Mapping[str, Any] | None = None,
    in_order: bool = True,
    closed: bool = False,
    coordinates: str | Sequence[str] | None = None,
    tolerance: float | str | None = None,
    tangent_weight: float | str | None = None,
    redundancy: str | None = None,
    engine: str = "auto",
    precision: str | None = None,
    threads: int | None = None,
    name: str = "targets",
    allow_distrusted: bool = False,
    progress: Listener = None,
) -> Control:
    """Finds what to command so that the tip goes where it should, as ``rodsweep control``.

    Parameters
    ----------
    scene : Scene
        The rod.
    positions : array_like, shape (n, 3)
        Where the tip should be (m).
    tangents : array_like, shape (n, 3), optional
        Directions of the tip; of any length.
    normal_forces : array_like, shape (n,), or one for all, optional
        How hard the tip should press on the wall of the scene, along the wall's normal (N).
    inputs : dict, optional
        What is commanded: names to a limit of either sign, or to ``(low, high)``; SI numbers or texts with units. By
        default every current, within ±0.3 A. Quantities of pint and astropy stand here and below, too.
    in_order : bool
        Whether each target is reached from where the last one ended. Else all are reached at once, each from rest.
    closed : bool
        Whether the way goes on from the last target to the first; for the figures.
    coordinates : str or sequence of str, optional
        Which of x, y, z and normal_force are controlled; by default those that are given.
    tolerance : float, optional
        A target is reached where so much is left (m).
    tangent_weight : float, optional
        Length by which a tangent's error counts (m).
    progress : callable or True, optional
        Called with a text for each target that has ended. True shows a bar (tqdm), or plain lines without that package.
    redundancy : {"least-change", "least-current"}, optional
        What becomes of inputs that the tip does not need.
    allow_distrusted : bool
        Whether to warn, and not to raise :class:`DistrustedRun`, where the reference contradicts a result that was
        checked.

    Examples
    --------
    >>> scene = Scene.from_dict({
    ...     "segment": [{
    ...         "name": "rod", "kind": "flexible", "length": 0.1,
    ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
    ...     }],
    ... })
    >>> found = control(scene, [[0, 0.01, 0.099]], inputs={"loads.tip_force": "2 mN"}, coordinates="y")
    >>> found.outcome.tolist(), found.inputs
    (['reached'], ['loads.tip_force.x', 'loads.tip_force.y', 'loads.tip_force.z'])
    """
    check_scene(scene)
    if inputs is not None and not isinstance(inputs, Mapping):
        raise InputError(f"`inputs`: is of type {type(inputs).__name__}; give a dictionary", "inputs")
    options = {
        "engine": engine,
        "precision": precision,
        "threads": _count("threads", threads),
        "inputs": [f"{input}={_limits(input, limits)}" for input, limits in (inputs or {}).items()],
        "coordinates": None if coordinates is None else names_of("coordinates", coordinates),
        "tolerance": None if tolerance is None else number("tolerance", tolerance, "m"),
        "tangent_weight": None if tangent_weight is None else number("tangent_weight", tangent_weight, "m"),
        "redundancy": redundancy,
        "in_order": bool(in_order),
        "closed": bool(closed),
        "name": name,
    }
    for key, length, share in (("positions", positions, 100.0), ("tolerance", tolerance, 1.0)):
        doubt_length(scene, key, length, share)
    for input, limits in (inputs or {}).items():
        if isinstance(input, str) and is_bare(limits):
            doubt(scene, input, limits)
    directions = None if tangents is None else points("tangents", tangents, "")
    targets = points("positions", positions)
    forces = None if normal_forces is None else forces_of("normal_forces", normal_forces, (len(targets),)).tolist()
    with Shown(progress, len(targets), "targets") as listener:
        found = Control(_rodsweep.control(scene._native, targets, directions, forces, options, listener))
    judge(found, found.account["distrusted"], None, allow_distrusted)
    return found


def _limits(name: str, limits: Any) -> str:
    if isinstance(limits, (tuple, list)):
        if len(limits) != 2:
            raise InputError(f"`{name}`: is {limits!r}; give a limit, or (low, high)", name)
        return f"{_quantity(name, limits[0])}..{_quantity(name, limits[1])}"
    return _quantity(name, limits)


class Control(Told):
    """Inputs for targets, and what the tip does with them."""

    _native: NativeControl

    def __init__(self, native: NativeControl) -> None:
        self._native = native
        self._table = native.table()

    @property
    def table(self) -> Table:
        """One row a target, as the command line writes it."""
        return self._table

    @property
    def inputs(self) -> list[str]:
        """Names of the m inputs."""
        return self._native.inputs()

    @property
    def values(self) -> Floats:
        """Values of the inputs, SI, shape (n, m)."""
        return np.array(self._native.values(), dtype=np.float64).reshape(len(self._table), len(self.inputs))

    @property
    def tip_position(self) -> Floats:
        """Where the tip is (m), shape (n, 3)."""
        return np.stack([self._table[f"tip.position.{axis}"] for axis in "xyz"], axis=-1)

    @property
    def normal_force(self) -> Floats:
        """Force of the wall on the tip along its normal (N), shape (n,); NaN without a wall."""
        if "contact.normal_force" not in self._table.columns:
            return np.full(len(self._table), np.nan)
        return self._table["contact.normal_force"]

    @property
    def outcome(self) -> NDArray[np.str_]:
        """``reached``, ``at-limit`` and others, shape (n,)."""
        return np.asarray(self._table["status"])

    @property
    def missed(self) -> int:
        """Targets that are not reached."""
        return self._native.missed()

    @property
    def account(self) -> dict[str, Any]:
        """A summary, as the command line's JSON."""
        return dict(json.loads(self._native.json()))

    def write(self, path: str | PathLike[str]) -> None:
        """Writes the table as ``.csv`` or ``.parquet``."""
        self._native.write(fspath(path))

    def draw(self, folder: str | PathLike[str]) -> list[Path]:
        """Draws the figures of ``rodsweep control``; returns the files."""
        return [Path(file) for file in self._native.draw(fspath(folder))]

    def to_pandas(self) -> Any:
        """The table as a data frame of pandas; see :meth:`Table.to_pandas`."""
        return self._table.to_pandas()

    def __len__(self) -> int:
        return len(self._table)

    def __repr__(self) -> str:
        return f"<Control: {len(self)} targets, {self.missed} missed, by {', '.join(self.inputs)}>"
