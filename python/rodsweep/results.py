"""Result directories."""

from __future__ import annotations

import json
from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _frames, _html
from ._errors import judge
from ._page import Page, page_of
from ._rodsweep import NativeResults, Parts, Table
from ._values import names_of
from ._why import why
from .scene import Scene
from .studies import Sensitivity, Workspace, _sensitivity_options, _workspace_options

if TYPE_CHECKING:
    from .sweep import Sweep


class Results:
    """A directory that a run has written to, from Python or from the command line."""

    __slots__ = ("_native",)

    def __init__(self, native: NativeResults) -> None:
        if not isinstance(native, NativeResults):
            raise TypeError("open a directory with Results.open")
        self._native = native

    @classmethod
    def open(cls, directory: str | PathLike[str], *, allow_distrusted: bool = False) -> Results:
        """Opens a directory.

        Raises :class:`ResultsError` where it holds no run, :class:`MissingFileError` where nothing is there, and
        :class:`DistrustedRun` where something speaks against its rows, unless ``allow_distrusted`` asks for a warning.
        """
        results = cls._accepted(directory)
        judge(results, results._native.distrust(), results.verdict, allow_distrusted)
        return results

    @classmethod
    def _accepted(cls, directory: str | PathLike[str]) -> Results:
        """The same for those who know what speaks against it."""
        return cls(NativeResults.open(fspath(directory)))

    @property
    def verdict(self) -> dict[str, Any] | None:
        """Whether the rows can be trusted, and what speaks against them; None where nothing tells."""
        text = self._native.verdict()
        return None if text is None else dict(json.loads(text))

    @property
    def directory(self) -> Path:
        """Where it lies."""
        return Path(self._native.directory())

    @property
    def sweep(self) -> Sweep:
        """The sweep as it was run."""
        from .sweep import Sweep

        return Sweep._of(self._native.sweep())

    def table(self, columns: str | Sequence[str] | None = None) -> Table:
        """All rows, in order of samples; every column, if none are named."""
        return self._native.table(names_of("columns", columns))

    def parts(self, columns: str | Sequence[str] | None = None) -> Parts:
        """The rows part by part, each read when it is asked for.

        The answer is an iterator of tables, and an Arrow stream: ``pyarrow.RecordBatchReader.from_stream(parts)`` or
        DuckDB read it without holding all rows.
        """
        return self._native.parts(names_of("columns", columns))

    def status(self) -> dict[str, Any]:
        """Parts that are there, missing or damaged, and rows by status."""
        return dict(json.loads(self._native.status()))

    def manifest(self) -> dict[str, Any]:
        """The run's account of itself: device, times, spot check."""
        return dict(json.loads(self._native.manifest()))

    def workspace(self, **options: Any) -> Workspace:
        """Measures what the tip can reach, beginning from these rows; options as :meth:`Sweep.workspace`."""
        progress = options.pop("progress", None)
        return Workspace._of_results(self._native, _workspace_options(self._scene(), options), progress)

    def sensitivity(self, outputs: str | Sequence[str] = (), **options: Any) -> Sensitivity:
        """Which input matters, of these rows; options as :meth:`Sweep.sensitivity` without those of the run."""
        return Sensitivity._of_results(self._native, _sensitivity_options(self._scene(), outputs, options))

    def _scene(self) -> Scene:
        return Scene(self._native.sweep().scene())

    def to_pandas(self, columns: str | Sequence[str] | None = None) -> Any:
        """The rows as a data frame of pandas; every column, if none are named.

        ``frame.attrs["units"]`` holds the units.
        """
        return self.table(columns).to_pandas()

    def to_xarray(self) -> Any:
        """The rows as a data set of xarray.

        A whole grid has its axes as dimensions, with their values as coordinates. Other rows have the dimension
        ``sample``, or ``row`` where a sample has a row for each equilibrium. ``tip.position`` and other vectors have
        the dimension ``axis`` (x, y, z), derivatives also ``parameter``. Each variable has its unit in
        ``attrs["units"]``.
        """
        return _frames.sweep_to_xarray(self.table(), self.sweep.info)

    def why(self, sample: int) -> str:
        """What became of a sample, in a sentence: what is wrong with its values where there is no rod."""
        return why(self.sweep, self.table(), sample)

    def view(self, height: int = 640) -> Page:
        """The page of ``rodsweep view``: the map of the run. A notebook shows it, so many pixels high."""
        return page_of(self.directory, height)

    def draw(self, folder: str | PathLike[str] | None = None, *, colour: str | None = None) -> list[Path]:
        """Draws the figures of the run, as ``rodsweep figures``; returns the files."""
        folder = self.directory if folder is None else folder
        return [Path(file) for file in self._native.draw(fspath(folder), colour)]

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return Results._accepted, (str(self.directory),)

    def __repr__(self) -> str:
        status = self.status()
        return f"<Results: {self.directory}, {status['samples_done']:,} samples in {status['parts_done']} parts>"

    def _repr_html_(self) -> str:
        status = self.status()
        rows = [[word, f"{count:,}"] for word, count in status["counts"].items()]
        head = f"<b>Results</b> {_html.escape(str(self.directory))}: {status['parts_done']} of "
        return head + f"{status['parts_total']} parts" + _html.table(["status", "rows"], rows)
