"""The bridge to JAX: jit, vmap, grad; a vmap is one batch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rodsweep

jax = pytest.importorskip("jax", reason="JAX is not installed")
jax.config.update("jax_enable_x64", True)
jnp = jax.numpy
check_grads = pytest.importorskip("jax.test_util").check_grads

import rodsweep.jax  # noqa: E402

FORCE = jnp.array([1e-4, 3e-4, -2e-4])


def test_values_are_those_of_solve(rod: rodsweep.Scene) -> None:
    outputs = ["tip_position", "tip_rotation", "tip_matrix", "shape", "stability_margin"]
    f = rodsweep.jax.function(rod, ["loads.tip_force", "insertion"], outputs=outputs, n_points=5)
    found = f({"loads.tip_force": FORCE, "insertion": 0.1})
    solution = rodsweep.solve(rod, {"loads.tip_force": np.array(FORCE), "insertion": 0.1}, tolerance=1e-9)
    for name in outputs:
        expected = solution.shape(5).position if name == "shape" else getattr(solution, name)
        assert np.array_equal(found[name], expected), name


@pytest.mark.parametrize("output", ["tip_position", "tip_rotation", "tip_matrix", "shape", "stability_margin"])
def test_gradients(rod: rodsweep.Scene, output: str) -> None:
    f = rodsweep.jax.function(rod, ["loads.tip_force", "insertion"], outputs=output, n_points=4, tolerance=1e-12)

    def scaled(x: jax.Array) -> jax.Array:
        # Of order one, so that the check's own steps suit.
        return f({"loads.tip_force": FORCE * x[:3], "insertion": 0.1 * x[3]})[output]

    tolerance = 1e-5
    check_grads(scaled, (jnp.ones(4),), order=1, modes=["fwd", "rev"], eps=1e-4, atol=tolerance, rtol=tolerance)


def test_a_vmap_is_one_batch(rod: rodsweep.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from rodsweep import _differentiable

    batches: list[int] = []
    solve = _differentiable.Model.solve

    def counted(self: _differentiable.Model, theta: np.ndarray, wrt: list[str]) -> rodsweep.Solution:
        batches.append(len(theta))
        return solve(self, theta, wrt)

    monkeypatch.setattr(_differentiable.Model, "solve", counted)
    f = rodsweep.jax.function(rod, "loads.tip_force")
    tip = lambda force: f({"loads.tip_force": force})["tip_position"]
    forces = FORCE * jnp.linspace(0, 1, 50)[:, None]
    many = jax.jit(jax.vmap(tip))(forces)
    assert batches == [50]
    assert np.allclose(many, jnp.stack([tip(force) for force in forces]), atol=1e-10)
    batches.clear()
    slopes = jax.vmap(jax.jacrev(tip))(forces)
    assert batches == [50]
    assert slopes.shape == (50, 3, 3)
    grid = jax.vmap(jax.vmap(tip))(forces.reshape(5, 10, 3))
    assert np.allclose(grid.reshape(50, 3), many, atol=1e-12)
    slope = jax.grad(lambda force: tip(force)[1])(FORCE)
    expected = rodsweep.solve(rod, {"loads.tip_force": np.array(FORCE)}, wrt="loads.tip_force", tolerance=1e-9)
    assert np.allclose(slope, expected.jacobian[1], rtol=1e-7)


def test_no_equilibrium_gives_nan(rod: rodsweep.Scene) -> None:
    f = rodsweep.jax.function(rod, "insertion")
    lengths = jnp.array([0.1, -1.0, jnp.nan])
    tip = lambda length: f({"insertion": length})["tip_position"][2]
    values, slopes = jax.vmap(jax.value_and_grad(tip))(lengths)
    assert np.isfinite([values[0], slopes[0]]).all()
    assert np.isnan(values[1:]).all() and np.isnan(slopes[1:]).all()


def test_wrong_names(rod: rodsweep.Scene, root: Path) -> None:
    with pytest.raises(rodsweep.InputError, match="is no output"):
        rodsweep.jax.function(rod, "insertion", outputs="tip")
    with pytest.raises(rodsweep.InputError, match="is missing"):
        rodsweep.jax.function(rod, ["insertion", "loads.tip_force"])({"insertion": 0.1})
    with pytest.raises(rodsweep.InputError, match="components"):
        rodsweep.jax.function(rod, ["loads.tip_force"])({"loads.tip_force": 0.1})
