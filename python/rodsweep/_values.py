"""Values of parameters as columns that broadcast against each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError
from ._units import doubt, is_bare, number, si
from .scene import Scene

Floats = NDArray[np.float64]


class Columns:
    """Names of parameters, one column each: of one value for all samples, or one a sample."""

    __slots__ = ("columns", "count", "names", "shape")

    def __init__(self, names: list[str], columns: list[Floats], shape: tuple[int, ...]) -> None:
        self.names = names
        self.columns = columns
        self.shape = shape
        self.count = math.prod(shape)

    @classmethod
    def of(cls, scene: Scene, values: Mapping[str, Any] | None) -> Columns:
        """The columns of what a user gave."""
        if values is None:
            values = {}
        if not isinstance(values, Mapping):
            raise InputError(f"`values`: is of type {type(values).__name__}; give a dictionary", "values")
        names: list[str] = []
        arrays: list[Floats] = []
        bare: list[tuple[str, Floats]] = []
        for name, value in values.items():
            if not isinstance(name, str):
                raise InputError(f'`values`: {name!r} is no name; give a text such as "coil.current.x"', "values")
            components = scene.components(name)
            array = numbers(scene, name, value)
            if is_bare(value):
                bare.append((name, array))
            names += components
            if len(components) == 1 or array.ndim == 0:
                arrays += [array] * len(components)
            elif array.shape[-1] == len(components):
                arrays += [array[..., index] for index in range(len(components))]
            else:
                what = f"has shape {array.shape}; give a number, or an array whose last axis holds its"
                raise InputError(f"`{name}`: {what} {len(components)} components", name)
        shape = _broadcast(names, arrays)
        columns = []
        try:
            for array in arrays:
                if array.ndim and array.shape != shape:
                    array = np.broadcast_to(array, shape)
                columns.append(np.ascontiguousarray(array).reshape(-1))
        except (MemoryError, ValueError):
            what = f"a batch of {math.prod(shape):,} samples is too large for memory"
            raise InputError(f"`values`: {what}; give fewer, or a `Sweep`, which makes its own", "values") from None
        for name, array in bare:
            doubt(scene, name, array)
        return cls(names, columns, shape)


def numbers(scene: Scene, name: str, value: Any) -> Floats:
    """An array of floats."""
    if isinstance(value, str):
        component = scene.components(name)[0]
        parameters = {parameter.name: parameter.value for parameter in scene.with_values({name: value}).parameters()}
        return np.asarray(parameters[component])
    return floats(name, value, scene._unit(name))


def forces_of(key: str, value: Any, shape: tuple[int, ...]) -> Floats:
    """Forces (N) of this shape, or one for all of them."""
    given = np.asarray(number(key, value, "N")) if isinstance(value, str) else floats(key, value, "N")
    try:
        return np.broadcast_to(given, shape)
    except ValueError:
        raise InputError(f"`{key}`: has shape {given.shape}; give {shape}, or one number", key) from None


def floats(name: str, value: Any, unit: str | None) -> Floats:
    """An array of floats in an SI unit; what is none is refused under a name."""
    if type(value) is float:
        return np.asarray(value)
    value = si(name, value, unit)
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, OverflowError, RuntimeError) as error:
        raise InputError(f"`{name}`: is no array of numbers: {error}", name) from None
    if array.dtype == np.float64:
        return array
    if array.dtype.kind in "iuf":
        return array.astype(np.float64)
    if array.dtype.kind == "b":
        raise InputError(f"`{name}`: holds truth values; give numbers", name)
    if array.size == 0 and array.dtype.kind == "O":
        return np.zeros(array.shape)
    raise InputError(f"`{name}`: is of dtype {array.dtype}; give real numbers in SI units", name)


def names_of(key: str, names: str | Sequence[str] | None) -> list[str]:
    """One name, several, or none."""
    if names is None:
        return []
    if isinstance(names, str):
        return [name.strip() for name in names.split(",") if name.strip()]
    try:
        listed = list(names)
    except TypeError:
        raise InputError(f'`{key}`: {names!r} is no name; give texts such as "coil.current"', key) from None
    for name in listed:
        if not isinstance(name, str):
            raise InputError(f'`{key}`: {name!r} is no name; give texts such as "coil.current"', key)
    return listed


def _broadcast(names: list[str], arrays: list[Floats]) -> tuple[int, ...]:
    shape: tuple[int, ...] = ()
    for name, array in zip(names, arrays, strict=True):
        if not array.ndim or array.shape == shape:
            continue
        try:
            shape = np.broadcast_shapes(shape, array.shape)
        except ValueError:
            what = f"has shape {array.shape}, which does not broadcast against {shape} of the others"
            raise InputError(f"`{name}`: {what}; give a number or an array of the same shape", name) from None
    return shape
