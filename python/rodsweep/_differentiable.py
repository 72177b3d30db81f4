"""Values and Jacobians on the host, for the bridges to JAX and PyTorch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import InputError
from ._units import kind_of, si
from ._values import Columns, Floats, names_of
from .scene import Scene, check_scene
from .solution import Solution
from .solve import _solve

OUTPUTS = ("tip_position", "tip_rotation", "tip_matrix", "shape", "stability_margin")
# A step of the differences of the margin turns the tip by so much (rad), or moves it by so much of the rod's length.
_STEP = 2e-3
# And it is at most so much of a parameter that is not zero in the scene.
_SHARE = 0.01


class Model:
    """A scene as a function of some of its numbers: theta (..., m) to y (..., q) and dy/dtheta (..., q, m)."""

    def __init__(
        self,
        scene: Scene,
        parameters: str | Sequence[str],
        outputs: str | Sequence[str],
        n_points: int,
        options: Mapping[str, Any],
    ) -> None:
        check_scene(scene)
        self.scene = scene
        self.groups = [(name, scene.components(name)) for name in names_of("parameters", parameters)]
        self.names = [component for _, components in self.groups for component in components]
        if not self.names:
            raise InputError('`parameters`: are none; name what is varied, such as "coil.current"', "parameters")
        self.outputs = names_of("outputs", outputs)
        for name in self.outputs:
            if name not in OUTPUTS:
                raise InputError(f"`{name}`: is no output; use one of: {', '.join(OUTPUTS)}", "outputs")
        if not self.outputs:
            raise InputError(f"`outputs`: are none; use some of: {', '.join(OUTPUTS)}", "outputs")
        if not 2 <= n_points <= 100_000:
            raise InputError(f"`n_points`: is {n_points}; give a number from 2 to 100,000", "n_points")
        self.n_points = n_points
        shapes = {"shape": (n_points, 3), "tip_matrix": (3, 3), "stability_margin": ()}
        self.shapes: dict[str, tuple[int, ...]] = {name: shapes.get(name, (3,)) for name in self.outputs}
        self.sizes = {name: int(np.prod(shape, dtype=int)) for name, shape in self.shapes.items()}
        self.size = sum(self.sizes.values())
        self.options = {"tolerance": 1e-9, **options}
        # Settled by the first batch, so that it is one function.
        self.method: Mapping[str, Any] | None = None
        values = {parameter.name: abs(parameter.value) for parameter in scene.parameters()}
        self.scales = np.array([values[name] for name in self.names])

    def theta(self, values: Mapping[str, Any], stack: Any) -> Any:
        """The columns of a dictionary as one array (..., m); ``stack`` broadcasts and joins them."""
        columns = []
        unknown = [name for name in values if name not in dict(self.groups)]
        missing = [name for name, _ in self.groups if name not in values]
        for name in unknown + missing:
            what = "is no parameter of this function" if name in unknown else "is missing"
            raise InputError(f"`{name}`: {what}; it takes: {', '.join(dict(self.groups))}", name)
        for name, components in self.groups:
            value = values[name]
            if kind_of(value) is not None:
                value = si(name, value, self.scene._unit(name))
            if len(components) == 1:
                columns.append(value)
            elif not np.shape(value) or np.shape(value)[-1] != len(components):
                what = f"has shape {np.shape(value)}; its last axis holds {len(components)} components"
                raise InputError(f"`{name}`: {what}", name)
            else:
                columns += [value[..., index] for index in range(len(components))]
        return stack(columns)

    def split(self, flat: Any) -> dict[str, Any]:
        """The outputs of y (..., q) by name, each of its own shape."""
        found, start = {}, 0
        for name in self.outputs:
            stop = start + self.sizes[name]
            found[name] = flat[..., start:stop].reshape((*flat.shape[:-1], *self.shapes[name]))
            start = stop
        return found

    def solve(self, theta: Floats, wrt: list[str]) -> Solution:
        """One batch."""
        columns = [np.ascontiguousarray(theta[:, index]) for index in range(theta.shape[1])]
        batch = Columns(self.names, columns, (theta.shape[0],))
        solution = _solve(self.scene, batch, wrt, lenient=True, method=self.method, **self.options)
        if self.method is None and solution.ok.any():
            self.method = solution.method
        return solution

    def value(self, theta: Floats) -> Floats:
        """y (..., q)."""
        flat = np.asarray(theta, dtype=np.float64).reshape(-1, len(self.names))
        solution = self.solve(flat, [])
        parts = [self._value_of(name, solution) for name in self.outputs]
        return np.concatenate(parts, axis=1).reshape((*np.shape(theta)[:-1], self.size))

    def value_and_slopes(self, theta: Floats) -> tuple[Floats, Floats]:
        """y (..., q) and dy/dtheta (..., q, m); NaN where there is no equilibrium."""
        flat = np.asarray(theta, dtype=np.float64).reshape(-1, len(self.names))
        solution = self.solve(flat, self.names)
        values, slopes = [], []
        for name in self.outputs:
            values.append(self._value_of(name, solution))
            slope = self._slope_of(name, solution, flat)
            slopes.append(slope.reshape(len(flat), self.sizes[name], len(self.names)))
        leading = np.shape(theta)[:-1]
        y = np.concatenate(values, axis=1).reshape((*leading, self.size))
        jacobian = np.concatenate(slopes, axis=1)
        jacobian[~solution.converged] = np.nan
        return y, jacobian.reshape((*leading, self.size, len(self.names)))

    def _value_of(self, name: str, solution: Solution) -> Floats:
        value = solution.shape(self.n_points).position if name == "shape" else getattr(solution, name)
        return np.asarray(value).reshape(len(solution), self.sizes[name])

    def _slope_of(self, name: str, solution: Solution, theta: Floats) -> Floats:
        if name == "stability_margin":
            return self._margin_slopes(theta, solution)
        if name == "shape":
            return solution.shape(self.n_points, wrt=True).position_jacobian
        rows = solution.jacobian
        if name == "tip_position":
            return rows[:, :3]
        turn = rows[:, 3:]
        if name == "tip_rotation":
            return np.asarray(_inverse_left_jacobian(solution.tip_rotation) @ turn)
        # dR = hat(w) R, column after column of R.
        return np.stack([_cross(turn, solution.tip_matrix[:, :, column]) for column in range(3)], axis=2)

    def _margin_slopes(self, theta: Floats, solution: Solution) -> Floats:
        """By differences of the fourth order, all in one batch: the engine has no derivative of the margin."""
        count, width = theta.shape
        moved = np.linalg.norm(solution.jacobian[:, :3], axis=1) / self.scene.length
        turned = np.linalg.norm(solution.jacobian[:, 3:], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = _STEP / np.maximum(moved, turned)
            share = _SHARE * np.where(self.scales > 0, np.maximum(np.abs(theta), self.scales), np.inf)
        steps = np.minimum(np.nan_to_num(steps, nan=_STEP, posinf=_STEP), share)
        offsets = np.array([-2, -1, 1, 2])
        places = theta[:, None, None, :] + offsets[:, None] * (np.eye(width) * steps[:, None, :])[:, :, None, :]
        margins = self.solve(places.reshape(-1, width), []).stability_margin.reshape(count, width, 4)
        return np.asarray((margins @ (np.array([1, -8, 8, -1]) / 12) / steps)[:, None, :])


def _hat(v: Floats) -> Floats:
    zero = np.zeros_like(v[:, 0])
    rows = [[zero, -v[:, 2], v[:, 1]], [v[:, 2], zero, -v[:, 0]], [-v[:, 1], v[:, 0], zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _cross(turn: Floats, column: Floats) -> Floats:
    """hat(w) a for each column w of a turn (n, 3, m)."""
    return np.asarray(-_hat(column) @ turn)


def _inverse_left_jacobian(v: Floats) -> Floats:
    """d(rotation vector) = this times the virtual rotation in the world."""
    angle = np.linalg.norm(v, axis=-1)
    hat = _hat(v)
    with np.errstate(invalid="ignore", divide="ignore"):
        series = 1 / 12 + angle**2 / 720
        full = 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    factor = np.where(angle < 1e-3, series, full)
    return np.asarray(np.eye(3) - 0.5 * hat + factor[:, None, None] * (hat @ hat))
