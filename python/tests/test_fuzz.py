"""Wrong arguments: a Python exception each time that says what is wrong, never an abort."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodsweep

Errors = (rodsweep.RodsweepError, TypeError, MemoryError)

WRONG_VALUES: list[Any] = [
    "ten", "5 kg", "", None, object(), {}, {"a": 1}, [], [[1, 2], [3]], np.array(["a"]), np.array([None]),
    np.array([1 + 2j]), np.array([True]), np.array(["2020"], dtype="M8[D]"), np.nan, np.inf, [0.1, np.nan],
    -np.inf, np.zeros((3, 2)), np.zeros((2, 0)), b"1", 10**400, 1j, set(), lambda: 0, np.zeros(3, dtype="V4"),
    np.array([1], dtype=object), [1, "2"], range(0), slice(3), np.ma.masked,
]  # fmt: skip


@pytest.mark.parametrize("index", range(len(WRONG_VALUES)))
@pytest.mark.parametrize("name", ["coil.current.x", "coil.current", "insertion"])
def test_wrong_values(p6: rodsweep.Scene, name: str, index: int) -> None:
    value = WRONG_VALUES[index]
    try:
        solution = rodsweep.solve(
            p6, {name: value, "coil.current.z" if name != "coil.current" else "insertion": [0.09, 0.09]}, engine="cpu"
        )
    except Errors as error:
        assert str(error)
        if isinstance(error, rodsweep.InputError):
            assert error.key is not None or "memory" in str(error)
    else:
        # What NumPy itself takes for numbers, or no rows at all.
        assert len(solution) == 0 or np.asarray(value).dtype.kind in "fiu", value


@pytest.mark.parametrize(
    ("key", "arguments"),
    [
        ("tolerance", {"tolerance": 0}),
        ("tolerance", {"tolerance": 2}),
        ("tolerance", {"tolerance": float("nan")}),
        ("tolerance", {"tolerance": "small"}),
        ("engine", {"engine": "quantum"}),
        ("engine", {"engine": 3}),
        ("precision", {"precision": "f16"}),
        ("branch", {"branch": "some"}),
        ("threads", {"threads": 0}),
        ("threads", {"threads": -1}),
        ("threads", {"threads": 1.5}),
        ("threads", {"threads": 10**30}),
        ("threads", {"threads": 100_000}),
        ("method", {"method": {"engine": "cpu"}}),
        ("method", {"method": {"engine": object()}}),
        ("coil.curent", {"wrt": "coil.curent"}),
        ("wrt", {"wrt": [3]}),
        ("wrt", {"wrt": 3}),
        ("values", {"values": [1, 2]}),
        ("values", {"values": {3: 1}}),
        ("nothing", {"values": {"nothing": 1}}),
        ("coil.current", {"values": {"coil.current": np.zeros((4, 2))}}),
        ("insertion", {"values": {"coil.current.x": np.zeros(3), "insertion": np.zeros(4)}}),
        ("coil.current.x", {"values": {"coil.current": 0.1, "coil.current.x": 0.1}}),
        ("coil.current.x", {"values": {"coil.current.x": [0.1, np.nan]}}),
        ("proximal.stiffness.torsion", {"values": {"proximal.stiffness.torsion": 1.0}}),
    ],
)
def test_the_key_that_is_wrong_is_named(p6: rodsweep.Scene, key: str, arguments: dict[str, Any]) -> None:
    with pytest.raises(rodsweep.InputError) as error:
        rodsweep.solve(p6, **{"engine": "cpu", **arguments})
    assert error.value.key == key
    assert key in str(error.value)


def test_arrays_of_any_layout(p6: rodsweep.Scene) -> None:
    values = np.random.default_rng(0).uniform(-0.2, 0.2, (12, 3))
    expected = rodsweep.solve(p6, {"coil.current": values}, engine="cpu").tip_position
    layouts = [
        np.asfortranarray(values), values[::-1][::-1], np.repeat(values, 2, axis=0)[::2], values.tolist(),
        np.broadcast_to(values, (12, 3)), values.astype(">f8"), values.astype(np.longdouble), values.astype("f8").T.T,
    ]  # fmt: skip
    for layout in layouts:
        assert np.array_equal(rodsweep.solve(p6, {"coil.current": layout}, engine="cpu").tip_position, expected)
    whole = rodsweep.solve(p6, {"coil.current.x": np.arange(2, dtype=np.int8)}, engine="cpu").tip_position
    assert np.array_equal(whole, rodsweep.solve(p6, {"coil.current.x": [0.0, 1.0]}, engine="cpu").tip_position)


def test_huge_batches_are_refused(p6: rodsweep.Scene) -> None:
    huge = np.broadcast_to(0.0, (2**40,))
    with pytest.raises(rodsweep.InputError, match="1,099,511,627,776 samples"):
        rodsweep.solve(p6, {"coil.current.x": huge}, engine="cpu")
    with pytest.raises(rodsweep.InputError, match="too large for memory"):
        rodsweep.solve(p6, {"coil.current.x": np.broadcast_to(0.0, (2**31, 1)), "insertion": np.zeros(2**20)})
    extreme = rodsweep.solve(p6, {"coil.current.x": [1e300, -1e300, 1e-300], "insertion": [0.09, 1e9, 0.09]})
    assert len(extreme) == 3
    assert np.isnan(extreme.tip_position[~extreme.converged]).all()


def test_wrong_scenes(p6: rodsweep.Scene) -> None:
    wrong: list[Any] = [
        {}, {"segment": []}, {"segment": 3}, {"segment": [{}]}, {"segment": [{"name": "a", "kind": "liquid"}]},
        {"segment": [{"name": "a", "kind": "flexible", "length": -1, "stiffness": 1}]},
        {"segment": [{"name": "a", "kind": "flexible", "length": float("nan"), "stiffness": 1}]},
        {"segment": [{"name": "a", "kind": "flexible", "length": 1, "stiffness": object()}]},
        {"segment": [{"name": 'a"\n', "kind": "flexible", "length": 1}]}, {3: 4}, {"fild": {}}, {"name": "\ud800"},
        {"name": 2**70}, {"segment": {"name": "a"}}, {"loads": {"gravity": [1, 2]}}, 3, None, [("a", 1)],
    ]  # fmt: skip
    for tables in wrong:
        with pytest.raises((rodsweep.InputError, TypeError)) as error:
            rodsweep.Scene.from_dict(tables)
        assert str(error.value)
        assert "<scene>" not in str(error.value)
    for values in (
        {"a": 1},
        {"coil.current": "a lot"},
        {"insertion": -1},
        {"coil.current.x": [1, 2]},
        5,
        {"insertion": np.nan},
    ):
        with pytest.raises(rodsweep.InputError):
            p6.with_values(values)  # type: ignore[arg-type]
    with pytest.raises(rodsweep.ResultsError):
        rodsweep.Scene.from_file("/none.toml")
    for file in (3, None, b"\xff", "a\0b"):
        with pytest.raises((TypeError, ValueError, rodsweep.RodsweepError)):
            rodsweep.Scene.from_file(file)  # type: ignore[arg-type]


def test_errors_of_files_have_a_line(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text('[[segment]]\nname = "a"\nkind = "flexible"\nlenght = "1 m"\n')
    with pytest.raises(rodsweep.InputError) as error:
        rodsweep.Scene.from_file(file)
    assert error.value.line == 4 and error.value.file == str(file)
    assert error.value.key == "segment[0].lenght"


def test_wrong_sweeps(p6: rodsweep.Scene, tmp_path: Path) -> None:
    good = {"coil.current.x": (-0.1, 0.1, 3)}
    sweep = rodsweep.Sweep(p6, "grid", good)
    for arguments in (
        ("gird", good), ("grid", {}), ("grid", {"coil.current.x": 3}), ("grid", {"coil.curent.x": (0, 1, 2)}),
        ("sobol", good), ("table", good), ("grid", {"coil.current.x": (0, 1, -2)}), ("grid", [3]),
        ("grid", {"coil.current.x": (np.nan, 1, 2)}),
    ):  # fmt: skip
        with pytest.raises((rodsweep.InputError, TypeError)):
            rodsweep.Sweep(p6, *arguments)  # type: ignore[arg-type]
    for options in (
        {"limit": 0}, {"shard": "3/2"}, {"shard": "a"}, {"part_size": 0}, {"engine": "x"}, {"progress": 3},
        {"threads": -3}, {"method": {"a": 1}},
    ):  # fmt: skip
        with pytest.raises((rodsweep.InputError, TypeError)):
            sweep.run(**{"engine": "cpu", **options})
    for change in (
        {"tolerance": 3.0},
        {"steps": 0},
        {"branch": "x"},
        {"derivatives": "x"},
        {"quantities": ["x"]},
        {"seed": -1},
    ):
        with pytest.raises(rodsweep.InputError):
            sweep.replace(**change)
    with pytest.raises(rodsweep.InputError):
        sweep.workspace(voxle=1e-3)
    with pytest.raises(rodsweep.InputError):
        sweep.workspace(voxel=-1.0)
    with pytest.raises(rodsweep.InputError):
        sweep.sensitivity(estimator="x", engine="cpu")
    with pytest.raises(rodsweep.InputError):
        sweep.values(5, 2)
    with pytest.raises(rodsweep.InputError):
        sweep.shards(0)


def test_wrong_control_and_fit(p6: rodsweep.Scene) -> None:
    at = [[0.0, -0.03, 0.08]]
    for positions, options in (
        ([[0, 1]], {}), ([[np.nan, 0, 0]], {}), (np.zeros((0, 3)), {}), ("a", {}), (at, {"inputs": {"x": 1}}),
        (at, {"inputs": {"coil.current": (1, 0)}}), (at, {"inputs": {"coil.current": (1, 0, 2)}}),
        (at, {"tolerance": -1.0}),
        (at, {"redundancy": "x"}), (at, {"coordinates": "w"}), (at, {"tangents": [[0, 0, 0]]}), (at, {"inputs": 3}),
        (at, {"tangents": [[0, 0, 1], [0, 0, 1]]}), (at, {"engine": "x"}),
    ):  # fmt: skip
        with pytest.raises((rodsweep.InputError, TypeError)):
            rodsweep.control(p6, positions, **options)  # type: ignore[arg-type]
    for positions, options in (
        ([[0, 1]], {}), ([[np.nan, 0, 0]], {}), (at, {"arc_length": [1.0, 2.0]}), (at, {"arc_length": 5.0}),
        (at, {"free": "x"}), (at, {"noise": -1.0}), (at, {"values": {"coil.current.x": [1.0, 2.0, 3.0]}}),
        (at, {"free": ["insertion", "insertion"]}), (np.zeros((0, 3)), {}),
    ):  # fmt: skip
        with pytest.raises((rodsweep.InputError, TypeError)):
            rodsweep.fit(p6, positions, **options)  # type: ignore[arg-type]


def test_random_arguments(p6: rodsweep.Scene) -> None:
    """A thousand calls of random nonsense end in an answer or an exception of ours."""
    source = random.Random(20)
    names = [
        "coil.current.x",
        "coil.current",
        "insertion",
        "proximal.youngs_modulus",
        "x",
        "",
        "loads.tip_force",
        3,
        None,
    ]
    pieces: list[Any] = [*WRONG_VALUES, 0.1, "90 mm", np.zeros(2), np.zeros((2, 3)), [0.09, 0.1], np.float32(0.1), -5.0]
    refused = 0
    for _ in range(1000):
        values = {source.choice(names): source.choice(pieces) for _ in range(source.randint(0, 3))}
        wrt: Any = source.choice([None, [], "coil.current", "x", 3, ["insertion", "insertion"], ["coil.current", None]])
        try:
            solution = rodsweep.solve(p6, values, wrt, engine="cpu", tolerance=source.choice([1e-6, 1e-3, -1, "a"]))
        except Errors as error:
            refused += 1
            assert str(error)
        else:
            assert solution.jacobian.shape[-1] == len(solution.wrt)
    assert 100 < refused < 1000
