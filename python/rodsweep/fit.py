"""Numbers of a scene from observed shapes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _rodsweep
from ._errors import InputError, judge
from ._rodsweep import NativeFit
from ._told import Told
from ._units import doubt_length, number
from ._values import Columns, Floats, floats, names_of
from .scene import Scene, check_scene
from .solve import _count


def fit(
    scene: Scene,
    positions: Any = None,
    arc_length: Any = None,
    values: Mapping[str, Any] | None = None,
    *,
    normal_forces: Any = None,
    free: str | Sequence[str] | None = None,
    noise: float | str | None = None,
    force_noise: float | str | None = None,
    threads: int | None = None,
    allow_distrusted: bool = False,
) -> Fit:
    """Fits numbers of a scene to observed points, as ``rodsweep fit``.

    Parameters
    ----------
    scene : Scene
        Where the fit starts.
    positions : array_like, shape (m, p, 3) or (m, 3), optional
        Points of m shapes in the world (m), or a quantity of pint or astropy, as everywhere below; of shape (m, 3) one
        point each. A point that is NaN was not seen. Needed unless forces were measured.
    arc_length : array_like, shape (p,) or (m, p), optional
        Of the points, from the base (m); NaN means the tip. Without it every point is the tip.
    values : dict, optional
        What is known to differ from one shape to the next: names to numbers or arrays of shape (m,).
    normal_forces : array_like, shape (m,) or (m, q), optional
        Measured forces of the scene's wall on the tip, along the wall's normal (N); NaN was not measured.
    free : str or sequence of str, optional
        What is fitted; names joined by ``+`` keep their ratio. By default rest curvature about x and y.
    noise : float, optional
        Standard deviation of a coordinate (m); else it is estimated.
    force_noise : float, optional
        Standard deviation of a measured force (N); else a force counts by how far it pushes the rod aside.
    allow_distrusted : bool
        Whether to warn, and not to raise, where the reference contradicts a fitted rod.

    Raises
    ------
    DistrustedRun
        The reference contradicts a fitted rod; the fit is in ``error.run``.

    Examples
    --------
    >>> scene = Scene.from_dict({
    ...     "segment": [{
    ...         "name": "rod", "kind": "flexible", "length": 0.1,
    ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
    ...     }],
    ... })
    >>> found = fit(scene, [[0, -0.0049, 0.0998]], free="rod.rest_curvature.x")
    >>> found.value.round(2), found.names
    (array([0.98]), ['rod.rest_curvature.x'])
    """
    check_scene(scene)
    forces = np.empty((0, 0)) if normal_forces is None else floats("normal_forces", normal_forces, "N")
    if forces.ndim == 1:
        forces = forces[:, np.newaxis]
    if forces.ndim != 2:
        raise InputError(f"`normal_forces`: has shape {forces.shape}; give (m,) or (m, q)", "normal_forces")
    if positions is None:
        if normal_forces is None:
            raise InputError("`positions`: are missing; give points, or `normal_forces` that were measured", "positions")
        points = np.empty((forces.shape[0], 0, 3))
    else:
        points = floats("positions", positions, "m")
    if points.ndim == 2:
        points = points[:, np.newaxis]
    if points.ndim != 3 or points.shape[2] != 3:
        raise InputError(f"`positions`: has shape {points.shape}; give (m, p, 3) or (m, 3)", "positions")
    count = points.shape[0]
    if normal_forces is not None and forces.shape[0] != count:
        what = f"has shape {forces.shape} for {count} shapes; give ({count},) or ({count}, q)"
        raise InputError(f"`normal_forces`: {what}", "normal_forces")
    measured = [[force for force in row if not _is_nan(force)] for row in forces.tolist()] or [[] for _ in range(count)]
    if arc_length is None:
        at = np.full(points.shape[:2], np.nan)
    else:
        given = floats("arc_length", arc_length, "m")
        try:
            at = np.broadcast_to(given, points.shape[:2])
        except ValueError:
            what = f"has shape {given.shape} for points of shape {points.shape[:2]}"
            raise InputError(f"`arc_length`: {what}", "arc_length") from None
    for key, length, share in (
        ("positions", positions, 100.0),
        ("arc_length", arc_length, 100.0),
        ("noise", noise, 1.0),
    ):
        doubt_length(scene, key, length, share)
    columns = Columns.of(scene, values)
    if columns.shape not in ((), (count,)):
        raise InputError(f"`values`: have shape {columns.shape} for {count} shapes; give ({count},)", "values")
    rows = [np.broadcast_to(column, (count,)) for column in columns.columns]
    known = np.stack(rows, axis=-1).tolist() if rows else [[] for _ in range(count)]
    shapes = [
        [
            [s, *point]
            for s, point in zip(at[row].tolist(), points[row].tolist(), strict=True)
            if not any(map(_is_nan, point))
        ]
        for row in range(count)
    ]
    native = _rodsweep.fit(
        scene._native,
        columns.names,
        known,
        shapes,
        measured,
        None if free is None else names_of("free", free),
        None if noise is None else number("noise", noise, "m"),
        None if force_noise is None else number("force_noise", force_noise, "N"),
        _count("threads", threads),
    )
    found = Fit(native)
    judge(found, found.account["distrusted"], None, allow_distrusted)
    return found


def _is_nan(number: float) -> bool:
    return number != number


class Fit(Told):
    """Fitted numbers with their intervals, and what cannot be told apart."""

    _native: NativeFit

    def __init__(self, native: NativeFit) -> None:
        self._native = native
        self.account: dict[str, Any] = json.loads(native.json())
        """Everything, as the command line's JSON."""

    @property
    def scene(self) -> Scene:
        """The scene with the fitted numbers."""
        return Scene(self._native.scene())

    @property
    def names(self) -> list[str]:
        """What was fitted."""
        return [parameter["name"] for parameter in self.account["parameters"]]

    def _of_each(self, key: str) -> Floats:
        values = [parameter[key] for parameter in self.account["parameters"]]
        return np.array(values, dtype=np.float64)

    @property
    def value(self) -> Floats:
        """Fitted values, SI, shape (k,)."""
        return self._of_each("value")

    @property
    def deviation(self) -> Floats:
        """Standard deviations, SI; NaN where a number cannot be told, shape (k,)."""
        return self._of_each("deviation")

    @property
    def interval(self) -> Floats:
        """Intervals of 95 %, SI, shape (k, 2)."""
        return self._of_each("interval_95")

    @property
    def covariance(self) -> Floats:
        """Of the fitted numbers, shape (k, k)."""
        return np.array(self.account["covariance"], dtype=np.float64)

    @property
    def converged(self) -> bool:
        """Whether the method came to an end."""
        return bool(self.account["converged"])

    @property
    def rms(self) -> float:
        """Root mean square of what is left of a coordinate (m)."""
        return float(self.account["rms"])

    @property
    def positions(self) -> list[Floats]:
        """The fitted points (m), one array of shape (p, 3) a shape."""
        return [np.array(shape, dtype=np.float64).reshape(-1, 3) for shape in self._native.positions()]

    def figure(self, format: str = "png") -> bytes:
        """Observed and fitted points as the bytes of a ``png`` or ``svg``."""
        return self._native.figure(format)

    def __repr__(self) -> str:
        numbers = [f"{p['name']} = {p['value']:.6g} {p['unit']}" for p in self.account["parameters"]]
        return f"<Fit: {', '.join(numbers)}>"
