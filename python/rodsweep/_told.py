"""What the command line tells in words, here too."""

from __future__ import annotations

import json
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Protocol

from . import _html
from ._rodsweep import plain


class _Native(Protocol):
    def text(self) -> str: ...


class _NativeStudy(_Native, Protocol):
    def json(self) -> str: ...
    def write(self, folder: str) -> list[PathLike[str]]: ...
    def draw(self, folder: str) -> list[PathLike[str]]: ...


class Told:
    """Shows itself as the text that the command line prints."""

    _native: _Native

    def __str__(self) -> str:
        return plain(self._native.text())

    def _repr_html_(self) -> str:
        return f"<pre>{_html.escape(self._native.text())}</pre>"


class Study(Told):
    """What a study of the command line has found."""

    _native: _NativeStudy

    @property
    def account(self) -> dict[str, Any]:
        """Everything but long tables, as the study's JSON file of the command line, SI."""
        return dict(json.loads(self._native.json()))

    def write(self, folder: str | PathLike[str]) -> list[Path]:
        """Writes every file that the command line writes; returns them."""
        return [Path(file) for file in self._native.write(fspath(folder))]

    def draw(self, folder: str | PathLike[str]) -> list[Path]:
        """Draws the figures of the command line; returns the files."""
        return [Path(file) for file in self._native.draw(fspath(folder))]
