"""Rods in JAX: a function of parameters that ``jit``, ``vmap``, ``grad``, ``jacfwd`` and ``jacrev`` take.

JAX is imported here only. Switch on its 64 bits for full precision: ``jax.config.update("jax_enable_x64", True)``.

>>> import jax, jax.numpy as jnp
>>> import rodsweep, rodsweep.jax
>>> jax.config.update("jax_enable_x64", True)
>>> scene = rodsweep.Scene.from_dict({
...     "segment": [{
...         "name": "rod", "kind": "flexible", "length": 0.1,
...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
...     }],
... })
>>> tip = rodsweep.jax.function(scene, "loads.tip_force")
>>> jax.jacrev(lambda force: tip({"loads.tip_force": force})["tip_position"])(jnp.zeros(3)).shape
(3, 3)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._differentiable import Model
from .scene import Scene

__all__ = ["function"]


def function(
    scene: Scene,
    parameters: str | Sequence[str],
    *,
    outputs: str | Sequence[str] = ("tip_position",),
    n_points: int = 21,
    tolerance: float = 1e-9,
    engine: str = "auto",
    precision: str | None = None,
    threads: int | None = None,
) -> Callable[[Mapping[str, Any]], dict[str, jax.Array]]:
    """A differentiable function of some numbers of a scene.

    Parameters
    ----------
    scene : Scene
        The rod.
    parameters : str or sequence of str
        What is varied: names or groups.
    outputs : str or sequence of str
        ``tip_position`` (3,), ``tip_rotation`` (3,) a rotation vector, ``tip_matrix`` (3, 3), ``shape`` (p, 3) points
        from base to tip, ``stability_margin`` ().
    n_points : int
        Points p of ``shape``.
    tolerance, engine, precision, threads
        As in :func:`rodsweep.solve`.

    Returns
    -------
    callable
        Takes a dictionary of names to arrays, those of a group with its components along the last axis, and gives a
        dictionary of outputs. Arrays with leading axes are one batch, and so is a ``vmap``.

    Notes
    -----
    Derivatives are the engine's own, those of the margin differences of the fourth order. A sample without
    equilibrium has NaN values and NaN gradients. There are no second derivatives.
    """
    options = {"tolerance": tolerance, "engine": engine, "precision": precision, "threads": threads}
    model = Model(scene, parameters, outputs, n_points, options)

    def value_there(theta: Any) -> Any:
        theta = np.asarray(theta)
        return model.value(theta).astype(theta.dtype)

    def value_and_slopes_there(theta: Any) -> Any:
        theta = np.asarray(theta)
        value, slopes = model.value_and_slopes(theta)
        return value.astype(theta.dtype), slopes.astype(theta.dtype)

    def call(there: Callable[[Any], Any], theta: jax.Array, *shapes: tuple[int, ...]) -> Any:
        like = tuple(jax.ShapeDtypeStruct((*theta.shape[:-1], *shape), theta.dtype) for shape in shapes)
        return jax.pure_callback(there, like if len(like) > 1 else like[0], theta, vmap_method="broadcast_all")

    def plain(theta: jax.Array) -> jax.Array:
        value: jax.Array = call(value_there, theta, (model.size,))
        return value

    core = jax.custom_jvp(plain)

    def rule(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (theta,), (turn,) = primals, tangents
        value, slopes = call(value_and_slopes_there, theta, (model.size,), (model.size, len(model.names)))
        return value, jnp.einsum("...qm,...m->...q", slopes, turn)

    core.defjvp(rule)

    def stack(columns: list[Any]) -> jax.Array:
        arrays = [jnp.asarray(column) for column in columns]
        dtype = jnp.result_type(float, *arrays)
        return jnp.stack([array.astype(dtype) for array in jnp.broadcast_arrays(*arrays)], axis=-1)

    def apply(values: Mapping[str, Any]) -> dict[str, jax.Array]:
        theta = model.theta(values, stack)
        return model.split(core(theta))

    return apply
