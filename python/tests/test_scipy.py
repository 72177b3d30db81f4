"""The same boundary value problem, written anew for SciPy: equilibria of a rod from its differential equations.

p' = R e3, R' = R hat(u), n' = -q, m' = -p' x n, with m = R K (u - u*); the base is clamped, at the tip stand the
force and the moment of the scene; q is the weight. Nothing of the library is used for the answers.
"""

from __future__ import annotations

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


def slope(_: float, y: np.ndarray, share: float) -> np.ndarray:
    rotation, n, m = y[3:12].reshape(3, 3), y[12:15], y[15:18]
    p_slope = rotation[:, 2]
    u = REST + (rotation.T @ m) / STIFFNESS
    weight = share * DENSITY * GRAVITY
    return np.concatenate([p_slope, (rotation @ hat(u)).ravel(), -weight, -np.cross(p_slope, n)])


def end(m0: np.ndarray, force: np.ndarray, length: float, share: float) -> np.ndarray:
    """The state at the tip with this moment at the base, under a share of the loads."""
    n0 = share * (force + DENSITY * GRAVITY * length)
    start = np.concatenate([np.zeros(3), np.eye(3).ravel(), n0, m0])
    path = integrate.solve_ivp(slope, (0, length), start, method="DOP853", rtol=3e-13, atol=1e-15, args=(share,))
    return np.asarray(path.y[:, -1])


def miss(m0: np.ndarray, force: np.ndarray, length: float, share: float) -> np.ndarray:
    """What the moment at the tip is off; moments in µN·m."""
    return np.asarray(1e6 * (end(1e-6 * m0, force, length, share)[15:18] - share * MOMENT))


def shot(force: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Tip position and rotation; loads are raised in steps, so that the equilibrium is that from rest."""
    m0 = np.zeros(3)
    for share in np.linspace(0.2, 1, 5):
        found = optimize.root(miss, m0, args=(force, length, share), method="hybr", tol=1e-12)
        m0 = found.x
    assert np.abs(found.fun).max() < 1e-8
    y = end(1e-6 * m0, force, length, 1.0)
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
