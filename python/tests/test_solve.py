"""Solutions: shapes of arrays, memory, derivatives, pickles, texts."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import rodsweep
from rodsweep import Status


def test_shapes_follow_the_values(p6: rodsweep.Scene) -> None:
    one = rodsweep.solve(p6, {"coil.current.x": 0.1}, wrt="coil.current", engine="cpu")
    assert one.tip_position.shape == (3,)
    assert one.jacobian.shape == (6, 3)
    assert one.status.shape == ()
    assert one.shape(5).position.shape == (5, 3)
    many = rodsweep.solve(
        p6, {"coil.current": np.zeros((4, 1, 3)), "insertion": [0.09, 0.095]}, wrt="insertion", engine="cpu"
    )
    assert many.tip_position.shape == (4, 2, 3)
    assert many.jacobian.shape == (4, 2, 6, 1)
    assert many.shape(3, wrt=True).position_jacobian.shape == (4, 2, 3, 3, 1)
    none = rodsweep.solve(p6, {"coil.current.x": np.zeros(0)}, wrt="coil.current", engine="cpu")
    assert none.tip_position.shape == (0, 3)
    assert none.jacobian.shape == (0, 6, 3)
    assert none.shape(3).position.shape == (0, 3, 3)
    assert rodsweep.solve(p6, engine="cpu").ok


def test_arrays_are_views_of_one_block(p6: rodsweep.Scene) -> None:
    solution = rodsweep.solve(p6, {"coil.current.x": np.linspace(0, 0.1, 9)}, wrt="coil.current", engine="cpu")
    for array in (solution.tip_position, solution.jacobian, solution.stability_margin, solution.base_moment):
        assert np.shares_memory(array, solution._block)
    assert np.from_dlpack(solution.tip_position).shape == (9, 3)


def test_derivatives_are_those_of_differences(rod: rodsweep.Scene) -> None:
    names = ["loads.tip_force", "insertion", "rod.rest_curvature", "base.rotation"]
    solution = rodsweep.solve(rod, wrt=names, tolerance=1e-11, engine="cpu")
    start = {parameter.name: parameter.value for parameter in rod.parameters()}
    for k, name in enumerate(solution.wrt):
        step = 1e-5 * max(abs(start[name]), 1e-4 if "force" in name else 1.0)
        pair = rodsweep.solve(
            rod, {name: start[name] + step * np.array([-1.0, 1.0])}, tolerance=1e-11, method=solution.method
        )
        assert np.allclose(
            np.diff(pair.tip_position, axis=0)[0] / (2 * step), solution.jacobian[:3, k], rtol=1e-6, atol=1e-8
        )
        turn = pair.tip_matrix[1] @ pair.tip_matrix[0].T
        w = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * step)
        assert np.allclose(w, solution.jacobian[3:, k], rtol=1e-5, atol=1e-6), name
    assert np.array_equal(solution.d("tip_position", "insertion"), solution.jacobian[:3, 3])
    assert np.array_equal(solution.d("tip_rotation", "loads.tip_force"), solution.jacobian[3:, :3])


def test_rotations_agree(p6: rodsweep.Scene) -> None:
    scipy = pytest.importorskip("scipy.spatial.transform")
    values = np.random.default_rng(0).uniform(-0.2, 0.2, (20, 3))
    solution = rodsweep.solve(p6, {"coil.current": values}, engine="cpu")
    rotation = scipy.Rotation.from_rotvec(solution.tip_rotation)
    assert np.allclose(solution.tip_matrix, rotation.as_matrix(), atol=1e-14)
    assert np.allclose(np.abs((solution.tip_quaternion * rotation.as_quat()).sum(axis=1)), 1, atol=1e-14)
    shape = solution.shape(9)
    assert np.allclose(shape.position[:, -1], solution.tip_position, atol=2e-7)
    assert np.allclose(shape.rotation[:, -1], solution.tip_matrix, atol=2e-5)
    assert np.allclose(shape.position[:, 0], 0)


def test_slopes_of_the_shape_are_those_of_differences(rod: rodsweep.Scene) -> None:
    names = ["loads.tip_force.x", "insertion"]
    solution = rodsweep.solve(rod, wrt=names, tolerance=1e-12, engine="cpu")
    shape = solution.shape(7, wrt=True)
    start = {parameter.name: parameter.value for parameter in rod.parameters()}
    for k, name in enumerate(names):
        step = 1e-4 * abs(start[name])
        pair = rodsweep.solve(rod, {name: start[name] + step * np.array([-1.0, 1.0])}, tolerance=1e-12, engine="cpu")
        slope = np.diff(pair.shape(7).position, axis=0)[0] / (2 * step)
        assert np.allclose(slope, shape.position_jacobian[..., k], rtol=1e-5, atol=1e-7), name


def test_nan_only_where_there_is_no_equilibrium(root: Path) -> None:
    scene = rodsweep.Scene.from_file(root / "sweeps/scenes/tip_coil.toml")
    current, insertion = np.linspace(-0.5, 0.5, 100), np.where(np.arange(100) % 7 == 3, -0.1, 0.15)
    values = {"coil.current.x": current, "insertion": insertion}
    solution = rodsweep.solve(scene, values, wrt="coil.current", engine="cpu")
    assert (solution.converged == (insertion > 0)).all(), "a rod cannot have a length below zero"
    assert (solution.status[insertion < 0] == Status.BAD_PARAMETER).all()
    assert np.isnan(solution.tip_position[~solution.converged]).all()
    for array in (solution.tip_position, solution.tip_rotation, solution.jacobian, solution.tip_matrix):
        assert np.isfinite(array[solution.converged]).all()
    assert sum(solution.counts.values()) == 100
    assert (solution.status == Status.FOLD).sum() == solution.counts.get(Status.FOLD, 0)
    assert np.isnan(solution.shape(3).position[~solution.converged]).all()


def test_everything_pickles(p6: rodsweep.Scene, root: Path) -> None:
    solution = rodsweep.solve(p6, {"coil.current.x": np.linspace(0, 0.1, 9)}, wrt="coil.current", engine="cpu")
    again = pickle.loads(pickle.dumps(solution))
    assert np.array_equal(again.jacobian, solution.jacobian)
    assert again.scene == p6 and again.method == solution.method
    assert np.array_equal(again.shape(3).position, solution.shape(3).position)
    for name in ("workspace", "lap", "p6_errors"):
        sweep = rodsweep.Sweep.from_file(root / f"sweeps/{name}.toml")
        assert pickle.loads(pickle.dumps(sweep)) == sweep
    run = rodsweep.Sweep.from_file(root / "sweeps/lap.toml").run(limit=20, engine="cpu")
    table = pickle.loads(pickle.dumps(run)).table
    assert table.columns == run.table.columns and table.units == run.table.units
    assert table["status"].tolist() == run.table["status"].tolist()
    assert table["tip.position.x"].tobytes() == run.table["tip.position.x"].tobytes()
    with pytest.raises(rodsweep.InputError) as error:
        p6.components("coil.curent")
    assert pickle.loads(pickle.dumps(error.value)).key == "coil.curent"


def test_texts_and_pictures(p6: rodsweep.Scene, root: Path) -> None:
    solution = rodsweep.solve(p6, {"coil.current.x": np.linspace(0, 0.1, 9)}, wrt="coil.current", engine="cpu")
    assert "9 rows (" in repr(solution)
    assert "<svg" in solution._repr_html_() and "<svg" in p6._repr_html_()
    assert "<svg" in solution.shape(5)._repr_html_()
    assert p6.figure("svg").startswith(b"<svg") or b"<svg" in p6.figure("svg")[:200]
    sweep = rodsweep.Sweep.from_file(root / "sweeps/workspace.toml")
    assert repr(sweep) == "<Sweep: 226,981 samples, grid over coil.current.x, coil.current.y, coil.current.z>"
    assert "coil.current.x" in sweep._repr_html_()
    run = sweep.run(limit=100, engine="cpu")
    assert sum(run.counts.values()) == 100 and next(iter(run.counts)) in repr(run)
    assert "<table" in run._repr_html_()


def test_threads_do_not_change_a_bit(p6: rodsweep.Scene) -> None:
    values = {"coil.current": np.random.default_rng(3).uniform(-0.3, 0.3, (3000, 3))}
    alone = rodsweep.solve(p6, values, wrt="coil.current", engine="cpu", threads=1)
    together = rodsweep.solve(p6, values, wrt="coil.current", engine="cpu")
    assert np.array_equal(alone._block, together._block, equal_nan=True)

    def again(_: int) -> np.ndarray:
        return rodsweep.solve(p6, values, wrt="coil.current", engine="cpu")._block

    with ThreadPoolExecutor(4) as pool:
        for block in pool.map(again, range(8)):
            assert np.array_equal(block, alone._block, equal_nan=True)


def test_method_and_spot_check(p6: rodsweep.Scene) -> None:
    first = rodsweep.solve(p6, {"coil.current.x": [0.0, 0.1]}, engine="cpu", spot_check=True)
    assert first.spot_check is not None
    assert first.method is not None and first.method["engine"] == "cpu"
    second = rodsweep.solve(p6, {"coil.current.x": 0.1}, method=first.method)
    assert np.array_equal(second.tip_position, first.tip_position[1])
    with pytest.raises(rodsweep.InputError, match="precision"):
        rodsweep.solve(p6, method=first.method, precision="f32", engine="cpu")


def test_progress_is_told(p6: rodsweep.Scene, root: Path) -> None:
    seen: list[tuple[int, int, int, float]] = []
    rodsweep.solve(p6, {"coil.current.x": np.zeros(5000)}, engine="cpu", progress=lambda *told: seen.append(told))
    assert seen and seen[-1][0] == 5000 and seen[-1][1] == 5000
    tqdm = pytest.importorskip("tqdm")
    assert tqdm
    rodsweep.Sweep.from_file(root / "sweeps/lap.toml").run(engine="cpu", progress=True)

    def refuses(*_: object) -> None:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        rodsweep.solve(p6, {"coil.current.x": np.zeros(200_000)}, engine="cpu", progress=refuses)


def test_scenes_from_dictionaries(p6: rodsweep.Scene) -> None:
    assert rodsweep.Scene.from_toml(p6.to_toml()) == p6
    assert len({p6, rodsweep.Scene.from_toml(p6.to_toml())}) == 1
    names = [parameter.name for parameter in p6.parameters()]
    assert "coil.current.x" in names and "insertion" in names
    other = p6.with_values({"coil.current": "50 mA", "insertion": 0.09})
    values = {parameter.name: parameter.value for parameter in other.parameters()}
    assert values["coil.current.y"] == 0.05 and values["insertion"] == pytest.approx(0.09)
    text = rodsweep.solve(p6, {"coil.current.x": "100 mA"}, engine="cpu")
    number = rodsweep.solve(p6, {"coil.current.x": 0.1}, engine="cpu")
    assert np.array_equal(text.tip_position, number.tip_position)


def test_reference_and_seconds(p6: rodsweep.Scene) -> None:
    fast = rodsweep.solve(p6, {"coil.current.x": [0.0, 0.1]}, engine="cpu", tolerance=1e-9)
    slow = rodsweep.solve(p6, {"coil.current.x": [0.0, 0.1]}, engine="reference", tolerance=1e-9)
    assert np.allclose(fast.tip_position, slow.tip_position, atol=1e-10)
    assert fast.seconds > 0


def test_the_word_mixed_means_f64(p6):
    with pytest.warns(DeprecationWarning, match="mixed precision was taken out"):
        mixed = rodsweep.solve(p6, engine="cpu", precision="mixed")
    double = rodsweep.solve(p6, engine="cpu", precision="f64")
    assert np.array_equal(mixed.tip_position, double.tip_position)
