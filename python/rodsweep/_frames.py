"""Tables and solutions as what other packages work with. None of them is imported unless it is asked for."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, ResultsError
from ._rodsweep import Table


def needed(package: str, what: str) -> Any:
    """A package that one method needs."""
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f'{what} needs the package {package}: pip install "rodsweep[{package}]"') from error


def plain_name(name: str) -> str:
    """A name of letters, digits and ``_``, such as ``d_tip_position_x_d_coil_current_x``."""
    text = re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_")
    return text if text[:1].isalpha() else f"x{text}"


def rows(table: Table) -> Iterator[tuple[Any, ...]]:
    """The rows as tuples that tell the names of their columns."""
    kind = type("Row", (tuple,), {"_fields": tuple(table.columns), "__doc__": "A row of a table."})
    columns = [table[name].tolist() for name in table.columns]
    return (kind(row) for row in zip(*columns, strict=True))


def to_dict(table: Table, plain: bool) -> dict[str, NDArray[Any]]:
    """The columns by name."""
    if not plain:
        return {name: table[name] for name in table.columns}
    found: dict[str, NDArray[Any]] = {}
    for name in table.columns:
        short = plain_name(name)
        while short in found:
            short += "_"
        column = table[name]
        # Flags that are not known everywhere: 1, 0 and NaN.
        found[short] = (
            column if column.dtype != object else np.array([np.nan if x is None else x for x in column], float)
        )
    return found


def to_pandas(table: Table) -> Any:
    """A data frame, its units in ``attrs["units"]``."""
    pandas = needed("pandas", "to_pandas")
    columns = {}
    for name in table.columns:
        column = table[name]
        columns[name] = pandas.array(column.tolist(), dtype="boolean") if column.dtype == object else column
    frame = pandas.DataFrame(columns)
    frame.attrs["units"] = units_of(table)
    return frame


def to_xarray(table: Table) -> Any:
    """A data set over the rows."""
    return _data_set(table, ("row",), (len(table),), {}, [])


def save(table: Table, path: str | PathLike[str]) -> None:
    """Writes a table by the ending of the name."""
    if suffix_of(path) == ".npz":
        save_npz(path, to_dict(table, False))
    else:
        table._write(fspath(path))


def save_npz(path: str | PathLike[str], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Writes arrays into one file of NumPy; objects become numbers, so that nothing needs pickles."""
    plain = {name: array if array.dtype != object else array.astype(float) for name, array in arrays.items()}
    try:
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, **plain)
    except OSError as error:
        raise ResultsError(f"{fspath(path)}: writing: {error.strerror or error}") from error


def suffix_of(path: str | PathLike[str]) -> str:
    """The ending of a file that can be written."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".csv", ".npz", ".parquet"):
        raise InputError(f"`path`: {fspath(path)} ends in no known format; use one of: .csv, .npz, .parquet", "path")
    return suffix


def units_of(table: Table) -> dict[str, str]:
    """Units of the columns that have one."""
    return {name: unit for name, unit in zip(table.columns, table.units, strict=True) if unit}


# Sweeps.


def sweep_to_xarray(table: Table, info: Mapping[str, Any]) -> Any:
    """A data set of a sweep's rows: over its axes, where they are a whole grid, else over the samples."""
    axes: Sequence[Mapping[str, Any]] = info["axes"]
    points = [int(axis["points"]) for axis in axes]
    names = [name for name in info["names"] if name in table]
    is_grid = info["method"] == "grid" and len(table) == int(np.prod(points)) == info["sample_count"] and bool(points)
    is_grid = is_grid and all(axis["parameters"][0] in table for axis in axes)
    if not is_grid:
        branches = "branch" in table
        coordinates = ["sample", *names, *(["branch"] if branches else [])]
        return _data_set(table, ("row" if branches else "sample",), (len(table),), {}, coordinates)
    # The first axis runs fastest.
    dims = tuple(axis["parameters"][0] for axis in axes)
    shape = tuple(reversed(points))
    own: dict[str, tuple[str, NDArray[Any]]] = {}
    for at, axis in enumerate(axes):
        for name in axis["parameters"]:
            if name in table:
                along = np.moveaxis(table[name].reshape(shape), len(points) - 1 - at, 0)
                own[name] = (dims[at], along.reshape(points[at], -1)[:, 0])
    return _data_set(table, dims, tuple(points), own, ["sample"], reverse=True)


def _data_set(
    table: Table,
    dims: tuple[str, ...],
    shape: tuple[int, ...],
    own: Mapping[str, tuple[str, NDArray[Any]]],
    coordinates: Sequence[str],
    reverse: bool = False,
) -> Any:
    """Columns as variables: those of x, y and z as one with the dimension ``axis``, slopes also over ``parameter``."""
    xarray = needed("xarray", "to_xarray")
    units = dict(zip(table.columns, table.units, strict=True))

    def array(name: str) -> NDArray[Any]:
        column = table[name]
        if column.dtype == object:
            column = np.array([np.nan if x is None else x for x in column], float)
        return column.reshape(shape[::-1]).T if reverse else column.reshape(shape)

    def attrs(name: str) -> dict[str, str]:
        return {"units": units[name]} if units.get(name) else {}

    found: dict[str, Any] = {}
    coords: dict[str, Any] = {name: (dim, values, attrs(name)) for name, (dim, values) in own.items()}
    slopes: dict[str, list[str]] = {}
    for name in table.columns:
        if name in own or name in found:
            continue
        if name in coordinates:
            # The number of a sample is a coordinate of its own dimension.
            coords[name] = (dims, array(name), attrs(name))
            continue
        slope = re.fullmatch(r"d\((.+)\.[xyz]\)/d\((.+)\)", name)
        if slope:
            by = slopes.setdefault(slope[1], [])
            if slope[2] not in by:
                by.append(slope[2])
            continue
        stem, _, letter = name.rpartition(".")
        three = [f"{stem}.{axis}" for axis in "xyz"]
        if stem and letter in "xyz" and all(part in units for part in three) and not set(three) & {*own, *coordinates}:
            if letter == "x":
                stacked = np.stack([array(part) for part in three], axis=-1)
                found[stem] = ((*dims, "axis"), stacked, attrs(name))
            continue
        found[name] = (dims, array(name), attrs(name))
    for stem, by in slopes.items():
        blocks = [np.stack([array(f"d({stem}.{axis})/d({name})") for axis in "xyz"], axis=-1) for name in by]
        listed = [units[f"d({stem}.x)/d({name})"] for name in by]
        # One unit for all parameters, or one for each.
        of_slopes = {"units": listed[0] if len(set(listed)) == 1 else listed}
        found[f"d({stem})"] = ((*dims, "axis", "parameter"), np.stack(blocks, axis=-1), of_slopes)
        coords["parameter"] = ("parameter", by)
    if any("axis" in entry[0] for entry in found.values()):
        coords["axis"] = ("axis", ["x", "y", "z"])
    return xarray.Dataset(found, coords)


# Solutions.

UNITS = {
    "tip.position": "m",
    "tip.rotation": "rad",
    "base_curvature": "1/m",
    "base_moment": "N·m",
    "energy": "J",
    "contact.gap": "m",
    "contact.normal_force": "N",
    "contact.force": "N",
    "contact.angle": "rad",
    "contact.body_gap": "m",
    "contact.force_error": "N",
}


def unit_of_slope(name: str, units: Mapping[str, str]) -> str:
    """The unit of a derivative, as result files write it."""
    slope = re.fullmatch(r"d\((.+?)(?:\.[xyz])?\)/d\((.+)\)", name)
    if not slope:
        return UNITS.get(name, UNITS.get(name.rpartition(".")[0], ""))
    by, of = units.get(slope[2], ""), UNITS[slope[1]]
    return of if not by else f"{of}/({by})" if any(c in by for c in "·/") else f"{of}/{by}"


def grid_of(
    values: Mapping[str, NDArray[np.float64]], shape: tuple[int, ...]
) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Names of the axes of arrays that were broadcast, and the coordinates along them."""
    if len(shape) == 1:
        return ("sample",), {name: ("sample", array) for name, array in values.items()}
    along: dict[int, list[str]] = {}
    several = []
    for name, array in values.items():
        varies = [at for at in range(len(shape)) if array.size and (np.diff(array, axis=at) != 0).any()]
        if len(varies) == 1:
            along.setdefault(varies[0], []).append(name)
        elif varies:
            several.append(name)
    dims = []
    for at in range(len(shape)):
        names = along.get(at, [])
        first = np.moveaxis(values[names[0]], at, 0).reshape(shape[at], -1)[:, 0] if len(names) == 1 else None
        is_axis = first is not None and len(np.unique(first)) == len(first)
        dims.append(names[0] if is_axis else f"axis_{at}")
    coords: dict[str, Any] = {}
    for at, names in along.items():
        for name in names:
            coords[name] = (dims[at], np.moveaxis(values[name], at, 0).reshape(shape[at], -1)[:, 0])
    for name in several:
        coords[name] = (tuple(dims), values[name])
    return tuple(dims), coords
