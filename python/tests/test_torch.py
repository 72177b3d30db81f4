"""The bridge to PyTorch. Without PyTorch these tests are skipped, and pytest says so."""

from __future__ import annotations

import numpy as np
import pytest

import rodsweep

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

import rodsweep.torch  # noqa: E402

FORCE = torch.tensor([1e-4, 3e-4, -2e-4], dtype=torch.float64)


@pytest.mark.parametrize("output", ["tip_position", "tip_rotation", "tip_matrix", "shape", "stability_margin"])
def test_gradients(rod: rodsweep.Scene, output: str) -> None:
    f = rodsweep.torch.function(rod, ["loads.tip_force", "insertion"], outputs=output, n_points=4, tolerance=1e-12)

    def scaled(x: torch.Tensor) -> torch.Tensor:
        return f({"loads.tip_force": FORCE * x[..., :3], "insertion": 0.1 * x[..., 3]})[output]

    ones = torch.ones(2, 4, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(scaled, (ones,), eps=1e-4, atol=1e-5, rtol=1e-5)


def test_values_and_vmap(rod: rodsweep.Scene) -> None:
    f = rodsweep.torch.function(rod, "loads.tip_force")
    forces = FORCE * torch.linspace(0, 1, 20, dtype=torch.float64)[:, None]
    tip = lambda force: f({"loads.tip_force": force})["tip_position"]
    batch = tip(forces)
    expected = rodsweep.solve(rod, {"loads.tip_force": forces.numpy()}, tolerance=1e-9)
    assert np.allclose(batch.numpy(), expected.tip_position, atol=1e-12)
    assert torch.allclose(torch.vmap(tip)(forces), batch)
    assert torch.func.vmap(torch.func.jacrev(tip))(forces).shape == (20, 3, 3)
    with torch.no_grad():
        assert torch.allclose(tip(forces), batch)


def test_no_equilibrium_gives_nan(rod: rodsweep.Scene) -> None:
    f = rodsweep.torch.function(rod, "insertion")
    lengths = torch.tensor([0.1, -1.0], dtype=torch.float64, requires_grad=True)
    f({"insertion": lengths})["tip_position"][:, 2].sum().backward()
    assert torch.isfinite(lengths.grad[0]) and torch.isnan(lengths.grad[1])
