"""A wall that the tip presses: forces as targets and as measurements."""

from __future__ import annotations

import numpy as np
import pytest

import rodsweep

EI = 6.136e-4
LENGTH = 0.1


@pytest.fixture(scope="module")
def wire() -> rodsweep.Scene:
    """A straight wire along z beside a plane that pushes it towards -x."""
    return rodsweep.Scene.from_dict({
        "segment": [{
            "name": "wire", "kind": "flexible", "length": LENGTH, "stiffness": {"bending": EI, "torsion": EI},
        }],
        "wall": {"kind": "plane", "normal": [-1, 0, 0], "position": ["1 mm", 0, 0], "stiffness": "300 N/m"},
    })


@pytest.mark.parametrize("in_order", [True, False])
def test_a_force_is_reached(wire: rodsweep.Scene, in_order: bool) -> None:
    forces = np.array([1e-3, 2e-3, 3.5e-3])
    found = rodsweep.control(
        wire, np.zeros((3, 3)), normal_forces=forces, coordinates="normal_force",
        inputs={"wall.position.x": (-0.02, 0.001)}, in_order=in_order, tolerance=1e-9,
    )
    assert found.missed == 0
    assert np.allclose(found.normal_force, forces, rtol=1e-5, atol=0)
    again = rodsweep.solve(wire, {"wall.position.x": found.values[:, 0]})
    assert np.allclose(again.contact.normal_force, forces, rtol=1e-5, atol=0)
    # A beam, in series with the tissue.
    pushed = forces * LENGTH**3 / (3 * EI) + forces / 300
    assert np.allclose(-found.values[:, 0], pushed, rtol=5e-3)
    one = rodsweep.control(
        wire, [[0, 0, 0]], normal_forces="2 mN", coordinates=["normal_force"], inputs={"wall.position.x": (-0.02, 0.001)},
        tolerance=1e-9,
    )
    assert np.allclose(one.values, found.values[1], rtol=1e-5, atol=0)


def test_the_stiffness_of_tissue_is_fitted_from_forces(wire: rodsweep.Scene) -> None:
    places = np.linspace(-0.008, -0.002, 7)
    truth = wire.with_values({"wall.stiffness": 41.0})
    solution = rodsweep.solve(truth, {"wall.position.x": places})
    forces = np.array(solution.contact.normal_force)
    assert (forces > 0).all()
    found = rodsweep.fit(wire, values={"wall.position.x": places}, normal_forces=forces, free="wall.stiffness")
    assert found.converged
    assert found.value == pytest.approx([41.0], rel=1e-6)
    # Beside tips that were seen, with a force that was not measured, and with the noise of the gauge.
    forces[2] = np.nan
    found = rodsweep.fit(
        wire, solution.tip_position, values={"wall.position.x": places}, normal_forces=forces, free="wall.stiffness",
        noise="0.1 mm", force_noise="0.1 mN",
    )
    assert found.value == pytest.approx([41.0], rel=1e-6)
    assert found.deviation[0] > 0


def test_mistakes_are_named(wire: rodsweep.Scene) -> None:
    free = rodsweep.Scene.from_dict({
        "segment": [{"name": "wire", "kind": "flexible", "length": 0.1, "stiffness": {"bending": EI, "torsion": EI}}],
    })
    limits = {"loads.tip_force.x": "2 mN"}
    with pytest.raises(rodsweep.InputError, match=r"no wall .*add \[wall\]"):
        rodsweep.control(free, [[0, 0, 0.1]], normal_forces=1e-3, inputs=limits)
    with pytest.raises(rodsweep.InputError, match=r"normal_forces.*no wall"):
        rodsweep.fit(free, [[0, 0, 0.1]], normal_forces=[1e-3], free="wire.rest_curvature.x")
    inputs = {"wall.position.x": (-0.02, 0.001)}
    with pytest.raises(rodsweep.InputError, match="does not pull"):
        rodsweep.control(wire, [[0, 0, 0]], normal_forces=-1e-3, coordinates="normal_force", inputs=inputs)
    with pytest.raises(rodsweep.InputError, match="no normal force"):
        rodsweep.control(wire, [[0, 0, 0]], coordinates="normal_force", inputs=inputs)
    with pytest.raises(rodsweep.InputError, match="normal_forces.*not finite"):
        rodsweep.control(wire, [[0, 0, 0]], normal_forces=np.nan, coordinates="normal_force", inputs=inputs)
    with pytest.raises(rodsweep.InputError, match=r"normal_forces.*shape \(2,\)"):
        rodsweep.control(wire, [[0, 0, 0]], normal_forces=[1e-3, 2e-3], coordinates="normal_force", inputs=inputs)
    with pytest.raises(rodsweep.InputError, match=r"normal_forces.*for 2 shapes"):
        rodsweep.fit(wire, [[0, 0, 0.1], [0, 0, 0.1]], normal_forces=[1e-3], free="wall.stiffness")
    with pytest.raises(rodsweep.InputError, match="positions.*missing"):
        rodsweep.fit(wire, free="wall.stiffness")
    with pytest.raises(rodsweep.InputError, match="point.*measured force"):
        rodsweep.fit(wire, normal_forces=[np.nan], free="wall.stiffness")
    with pytest.raises(rodsweep.InputError, match="force_noise"):
        rodsweep.fit(wire, normal_forces=[1e-3], free="wall.stiffness", force_noise=-1.0)
