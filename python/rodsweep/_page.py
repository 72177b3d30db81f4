"""The page of ``rodsweep view`` for notebooks: one file that needs no program and no network."""

from __future__ import annotations

import tempfile
import webbrowser
from html import escape
from os import PathLike, fspath
from pathlib import Path

from . import _rodsweep
from ._errors import InputError, ResultsError


class Page:
    """A page with the rod or the map of a run. A notebook shows it; elsewhere :meth:`save` or :meth:`open` it.

    Attributes
    ----------
    html : str
        The whole page.
    height : int
        Height in a notebook, in pixels.
    """

    def __init__(self, html: str, height: int) -> None:
        self.html = html
        self.height = height

    def save(self, path: str | PathLike[str]) -> Path:
        """Writes the page as one HTML file; returns it."""
        to = Path(fspath(path))
        try:
            to.write_text(self.html, encoding="utf-8")
        except OSError as error:
            raise ResultsError(f"{to}: writing: {error.strerror or error}") from error
        return to

    def open(self) -> bool:
        """Opens the page in the browser; False where there is none. The file stays among the temporary ones."""
        with tempfile.NamedTemporaryFile(
            "w", suffix=".html", prefix="rodsweep-", delete=False, encoding="utf-8"
        ) as file:
            file.write(self.html)
        return webbrowser.open(Path(file.name).as_uri())

    def _repr_html_(self) -> str:
        style = f"width:100%;height:{self.height}px;border:1px solid #ccc"
        return f'<iframe title="rodsweep" style="{style}" srcdoc="{escape(self.html)}"></iframe>'

    def __repr__(self) -> str:
        return f"<Page: {len(self.html) / 1e6:.1f} MB; a notebook shows it, save(path) and open() elsewhere>"


def page_of(source: str | PathLike[str], height: int) -> Page:
    """The page of a scene file, a sweep file or a result directory."""
    if isinstance(height, bool) or not isinstance(height, int) or not 100 <= height <= 10_000:
        raise InputError(f"`height`: is {height!r}; give pixels, from 100 to 10,000", "height")
    with tempfile.TemporaryDirectory() as folder:
        to = Path(folder, "page.html")
        _rodsweep.write_page(fspath(source), fspath(to))
        return Page(to.read_text(encoding="utf-8"), height)


def page_of_text(text: str, height: int) -> Page:
    """The page of the text of a scene."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scene.toml")
        file.write_text(text, encoding="utf-8")
        return page_of(file, height)
