"""Scenes: one rod in one field with its loads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from typing import Any, NamedTuple

import numpy as np

from . import _html
from ._errors import InputError
from ._page import Page, page_of_text
from ._rodsweep import NativeScene
from ._toml import dump
from ._units import as_text, doubt, doubt_tables, is_bare, kind_of


class Parameter(NamedTuple):
    """A number of a scene."""

    name: str
    """Such as ``coil.current.x``."""
    unit: str
    """SI; empty for a pure number."""
    value: float
    """In the scene, SI."""


class Scene:
    """One rod: segments from base to tip, a field, loads. It never changes; :meth:`with_values` gives another one.

    >>> scene = Scene.from_dict({
    ...     "segment": [{
    ...         "name": "rod", "kind": "flexible", "length": "0.1 m",
    ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
    ...     }],
    ...     "loads": {"tip_force": [0, "1 mN", 0]},
    ... })
    >>> scene
    <Scene: rod 100 mm>
    >>> scene.parameters()[0]
    Parameter(name='insertion', unit='m', value=0.1)
    """

    __slots__ = ("_components", "_native", "_numbers")

    def __init__(self, native: NativeScene) -> None:
        if not isinstance(native, NativeScene):
            raise TypeError("make a scene with Scene.from_file, Scene.from_dict or Scene.from_toml")
        self._native = native
        self._components: dict[str, list[str]] = {}
        self._numbers: dict[str, tuple[str, float]] | None = None

    @classmethod
    def from_file(cls, path: str | PathLike[str]) -> Scene:
        """The scene of a TOML file.

        Raises :class:`InputError` with file, line, key and remedy where something in it is wrong.
        """
        return cls(NativeScene.read(path))

    @classmethod
    def from_toml(cls, text: str) -> Scene:
        """The scene of a text, as a file holds it."""
        return cls(NativeScene.parse_text(text))

    @classmethod
    def from_dict(cls, tables: Mapping[str, Any]) -> Scene:
        """The scene of a dictionary with the structure of the file.

        Quantities are numbers in SI units, texts with units, or quantities of pint or astropy. A value of None is left
        out.

        >>> Scene.from_dict({"segment": [{"name": "rod", "kind": "flexible", "length": "1 kg"}]})
        Traceback (most recent call last):
            ...
        rodsweep._errors.InputError: `segment[0].length`: "1 kg" is a mass; give a length such as "13 mm"
        """
        if not isinstance(tables, Mapping):
            raise InputError(f"the scene is of type {type(tables).__name__}; give a dictionary")
        scene = cls(NativeScene.parse_text(dump(tables)))
        doubt_tables(tables)
        return scene

    def with_values(self, values: Mapping[str, Any]) -> Scene:
        """The same scene with other values: SI numbers, texts with units, or quantities of pint or astropy.

        A group sets all of its components.

        >>> scene = Scene.from_dict({
        ...     "segment": [{
        ...         "name": "rod", "kind": "flexible", "length": 0.1,
        ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
        ...     }],
        ... })
        >>> scene.with_values({"insertion": "120 mm", "loads.tip_force.x": 1e-3})
        <Scene: rod 120 mm>
        """
        if not isinstance(values, Mapping):
            raise InputError(f"`values`: is of type {type(values).__name__}; give a dictionary", "values")
        scene = Scene(self._native.assigned([f"{name}={_quantity(name, value)}" for name, value in values.items()]))
        for name, value in values.items():
            if is_bare(value):
                doubt(self, name, value)
        return scene

    def parameters(self) -> list[Parameter]:
        """Every number of the scene that can be set, swept and differentiated by."""
        return [Parameter(*parameter) for parameter in self._native.parameters()]

    def components(self, name: str) -> list[str]:
        """The parameters that a name stands for: those of a group such as ``coil.current``, else itself."""
        if name not in self._components:
            self._components[name] = self._native.components(name)
        return list(self._components[name])

    def _known(self) -> dict[str, tuple[str, float]]:
        """Unit and value of every parameter."""
        if self._numbers is None:
            self._numbers = {name: (unit, value) for name, unit, value in self._native.parameters()}
        return self._numbers

    def _unit(self, name: str) -> str | None:
        """The SI unit of a parameter or a group; None where the components have several."""
        known = self._known()
        units = {known[component][0] for component in self.components(name) if component in known}
        return units.pop() if len(units) == 1 else None

    def to_toml(self) -> str:
        """The scene as a TOML text that reads back identically."""
        return self._native.to_toml()

    @property
    def name(self) -> str:
        """The scene's name; empty for none."""
        return self._native.name()

    @property
    def length(self) -> float:
        """Length of the whole rod (m)."""
        return self._native.total_length()

    def figure(self, format: str = "png") -> bytes:
        """The solved rod with its loads as the bytes of a ``png`` or ``svg``, as ``rodsweep solve --plot`` draws it."""
        return self._native.figure(format)

    def view(self, height: int = 640) -> Page:
        """The page of ``rodsweep view``: the rod in space, solved. A notebook shows it, so many pixels high."""
        return page_of_text(self.to_toml(), height)

    def __eq__(self, other: object) -> bool:
        return self.to_toml() == other.to_toml() if isinstance(other, Scene) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return Scene.from_toml, (self.to_toml(),)

    def __repr__(self) -> str:
        segments = ", ".join(f"{name} {1e3 * length:.4g} mm" for name, _, length in self._native.segments())
        return f"<Scene {self.name!r}: {segments}>" if self.name else f"<Scene: {segments}>"

    def _repr_html_(self) -> str:
        rows = [[name, kind, f"{1e3 * length:.4g} mm"] for name, kind, length in self._native.segments()]
        table = _html.table(["segment", "kind", "length"], rows)
        points = np.array(self._native.centreline(41))
        picture = _html.rods([points]) if points.size else ""
        return f"<b>{_html.escape(self.name or 'Scene')}</b>{_html.beside(table, picture)}"


def _quantity(name: object, value: object) -> str:
    """A value as the library reads it."""
    if isinstance(value, str):
        return value
    if kind_of(value) is not None:
        text = as_text(str(name), value)
        if not isinstance(text, str):
            raise InputError(f"`{name}`: holds several quantities; give one", str(name))
        return text
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        found = type(value).__name__
        raise InputError(f"`{name}`: is of type {found}; give a number or a text with a unit", str(name)) from None
    if not math.isfinite(number):
        raise InputError(f"`{name}`: is {number}; give a finite number", str(name))
    return repr(number)


def check_scene(scene: object) -> None:
    """Refuses what is no scene."""
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: is of type {type(scene).__name__}; give a Scene")
