"""Rods in PyTorch: a function of parameters with gradients.

PyTorch is imported here only. Tensors are on the CPU; double precision is full precision.

>>> import torch
>>> import rodsweep, rodsweep.torch
>>> scene = rodsweep.Scene.from_dict({
...     "segment": [{
...         "name": "rod", "kind": "flexible", "length": 0.1,
...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
...     }],
... })
>>> tip = rodsweep.torch.function(scene, "loads.tip_force")
>>> force = torch.zeros(3, dtype=torch.float64, requires_grad=True)
>>> tip({"loads.tip_force": force})["tip_position"].sum().backward()
>>> force.grad.shape
torch.Size([3])
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch

from ._differentiable import Model
from .scene import Scene

__all__ = ["function"]


class _Solve(torch.autograd.Function):  # type: ignore[misc, unused-ignore]
    """theta (..., m) to y (..., q) and its Jacobian (..., q, m)."""

    @staticmethod
    def forward(theta: Any, model: Model) -> Any:
        value, slopes = model.value_and_slopes(theta.detach().cpu().double().numpy())
        return torch.as_tensor(value).to(theta), torch.as_tensor(slopes).to(theta)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        _, slopes = output
        ctx.mark_non_differentiable(slopes)
        ctx.save_for_backward(slopes)
        ctx.save_for_forward(slopes)

    @staticmethod
    def backward(ctx: Any, by_value: Any, _: Any) -> Any:
        (slopes,) = ctx.saved_tensors
        return torch.einsum("...q,...qm->...m", by_value, slopes), None

    @staticmethod
    def jvp(ctx: Any, turn: Any, _: Any) -> Any:
        (slopes,) = ctx.saved_tensors
        return torch.einsum("...qm,...m->...q", slopes, turn), None

    @staticmethod
    def vmap(info: Any, in_dims: Any, theta: Any, model: Model) -> Any:
        # The mapped axis becomes one of the batch.
        return _Solve.apply(theta.movedim(in_dims[0], 0), model), (0, 0)


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
) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """A differentiable function of some numbers of a scene: dictionary of tensors in, dictionary of tensors out.

    Arguments, outputs and notes are those of :func:`rodsweep.jax.function`: leading axes and ``torch.vmap`` are one
    batch, a sample without equilibrium has NaN values and NaN gradients, there are no second derivatives. Under
    ``torch.no_grad()`` no derivatives are computed.
    """
    options = {"tolerance": tolerance, "engine": engine, "precision": precision, "threads": threads}
    model = Model(scene, parameters, outputs, n_points, options)

    def stack(columns: list[Any]) -> Any:
        tensors = [torch.as_tensor(column) for column in columns]
        dtype = torch.get_default_dtype()
        for tensor in tensors:
            if tensor.is_floating_point():
                dtype = torch.promote_types(dtype, tensor.dtype)
        return torch.stack(torch.broadcast_tensors(*[tensor.to(dtype) for tensor in tensors]), dim=-1)

    def apply(values: Mapping[str, Any]) -> dict[str, Any]:
        theta = model.theta(values, stack)
        if torch.is_grad_enabled():
            flat, _ = _Solve.apply(theta, model)
        else:
            flat = torch.as_tensor(model.value(theta.detach().cpu().double().numpy())).to(theta)
        return model.split(flat)

    return apply
