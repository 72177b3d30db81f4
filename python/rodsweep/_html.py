"""Small tables and pictures for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

__all__ = ["beside", "escape", "rods", "table"]

_COLOURS = ("#1f5fa8", "#c2571a", "#3c7d3c", "#7a4fa3", "#8a6d1f")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts."""
    cells = "".join(f"<th style='text-align:left'>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{cells}</tr>{body}</table>"


def beside(left: str, right: str) -> str:
    """Two pieces side by side."""
    return f"<div style='display:flex;gap:2em;align-items:center'><div>{left}</div><div>{right}</div></div>"


def rods(shapes: Sequence[NDArray[np.float64]], size: int = 220) -> str:
    """Centre lines (n, 3) in metres, seen along the axis that shows most of them."""
    shapes = [shape[np.isfinite(shape).all(axis=1)] for shape in shapes]
    shapes = [shape for shape in shapes if len(shape) > 1]
    if not shapes:
        return ""
    points = np.concatenate(shapes)
    across = 0 if np.ptp(points[:, 0]) >= np.ptp(points[:, 1]) else 1
    low = points[:, [across, 2]].min(axis=0)
    extent = max(float(np.ptp(points[:, [across, 2]], axis=0).max()), 1e-9)
    scale = (size - 40) / extent
    middle = 0.5 * (extent - np.ptp(points[:, across])) * scale
    lines = []
    for number, shape in enumerate(shapes):
        x = 20 + middle + (shape[:, across] - low[0]) * scale
        y = size - 20 - (shape[:, 2] - low[1]) * scale
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        colour = _COLOURS[number % len(_COLOURS)]
        lines.append(f"<polyline points='{path}' fill='none' stroke='{colour}' stroke-width='2.5'/>")
    label = f"<text x='4' y='12' font-size='10' fill='#666'>{'xy'[across]}–z, {1e3 * extent:.3g} mm</text>"
    return f"<svg width='{size}' height='{size}' role='img'>{label}{''.join(lines)}</svg>"
