"""Rows as pandas, xarray, MATLAB and files have them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodsweep


@pytest.fixture(scope="module")
def solution(p6: rodsweep.Scene) -> rodsweep.Solution:
    """Some rows, one of them without a rod."""
    values = {"coil.current.x": np.linspace(-0.1, 0.1, 5), "insertion": [0.09, 0.091, -0.1, 0.092, 0.093]}
    return rodsweep.solve(p6, values, wrt=["coil.current", "insertion"], engine="cpu")


@pytest.fixture(scope="module")
def grid(p6: rodsweep.Scene) -> rodsweep.Run:
    """A grid of two axes."""
    axes = {"coil.current.x": ("-100 mA", "100 mA", 5), "insertion": ("90 mm", "94 mm", 3)}
    return rodsweep.Sweep(p6, "grid", axes, derivatives=["coil.current.x", "insertion"]).run(engine="cpu")


def test_data_frames(solution: rodsweep.Solution, grid: rodsweep.Run) -> None:
    pandas = pytest.importorskip("pandas")
    frame = solution.to_pandas()
    assert len(frame) == 5 and frame["status"].tolist() == solution.status_name.tolist()
    assert np.array_equal(frame["tip.position.z"], solution.tip_position[:, 2], equal_nan=True)
    assert np.array_equal(frame["d(tip.rotation.y)/d(insertion)"], solution.jacobian[:, 4, 3], equal_nan=True)
    assert frame.attrs["units"]["d(tip.position.x)/d(insertion)"] == "m/m"
    assert frame.attrs["units"]["coil.current.x"] == "A"
    # Names and units are those of result files.
    rows = grid.to_pandas()
    assert set(rows.columns) <= set(frame.columns)
    assert {n: u for n, u in rows.attrs["units"].items()} == {n: frame.attrs["units"][n] for n in rows.attrs["units"]}
    # Plain constructors.
    plain = pandas.DataFrame(grid.table)
    assert list(plain.columns) == grid.table.columns and len(plain) == 15
    for name in grid.table.columns:
        assert plain[name].tolist() == grid.table[name].tolist()
    assert pandas.DataFrame(dict(grid.table)).equals(rows)
    assert rows["tip.position.x"].dtype == np.float64 and rows["sample"].dtype.kind == "u"


def test_rows_and_columns_of_a_table(grid: rodsweep.Run) -> None:
    table = grid.table
    rows = list(table)
    assert len(rows) == len(table) and rows[3]._fields == tuple(table.columns)
    assert rows[3][table.columns.index("tip.position.y")] == table["tip.position.y"][3]
    assert list(dict(table)) == table.keys() == table.columns
    assert "d_tip_position_x_d_coil_current_x" in table.to_dict(plain=True)
    for package in ("polars", "pyarrow"):
        module = pytest.importorskip(package)
        other = module.DataFrame(table) if package == "polars" else module.table(table)
        assert other.shape == table.shape


def test_grids_have_their_axes_as_dimensions(grid: rodsweep.Run) -> None:
    pytest.importorskip("xarray")
    data = grid.to_xarray()
    assert dict(data.sizes) == {"coil.current.x": 5, "insertion": 3, "axis": 3, "parameter": 2}
    assert np.allclose(data["coil.current.x"], [-0.1, -0.05, 0, 0.05, 0.1]) and data["insertion"].attrs["units"] == "m"
    assert data["tip.position"].dims == ("coil.current.x", "insertion", "axis")
    assert data["tip.position"].attrs["units"] == "m"
    assert data["d(tip.position)"].attrs["units"] == ["m/A", "m/m"]
    table = grid.table
    for row in range(len(table)):
        at = {name: table[name][row] for name in ("coil.current.x", "insertion")}
        here = data.sel(at)
        assert int(here["sample"]) == row and str(here["status"].item()) == table["status"][row]
        assert here["tip.position"].sel(axis="y").item() == table["tip.position.y"][row]
        slope = here["d(tip.rotation)"].sel(axis="z", parameter="insertion").item()
        assert slope == table["d(tip.rotation.z)/d(insertion)"][row]


def test_data_sets_of_other_rows(p6: rodsweep.Scene, root: Path, tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    sweep = rodsweep.Sweep.from_file(root / "sweeps/workspace.toml")
    run = sweep.run(tmp_path / "out", limit=200, engine="cpu")
    for data in (run.to_xarray(), rodsweep.Results.open(tmp_path / "out").to_xarray()):
        assert data.sizes["sample"] == 200 and data["tip.position"].dims == ("sample", "axis")
        assert np.array_equal(data["coil.current.y"], run.table["coil.current.y"])
        assert "coil.current.y" in data.coords and data["sample"].values.tolist() == list(range(200))
    branches = rodsweep.Scene.from_file(root / "sweeps/scenes/tip_coil.toml")
    found = rodsweep.solve(branches, {"coil.current.x": [-0.1, 0.08]}, engine="cpu", all_branches=True)
    data = found.to_xarray()
    assert data.sizes["row"] == len(found) and data["energy"].attrs["units"] == "J"
    assert data["sample"].values.tolist() == found.sample.tolist()
    assert np.array_equal(found.to_pandas()["energy"], found.energy)
    rows = rodsweep.Results.open(tmp_path / "out").to_pandas("tip.position.x")
    assert list(rows.columns) == ["tip.position.x"] and len(rows) == 200


def test_data_sets_of_solutions(p6: rodsweep.Scene, solution: rodsweep.Solution) -> None:
    pytest.importorskip("xarray")
    data = solution.to_xarray()
    assert data["jacobian"].dims == ("sample", "pose", "parameter")
    assert np.array_equal(
        data["jacobian"].sel(pose="rotation.x", parameter="insertion"), solution.jacobian[:, 3, 3], equal_nan=True
    )
    assert data["insertion"].dims == ("sample",) and data["insertion"].attrs["units"] == "m"
    current, insertion = np.linspace(-0.1, 0.1, 4)[:, None], np.linspace(0.09, 0.094, 3)
    grid = rodsweep.solve(p6, {"coil.current.x": current, "insertion": insertion, "coil.current.y": 0.01}, engine="cpu")
    data = grid.to_xarray()
    assert data["tip_position"].dims == ("coil.current.x", "insertion", "axis")
    assert np.array_equal(data.indexes["coil.current.x"], current[:, 0])
    one = data["tip_position"].sel({"coil.current.x": current[2, 0], "insertion": insertion[1], "axis": "x"})
    assert one.item() == grid.tip_position[2, 1, 0]
    # Two parameters along one axis have no common name; they are coordinates of it.
    both = rodsweep.solve(
        p6, {"coil.current": np.random.default_rng(0).uniform(-0.1, 0.1, (4, 1, 3)), "insertion": insertion}
    )
    data = both.to_xarray()
    assert data["status"].dims == ("axis_0", "insertion") and data["coil.current.x"].dims == ("axis_0",)
    assert rodsweep.solve(p6, engine="cpu").to_xarray()["tip_position"].dims == ("axis",)


def test_matlab_takes_them(solution: rodsweep.Solution, grid: rodsweep.Run, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    io.savemat(tmp_path / "tips.mat", solution.to_dict())
    found = io.loadmat(tmp_path / "tips.mat")
    assert np.array_equal(found["jacobian"], solution.jacobian, equal_nan=True)
    assert np.array_equal(found["coil_current_x"].ravel(), solution.values["coil.current.x"])
    assert [word.strip() for word in found["status_name"]] == solution.status_name.tolist()
    io.savemat(tmp_path / "run.mat", grid.table.to_dict(plain=True))
    found = io.loadmat(tmp_path / "run.mat")
    assert np.array_equal(found["d_tip_position_x_d_insertion"].ravel(), grid.table["d(tip.position.x)/d(insertion)"])


def test_files(solution: rodsweep.Solution, grid: rodsweep.Run, tmp_path: Path) -> None:
    solution.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert np.array_equal(arrays["tip_position"], solution.tip_position, equal_nan=True)
        assert arrays["status_name"].tolist() == solution.status_name.tolist()
        assert arrays["wrt"].tolist() == solution.wrt
    solution.save(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert len(lines) == 6 and lines[0].split(",")[:3] == ["sample", "coil.current.x", "insertion"]
    parquet = pytest.importorskip("pyarrow.parquet")
    solution.save(str(tmp_path / "a.parquet"))
    table = parquet.read_table(tmp_path / "a.parquet")
    assert table["tip.position.x"].to_numpy()[0] == solution.tip_position[0, 0]
    assert table.schema.field("tip.position.x").metadata[b"unit"] == b"m"
    for name in ("b.npz", "b.csv", "b.parquet"):
        grid.table.save(tmp_path / name)
    with np.load(tmp_path / "b.npz") as arrays:
        assert arrays["tip.position.x"].tobytes() == grid.table["tip.position.x"].tobytes()
    with pytest.raises(rodsweep.InputError, match=r"\.csv, \.npz, \.parquet") as error:
        solution.save(tmp_path / "a.xlsx")
    assert error.value.key == "path"
    for name in ("b.npz", "b.csv"):
        with pytest.raises(rodsweep.ResultsError, match="none"):
            solution.save(tmp_path / "none" / name)


def test_none_of_them_is_needed(tmp_path: Path) -> None:
    code = """
import sys
for name in ("pandas", "xarray", "tqdm", "pint", "astropy"):
    sys.modules[name] = None
import rodsweep
scene = rodsweep.Scene.from_dict({"segment": [{"name": "rod", "kind": "flexible", "length": 0.1,
    "stiffness": {"bending": 1e-5, "torsion": 1e-5}}]})
solution = rodsweep.solve(scene, {"loads.tip_force.y": [0, 1e-3]}, engine="cpu", progress=True)
for method in (solution.to_pandas, solution.to_xarray, solution.table.to_pandas):
    try:
        method()
    except ImportError as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.count("pip install") == 3 and "rodsweep[xarray]" in done.stdout
    assert "2 of 2 samples" in done.stderr


def test_progress_everywhere(p6: rodsweep.Scene, root: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[tuple[Any, ...]] = []
    volume = rodsweep.Sweep.from_file(root / "sweeps/volume.toml")
    errors = rodsweep.Sweep.from_file(root / "sweeps/p6_errors.toml")
    targets = [[0.0, -0.03, 0.085], [0.0, -0.031, 0.085]]
    calls = {
        "solve": lambda p: rodsweep.solve(p6, {"coil.current.x": np.zeros(3000)}, engine="cpu", progress=p),
        "run": lambda p: errors.run(limit=256, engine="cpu", progress=p),
        "workspace": lambda p: volume.workspace(voxel="12 mm", fast=True, engine="cpu", progress=p),
        "sensitivity": lambda p: errors.sensitivity(limit=64, engine="cpu", progress=p),
        "control": lambda p: rodsweep.control(
            p6, targets, inputs={"coil.current": 0.3}, in_order=False, engine="cpu", progress=p
        ),
    }
    for name, call in calls.items():
        heard.clear()
        call(lambda *told: heard.append(told))
        assert heard, name
        assert all(len(told) in (1, 4) for told in heard)
        for tqdm in ("there", "missing"):
            with monkeypatch.context() as patch:
                if tqdm == "missing":
                    for module in ("tqdm", "tqdm.auto"):
                        patch.setitem(sys.modules, module, None)
                call(True)
            shown = capsys.readouterr()
            assert not shown.out and len(shown.err) > 5, (name, tqdm)
            assert ("rodsweep: " in shown.err) == (tqdm == "missing")
    with pytest.raises(rodsweep.InputError, match="progress"):
        rodsweep.solve(p6, progress="yes")  # type: ignore[arg-type]
