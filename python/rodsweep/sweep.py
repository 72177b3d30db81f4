"""Sweeps: which samples of a scene, solved to memory or to a directory."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from . import _frames, _html
from ._errors import InputError, judge
from ._page import Page, page_of
from ._progress import Listener, Shown
from ._rodsweep import NativeSweep, Table
from ._toml import dump
from ._units import doubt_axes
from ._values import Columns, Floats, names_of
from ._why import why
from .results import Results
from .scene import Scene, check_scene
from .solve import _count
from .studies import (
    ContactMap,
    Sensitivity,
    Workspace,
    _contact_options,
    _sensitivity_options,
    _workspace_options,
)


class Sweep:
    """Samples of a scene, and what is wanted of each. It never changes; :meth:`replace` gives another one.

    Parameters
    ----------
    scene : Scene
        The rod.
    method : str
        ``grid``, ``sobol``, ``latin_hypercube``, ``uniform``, ``saltelli`` or ``skeleton``.
    axes : dict or list of dict
        What varies. A dictionary maps names to ``(low, high)`` or, for a grid, ``(low, high, points)``; numbers in SI
        units, texts with units, or quantities of pint or astropy. A list holds the [[axis]] blocks of a sweep file.
    samples : int, optional
        How many samples to draw; a grid's axes say it themselves.
    derivatives : str or sequence of str
        What the tip is differentiated by.
    quantities : sequence of str, optional
        Columns of the rows, such as ``tip_position``; by default as the command line.
    tolerance, steps, branch, seed, dimension
        As in a sweep file.
    uncertain : list of dict, optional
        The [[uncertain]] blocks of a sweep file.

    Examples
    --------
    >>> scene = Scene.from_dict({
    ...     "segment": [{
    ...         "name": "rod", "kind": "flexible", "length": 0.1,
    ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
    ...     }],
    ... })
    >>> sweep = Sweep(scene, "grid", {"loads.tip_force.x": ("-1 mN", "1 mN", 5)}, derivatives="insertion")
    >>> len(sweep)
    5
    >>> run = sweep.run()
    >>> run.table["status"].tolist()
    ['ramped', 'ramped', 'ok', 'ramped', 'ramped']
    """

    __slots__ = ("_info", "_native")

    def __init__(
        self,
        scene: Scene,
        method: str,
        axes: Mapping[str, Sequence[Any]] | Sequence[Mapping[str, Any]],
        *,
        samples: int | None = None,
        dimension: int | None = None,
        derivatives: str | Sequence[str] = (),
        quantities: Sequence[str] | None = None,
        tolerance: float | str | None = None,
        steps: int | None = None,
        branch: str | None = None,
        seed: int | None = None,
        uncertain: Sequence[Mapping[str, Any]] = (),
        workspace: Mapping[str, Any] | None = None,
    ) -> None:
        check_scene(scene)
        if method == "table":
            raise InputError("`method`: a table of values is Sweep.from_values", "method")
        blocks = [_axis(name, law) for name, law in axes.items()] if isinstance(axes, Mapping) else list(axes)
        tables: dict[str, Any] = {
            "scene": "<scene>",
            "sampling": {"method": method, "samples": samples, "dimension": dimension, "seed": seed},
            "solver": {"tolerance": tolerance, "steps": steps, "branch": branch},
            "output": {
                "derivatives": names_of("derivatives", derivatives),
                "quantities": None if quantities is None else names_of("quantities", quantities),
            },
            "axis": blocks,
            "uncertain": list(uncertain) or None,
            "workspace": workspace,
        }
        self._set(NativeSweep.parse(dump(tables), scene._native))
        doubt_axes(scene, blocks)

    def _set(self, native: NativeSweep) -> None:
        self._native = native
        self._info: dict[str, Any] = json.loads(native.info())

    @classmethod
    def _of(cls, native: NativeSweep) -> Sweep:
        self = cls.__new__(cls)
        self._set(native)
        return self

    @classmethod
    def from_file(cls, path: str | PathLike[str]) -> Sweep:
        """The sweep of a TOML file, and of the scene and the table that it names."""
        return cls._of(NativeSweep.read(path))

    @classmethod
    def from_values(
        cls,
        scene: Scene,
        values: Mapping[str, Any],
        *,
        derivatives: str | Sequence[str] = (),
        tolerance: float | None = None,
    ) -> Sweep:
        """A sweep over arrays, as ``method = "table"`` of a sweep file; ``values`` as those of :func:`solve`."""
        columns = Columns.of(scene, values)
        full = [np.ascontiguousarray(np.broadcast_to(column, (columns.count,))) for column in columns.columns]
        native = NativeSweep.of_columns(scene._native, columns.names, full, columns.count)
        return cls._of(native).replace(derivatives=derivatives, tolerance=tolerance)

    def replace(
        self,
        *,
        scene: Scene | None = None,
        tolerance: float | None = None,
        steps: int | None = None,
        branch: str | None = None,
        derivatives: str | Sequence[str] | None = None,
        quantities: Sequence[str] | None = None,
        seed: int | None = None,
    ) -> Sweep:
        """The same sweep with some things replaced. Another scene must have the same parameters."""
        native = self._native.replaced(
            scene=None if scene is None else scene._native,
            tolerance=tolerance,
            steps=_count("steps", steps),
            branch=branch,
            derivatives=None if derivatives is None else names_of("derivatives", derivatives),
            quantities=None if quantities is None else names_of("quantities", quantities),
            seed=_count("seed", seed, 0),
        )
        return Sweep._of(native)

    # What it says.

    @property
    def scene(self) -> Scene:
        """The rod with its own values, where no axis says otherwise."""
        return Scene(self._native.scene())

    def __len__(self) -> int:
        return int(self._info["sample_count"])

    @property
    def names(self) -> list[str]:
        """Names of the parameters that vary."""
        return list(self._info["names"])

    @property
    def axes(self) -> list[dict[str, Any]]:
        """What varies and how, one dictionary an axis."""
        return list(self._info["axes"])

    @property
    def info(self) -> dict[str, Any]:
        """Method, number of samples, tolerance, columns and notes."""
        return dict(self._info)

    def values(self, start: int = 0, stop: int | None = None) -> dict[str, Floats]:
        """Values of the parameters for some samples, SI."""
        stop = len(self) if stop is None else min(stop, len(self))
        if start < 0 or stop < start:
            raise InputError(f"`start`: {start} to {stop} are no samples of {len(self)}", "start")
        block = self._native.values(start, stop).reshape(stop - start, len(self.names))
        return {name: np.ascontiguousarray(block[:, index]) for index, name in enumerate(self.names)}

    def to_toml(self) -> str:
        """The sweep as a sweep file, scene inline. The values of a table are not in it."""
        return self._native.to_toml()

    # Running it.

    def run(
        self,
        directory: str | PathLike[str] | None = None,
        *,
        resume: bool = False,
        limit: int | None = None,
        shard: str | None = None,
        part_size: int | None = None,
        engine: str = "auto",
        precision: str | None = None,
        threads: int | None = None,
        method: Mapping[str, Any] | None = None,
        spot_check: bool = True,
        certain: bool = False,
        allow_distrusted: bool = False,
        progress: Listener = None,
    ) -> Run:
        """Solves every sample, as ``rodsweep run``.

        Parameters
        ----------
        directory : path, optional
            Where rows go, part by part; without it they are kept in memory.
        resume : bool
            Whether to go on with what the directory holds.
        limit : int, optional
            The first samples only.
        shard : str, optional
            ``"k/n"``: part k of n, from 1. See :meth:`shards`.
        part_size : int, optional
            Samples in a part of the directory.
        progress : callable or True, optional
            Called with samples done, samples in all, samples failed, samples a second. True shows a bar (tqdm), or
            plain lines on the standard error without that package.
        allow_distrusted : bool
            Whether to warn, and not to raise, where something speaks against the rows.
        engine, precision, threads, method
            As in :func:`solve`.
        spot_check : bool
            Whether a share of the samples is solved again by the reference.
        certain : bool
            Whether every path from rest is followed twice, as ``rodsweep run --certain``.

        Raises
        ------
        DistrustedRun
            Rows that the reference contradicts, that miss the tolerance, or of which more failed than the sweep allows;
            the run is in ``error.run``.
        """
        options = _run_options(engine, precision, threads, limit, shard, part_size, spot_check, method, certain)
        with Shown(progress, len(self)) as listener:
            if directory is None:
                table, account = self._native.run_to_memory(options, listener)
                run = Run(self, table, None, json.loads(account))
            else:
                account = self._native.run_to_directory(fspath(directory), resume, options, listener)
                run = Run(self, None, Path(fspath(directory)), json.loads(account))
        judge(run, run.account["distrust"], run.verdict, allow_distrusted)
        return run

    def shards(self, count: int, *, part_size: int | None = None) -> list[Shard]:
        """The sweep in so many parts, to be run by workers into one directory: see :meth:`Shard.run`.

        ``part_size`` is the number of samples in a part file; by default there are at least four for each shard.
        """
        shards = _count("count", count) or 1
        if part_size is None:
            part_size = max(1, min(int(self._info["part_size"]), -(-len(self) // (4 * shards))))
        return [Shard(self, index, shards, part_size) for index in range(1, shards + 1)]

    # Analyses.

    def workspace(self, **options: Any) -> Workspace:
        """Measures what the tip can reach; nothing of the sweep needs to have been run.

        Options
        -------
        voxel : float, str or quantity
            Edge of a voxel (m), or a text such as ``"8 mm"``.
        length : float, str or quantity
            As ``rodsweep workspace`` (m).
        minimum_margin, any_stable, fast, seed
            As ``rodsweep workspace``.
        designs : int
            What remains reachable for so many designs of the uncertain rod.
        vary : str
            A number of the design and its range, such as ``"tube.youngs_modulus=-10%..10%:5"``.
        convergence : bool
            Whether the figure of convergence is prepared.
        allow_distrusted : bool
            As in :meth:`run`.
        engine, precision, threads, progress
            As in :func:`solve`; ``progress`` is called with a text for each stage.
        """
        progress, allow = options.pop("progress", None), options.pop("allow_distrusted", False)
        found = Workspace._of_sweep(self._native, _workspace_options(self.scene, options), progress)
        judge(found, found.account.get("distrusted"), None, allow)
        return found

    def contact(self, **options: Any) -> ContactMap:
        """Finds which force the tip can press where on the wall; nothing of the sweep needs to have been run.

        Options
        -------
        voxel, extent : float, str or quantity
            As ``rodsweep contact`` (m).
        force : float, str or quantity
            The least coefficient of friction at this normal force (N), in place of the range of forces.
        minimum_margin : float
            Least stability margin that counts.
        designs : int
            At which points so many designs of the uncertain rod hold.
        allow_distrusted : bool
            As in :meth:`run`.
        engine, precision, threads, progress
            As in :func:`solve`; ``progress`` is called with a text for each stage.
        """
        progress, allow = options.pop("progress", None), options.pop("allow_distrusted", False)
        found = ContactMap._of_sweep(self._native, _contact_options(self.scene, options), progress)
        judge(found, found.account["distrusted"], None, allow)
        return found

    def sensitivity(self, outputs: str | Sequence[str] = (), **options: Any) -> Sensitivity:
        """Which input matters: runs the sweep with the derivatives that are needed, then studies its rows.

        Options
        -------
        inputs, estimator, confidence, degree, with_unstable, propagate, choose, noise, tangent_noise, minimum_margin
            As ``rodsweep sensitivity``; lengths in m, angles in rad, or texts with units, or quantities.
        limit, engine, precision, threads, allow_distrusted, progress
            As in :meth:`run`.
        """
        progress, allow = options.pop("progress", None), options.pop("allow_distrusted", False)
        limit = _count("limit", options.get("limit"))
        engine, precision = options.pop("engine", "auto"), options.pop("precision", None)
        run_options = _run_options(engine, precision, options.pop("threads", None), limit, None, None, True, None)
        options = _sensitivity_options(self.scene, outputs, options)
        found = Sensitivity._of_sweep(self._native, options, run_options, progress)
        judge(found, found.account["distrusted"], None, allow)
        return found

    # Keeping and showing.

    def view(self, height: int = 640) -> Page:
        """The page of ``rodsweep view``: the scene with sliders as wide as the axes. A notebook shows it."""
        with tempfile.TemporaryDirectory() as folder:
            return page_of(_written(folder, self.to_toml(), self._native.table_csv()), height)

    def __reduce__(self) -> tuple[Any, tuple[str, str | None]]:
        return _restore, (self.to_toml(), self._native.table_csv())

    def __eq__(self, other: object) -> bool:
        return self.__reduce__()[1] == other.__reduce__()[1] if isinstance(other, Sweep) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __repr__(self) -> str:
        return f"<Sweep: {len(self):,} samples, {self._info['method']} over {', '.join(self.names) or 'nothing'}>"

    def _repr_html_(self) -> str:
        rows = []
        for axis in self.axes:
            law = "from the table" if self._info["method"] == "table" else _law(axis)
            rows.append(["+".join(axis["parameters"]), law, axis["unit"]])
        head = f"<b>Sweep</b>: {len(self):,} samples, {_html.escape(self._info['method'])}"
        return head + _html.table(["parameter", "values", "unit"], rows)


class Shard:
    """A part of a sweep for one worker of several. It pickles, so that it can be sent to another process."""

    def __init__(self, sweep: Sweep, index: int, count: int, part_size: int) -> None:
        self.sweep = sweep
        self.index = index
        self.count = count
        self.part_size = part_size

    def run(self, directory: str | PathLike[str], **options: Any) -> Run:
        """Writes the parts of this shard into the directory of the whole sweep.

        Parts that are there stay, so it can be called again after a worker was lost. Options are those of
        :meth:`Sweep.run`.
        """
        text = f"{self.index}/{self.count}"
        return self.sweep.run(directory, resume=True, shard=text, part_size=self.part_size, **options)

    def __repr__(self) -> str:
        return f"<Shard {self.index}/{self.count} of {self.sweep!r}>"


class Run:
    """What came of a run: rows in memory, or a directory, and an account of it."""

    def __init__(self, sweep: Sweep, table: Table | None, directory: Path | None, account: dict[str, Any]) -> None:
        self.sweep = sweep
        self.account = account
        self.directory = directory
        self._table = table

    @property
    def table(self) -> Table:
        """The rows: an Arrow table that polars, pandas, pyarrow and DuckDB take without a copy."""
        return self._table if self._table is not None else self.results.table()

    @property
    def results(self) -> Results:
        """The result directory."""
        if self.directory is None:
            raise InputError("the run was kept in memory; give run() a directory", "directory")
        return Results._accepted(self.directory)

    @property
    def verdict(self) -> dict[str, Any]:
        """Whether the rows can be trusted, and what speaks against them."""
        return dict(self.account["verdict"])

    @property
    def counts(self) -> dict[str, int]:
        """Samples by status."""
        return dict(self.account["counts"])

    @property
    def method(self) -> dict[str, Any]:
        """By what it was solved; an argument of :meth:`Sweep.run` and :func:`solve`."""
        return dict(self.account["method"])

    def sensitivity(self, outputs: str | Sequence[str] = (), **options: Any) -> Sensitivity:
        """Which input matters, of these rows; options as :meth:`Sweep.sensitivity` without those of the run."""
        if self._table is None:
            return self.results.sensitivity(outputs, **options)
        options = _sensitivity_options(self.sweep.scene, outputs, options)
        options["mark"], options["checked"] = self.account["mark"], self.account["checked"]
        return Sensitivity._of_rows(self.sweep._native, self._table, options)

    def to_pandas(self) -> Any:
        """The rows as a data frame of pandas, one a sample; ``frame.attrs["units"]`` holds the units."""
        return self.table.to_pandas()

    def to_xarray(self) -> Any:
        """The rows as a data set of xarray; see :meth:`Results.to_xarray`."""
        return _frames.sweep_to_xarray(self.table, self.sweep.info)

    def why(self, sample: int) -> str:
        """What became of a sample, in a sentence: what is wrong with its values where there is no rod."""
        return why(self.sweep, self.table, sample)

    def view(self, height: int = 640) -> Page:
        """The page of ``rodsweep view``: the map of the run. A notebook shows it, so many pixels high.

        The rows must lie in a directory: rows in memory have none.
        """
        if self.directory is None:
            raise InputError("the run was kept in memory; give run() a directory, then view() can show it", "directory")
        return page_of(self.directory, height)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    def __repr__(self) -> str:
        counts = ", ".join(f"{count:,} {word}" for word, count in self.counts.items())
        place = "" if self.directory is None else f" in {self.directory}"
        return f"<Run: {counts or 'no rows'}; {self.account['engine']}{place}>"

    def _repr_html_(self) -> str:
        rows = [[word, f"{count:,}"] for word, count in self.counts.items()]
        return f"<b>Run</b>, {_html.escape(self.account['engine'])}" + _html.table(["status", "samples"], rows)


def _law(axis: Mapping[str, Any]) -> str:
    """By which law an axis varies, in words."""
    law = axis["distribution"]
    if law == "uniform":
        return f"{axis['from']:g} to {axis['to']:g}"
    if law == "normal":
        return f"{axis['mean']:g} ± {axis['standard_deviation']:g}"
    if law == "values":
        listed = axis["values"]
        return ", ".join(f"{value:g}" for value in listed[:8]) + (" …" if len(listed) > 8 else "")
    numbers = ("from", "mode", "to", "mean", "standard_deviation")
    return ", ".join([law] + [f"{key.replace('_', ' ')} {axis[key]:g}" for key in numbers if key in axis])


def _axis(name: str, law: Any) -> dict[str, Any]:
    """The block of an axis."""
    if isinstance(law, Mapping):
        return {"parameter": name, **law}
    if not isinstance(law, (tuple, list)) or len(law) not in (2, 3):
        raise InputError(f"`{name}`: is {law!r}; give (low, high), (low, high, points) or a dictionary", name)
    points = {"points": law[2]} if len(law) == 3 else {}
    return {"parameter": name, "from": law[0], "to": law[1], **points}


def _run_options(
    engine: str,
    precision: str | None,
    threads: int | None,
    limit: int | None,
    shard: str | None,
    part_size: int | None,
    spot_check: bool,
    method: Mapping[str, Any] | None,
    certain: bool = False,
) -> dict[str, Any]:
    return {
        "engine": engine,
        "precision": precision,
        "threads": _count("threads", threads),
        "limit": _count("limit", limit),
        "shard": shard,
        "part_size": _count("part_size", part_size),
        "spot_check": bool(spot_check),
        "certain": bool(certain),
        "method": None if method is None else json.dumps(dict(method)),
    }


def _restore(text: str, table: str | None) -> Sweep:
    """The sweep of its own text; the readers of the library take files."""
    with tempfile.TemporaryDirectory() as folder:
        return Sweep.from_file(_written(folder, text, table))


def _written(folder: str, text: str, table: str | None) -> Path:
    """The file of a sweep in a folder, beside that of its table."""
    file = Path(folder, "sweep.toml")
    file.write_text(text, encoding="utf-8")
    if table is not None:
        Path(folder, "inputs.csv").write_text(table, encoding="utf-8")
    return file
