"""The same boundary value problem, written anew for SciPy: equilibria of a rod from its differential equations.

p' = R e3, R' = R hat(u), n' = -q, m' = -p' x n - l, with m = R K (u - u*); the base is clamped, at the tip stand the
force and the moment of the scene. In the field B the coil at the tip has the moment R N A i and the couple (R mu) x B.
Nothing of the library is used for the answers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import rodsweep

integrate = pytest.importorskip("scipy.integrate")
optimize = pytest.importorskip("scipy.optimize")

LENGTH = 0.12
STIFFNESS = np.array([1.1e-5, 1.7e-5, 0.9e-5])
REST = np.array([3.0, -2.0, 1.5])
GRAVITY = np.array([0.0, 0.0, -9.81])
DENSITY = 3e-4
FORCE = np.array([2e-4, -3e-4, 1e-4])
MOMENT = np.array([1e-6, 4e-6, -2e-6])


def hat(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def slope(_: float, y: np.ndarray) -> np.ndarray:
    p_slope = y[3:12].reshape(3, 3)[:, 2]
    rotation = y[3:12].reshape(3, 3)
    n, m = y[12:15], y[15:18]
    u = REST + (rotation.T @ m) / STIFFNESS
    return np.concatenate([p_slope, (rotation @ hat(u)).ravel(), -DENSITY * GRAVITY, -np.cross(p_slope, n)])


def integrated(m0: np.ndarray, force: np.ndarray, length: float) -> Any:
    n0 = force + DENSITY * GRAVITY * length
    start = np.concatenate([np.zeros(3), np.eye(3).ravel(), n0, m0])
    return integrate.solve_ivp(slope, (0, length), start, method="DOP853", rtol=3e-13, atol=1e-15)


def shot(force: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Tip position and rotation; loads are raised in steps, so that the equilibrium is that from rest."""
    m0 = np.zeros(3)
    for share in np.linspace(0.2, 1, 5):
        global GRAVITY
        full = GRAVITY
        GRAVITY = share * full
        try:
            miss = lambda m: 1e6 * (integrated(1e-6 * m, share * force, length).y[15:18, -1] - share * MOMENT)  # noqa: E731
            found = optimize.root(miss, 1e6 * m0, method="hybr", tol=1e-12)
        finally:
            GRAVITY = full
        m0 = 1e-6 * found.x
    assert np.abs(found.fun).max() < 1e-8
    y = integrated(m0, force, length).y[:, -1]
    return y[:3], y[3:12].reshape(3, 3)


def scene() -> rodsweep.Scene:
    return rodsweep.Scene.from_dict(
        {
            "segment": [
                {
                    "name": "rod",
                    "kind": "flexible",
                    "length": LENGTH,
                    "stiffness": dict(zip(("bending_x", "bending_y", "torsion"), STIFFNESS.tolist(), strict=True)),
                    "rest_curvature": REST.tolist(),
                    "linear_density": DENSITY,
                }
            ],
            "loads": {"gravity": GRAVITY.tolist(), "tip_force": FORCE.tolist(), "tip_moment": MOMENT.tolist()},
        }
    )


def test_tips_are_those_of_scipy() -> None:
    generator = np.random.default_rng(5)
    forces = FORCE + generator.normal(0, 2e-4, (6, 3))
    lengths = generator.uniform(0.08, LENGTH, 6)
    values = {"loads.tip_force": forces, "insertion": lengths}
    solution = rodsweep.solve(scene(), values, tolerance=1e-11, engine="cpu")
    assert solution.ok.all()
    for k in range(6):
        position, rotation = shot(forces[k], lengths[k])
        assert np.abs(position - solution.tip_position[k]).max() < 1e-8 * lengths[k]
        assert np.abs(rotation - solution.tip_matrix[k]).max() < 1e-8


def test_jacobians_are_those_of_scipy() -> None:
    """Differences of SciPy's answers: their own error is what is left at a step of 1e-6 N."""
    solution = rodsweep.solve(scene(), wrt=["loads.tip_force", "insertion"], tolerance=1e-11, engine="cpu")
    for k in range(4):
        step = np.zeros(4)
        step[k] = 2e-6 if k < 3 else 1e-5
        tips = [shot(FORCE + sign * step[:3], LENGTH + sign * step[3])[0] for sign in (-2, -1, 1, 2)]
        slopes = np.array([1, -8, 8, -1]) / 12 @ np.array(tips) / step[k]
        scale = np.linalg.norm(solution.jacobian[:3, k])
        assert np.abs(slopes - solution.jacobian[:3, k]).max() < 1e-6 * scale
