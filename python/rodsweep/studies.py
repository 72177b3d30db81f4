"""The workspace, the contact map and the sensitivity of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import InputError
from ._progress import Listener, Shown
from ._rodsweep import NativeContactMap, NativeResults, NativeSensitivity, NativeSweep, NativeWorkspace, Table
from ._told import Study
from ._units import doubt_length, number
from ._values import floats, names_of
from .scene import Scene

_WORKSPACE: dict[str, Any] = {
    "engine": "auto",
    "precision": None,
    "threads": None,
    "voxel": None,
    "minimum_margin": None,
    "any_stable": False,
    "fast": False,
    "seed": None,
    "length": None,
    "designs": None,
    "vary": None,
    "convergence": False,
}
_CONTACT: dict[str, Any] = {
    "engine": "auto",
    "precision": None,
    "threads": None,
    "voxel": None,
    "extent": None,
    "force": None,
    "minimum_margin": None,
    "designs": None,
}
_SENSITIVITY: dict[str, Any] = {
    "inputs": (),
    "estimator": "auto",
    "confidence": 0.95,
    "degree": 4,
    "with_unstable": False,
    "propagate": False,
    "choose": None,
    "noise": None,
    "tangent_noise": None,
    "minimum_margin": 0.3,
    "limit": None,
}


def _options(usual: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    for name in given:
        if name not in usual:
            raise InputError(f"`{name}`: is no option; use one of: {', '.join(usual)}", name)
    return {**usual, **given}


def _workspace_options(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    options = _options(_WORKSPACE, given)
    # A voxel as long as the rod measures nothing.
    _lengths(scene, options, {"voxel": 1.0, "length": 100.0})
    return options


def _contact_options(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    options = _options(_CONTACT, given)
    _lengths(scene, options, {"voxel": 1.0, "extent": 10.0})
    if options["force"] is not None:
        options["force"] = number("force", options["force"], "N")
    return options


def _lengths(scene: Scene, options: dict[str, Any], shares: Mapping[str, float]) -> None:
    """Lengths of options in metres; a bare one beyond its share of the rod's length is worth a word."""
    for key, share in shares.items():
        if options[key] is not None:
            doubt_length(scene, key, options[key], share)
            options[key] = number(key, options[key], "m")


def _sensitivity_options(scene: Scene, outputs: str | Sequence[str], given: Mapping[str, Any]) -> dict[str, Any]:
    options = _options(_SENSITIVITY, given)
    _lengths(scene, options, {"noise": 1.0})
    if options["tangent_noise"] is not None:
        options["tangent_noise"] = number("tangent_noise", options["tangent_noise"], "rad")
    options["outputs"] = names_of("outputs", outputs)
    options["inputs"] = names_of("inputs", options["inputs"])
    options["mark"] = options["checked"] = None
    return options


def points(key: str, values: Any, unit: str = "m") -> list[list[float]]:
    """Vectors, one a row; one vector alone is a row."""
    array = np.atleast_2d(floats(key, values, unit))
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"`{key}`: has shape {array.shape}; give an array of shape (n, 3)", key)
    rows: list[list[float]] = array.tolist()
    return rows


class Workspace(Study):
    """What the tip can reach: size with its interval, voxels, answers to queries."""

    _native: NativeWorkspace
    _scene: Scene

    def __init__(self, native: NativeWorkspace) -> None:
        self._native = native

    @classmethod
    def _of_sweep(cls, sweep: NativeSweep, options: dict[str, Any], progress: Listener) -> Workspace:
        with Shown(progress) as listener:
            found = cls(NativeWorkspace.of_sweep(sweep, options, listener))
        found._scene = Scene(sweep.scene())
        return found

    @classmethod
    def _of_results(cls, results: NativeResults, options: dict[str, Any], progress: Listener) -> Workspace:
        with Shown(progress) as listener:
            found = cls(NativeWorkspace.of_results(results, options, listener))
        found._scene = Scene(results.sweep().scene())
        return found

    @property
    def voxels(self) -> Table:
        """One row a voxel: centre (m), whether it is reached, stability margin, dexterity, compliance and more."""
        return self._native.voxels()

    @property
    def surface(self) -> Table | None:
        """One row a voxel of the middle surface, where the workspace is thin."""
        return self._native.surface()

    @property
    def designs(self) -> Table | None:
        """One row a design, where ``designs`` or ``vary`` was asked for."""
        return self._native.designs()

    @property
    def is_doubtful(self) -> bool:
        """Whether the two independent values differ, or many voxels are undecided."""
        return self._native.is_doubtful()

    def reach(self, positions: Any, tangents: Any = None, *, prefer: str = "margin") -> Table:
        """Can the tip be there? One row a position (n, 3), with the inputs that bring it there.

        ``positions`` are in metres, or a quantity of pint or astropy. ``tangents`` (n, 3) asks for a direction, too.
        ``prefer`` chooses among several solutions: ``margin``, ``reserve`` or ``least-current``.
        """
        directions = None if tangents is None else points("tangents", tangents, "")
        doubt_length(self._scene, "positions", positions)
        return self._native.reach(points("positions", positions), directions, prefer)

    def __repr__(self) -> str:
        return f"<Workspace: {self._native.text().splitlines()[1].strip()}>"


class ContactMap(Study):
    """Which force the tip can press where on the wall, held by friction, within the limits of the inputs."""

    _native: NativeContactMap

    def __init__(self, native: NativeContactMap) -> None:
        self._native = native

    @classmethod
    def _of_sweep(cls, sweep: NativeSweep, options: dict[str, Any], progress: Listener) -> ContactMap:
        with Shown(progress) as listener:
            return cls(NativeContactMap.of_sweep(sweep, options, listener))

    @property
    def points(self) -> Table:
        """One row a point of the wall: place, normal, whether the tip holds and why not, forces, inputs of each."""
        return self._native.points()

    @property
    def designs(self) -> Table | None:
        """One row a design, where ``designs`` was asked for."""
        return self._native.designs()

    def __repr__(self) -> str:
        return f"<ContactMap: {self._native.text().splitlines()[0]}>"


class Sensitivity(Study):
    """Which input matters: indices, spreads, failures, and what measurements would tell."""

    _native: NativeSensitivity

    def __init__(self, native: NativeSensitivity) -> None:
        self._native = native

    @classmethod
    def _of_sweep(
        cls,
        sweep: NativeSweep,
        options: dict[str, Any],
        run_options: dict[str, Any],
        progress: Listener,
    ) -> Sensitivity:
        with Shown(progress) as listener:
            return cls(NativeSensitivity.of_sweep(sweep, options, run_options, listener))

    @classmethod
    def _of_rows(cls, sweep: NativeSweep, rows: Table, options: dict[str, Any]) -> Sensitivity:
        return cls(NativeSensitivity.of_rows(sweep, rows, options))

    @classmethod
    def _of_results(cls, results: NativeResults, options: dict[str, Any]) -> Sensitivity:
        return cls(NativeSensitivity.of_results(results, options))

    @property
    def tables(self) -> dict[str, Table]:
        """By name: ``indices``, ``dgsm``, ``local``, ``moments``, ``failures``, ``chaos``, ``fisher``, ``design``.

        Those without rows are left out.
        """
        return dict(self._native.tables())

    def __repr__(self) -> str:
        return f"<Sensitivity: {', '.join(f'{name} ({len(table)})' for name, table in self.tables.items())}>"
