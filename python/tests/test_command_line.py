"""Rows of Python are those of the command line, bit for bit; studies give the same numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodsweep

SWEEPS = ["workspace", "insertion", "stiffness", "lap", "two_coil", "p6_errors", "p6_calibration", "branches", "volume"]
CPU = ["--backend", "cpu", "--quiet", "--no-figures"]


def assert_same_bits(ours: rodsweep.Table, theirs: rodsweep.Table) -> None:
    """Every column of two tables."""
    assert ours.columns == theirs.columns
    assert ours.units == theirs.units
    for name in ours.columns:
        a, b = ours[name], theirs[name]
        assert a.dtype.kind == b.dtype.kind and a.shape == b.shape, name
        same = a.tobytes() == b.tobytes() if a.dtype.kind in "fui" else a.tolist() == b.tolist()
        assert same, name


@pytest.mark.parametrize("name", SWEEPS)
def test_rows_of_shipped_sweeps_are_those_of_the_program(name: str, root: Path, program: Any, tmp_path: Path) -> None:
    file = root / "sweeps" / f"{name}.toml"
    limit = 12 if name == "branches" else 300
    program("run", file, "--limit", limit, "--out", tmp_path / "out", *CPU)
    theirs = rodsweep.Results.open(tmp_path / "out").table()
    ours = rodsweep.Sweep.from_file(file).run(limit=limit, engine="cpu")
    assert len(theirs) >= min(limit, len(ours.sweep))
    assert_same_bits(ours.table, theirs)
    # And a directory that Python writes is the program's.
    ours.sweep.run(tmp_path / "mine", limit=limit, engine="cpu")
    assert_same_bits(rodsweep.Results.open(tmp_path / "mine").table(), theirs)
    run = json.loads((tmp_path / "mine/run.json").read_text())
    assert run["run_id"] == json.loads((tmp_path / "out/run.json").read_text())["run_id"]


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_arrays_are_a_table_sweep(precision: str, root: Path, program: Any, tmp_path: Path) -> None:
    """The same values as a file of the command line and as arrays: the same pilot, statuses and bits."""
    generator = np.random.default_rng(1)
    currents = generator.uniform(-0.3, 0.3, (700, 3))
    insertion = generator.uniform(0.09, 0.1, 700)
    lines = [",".join(map(repr, [*map(float, row), float(s)])) for row, s in zip(currents, insertion, strict=True)]
    head = "coil.current.x,coil.current.y,coil.current.z,insertion"
    (tmp_path / "values.csv").write_text("\n".join([head, *lines]) + "\n")
    scene = root / "sweeps/scenes/p6.toml"
    text = f"""scene = "{scene}"
[sampling]
method = "table"
file = "values.csv"
[output]
quantities = ["tip_position", "tip_rotation", "base_curvature", "stability", "error_estimate", "base_moment",
    "residual", "iterations", "load_fraction", "derivative_error"]
derivatives = ["coil.current", "insertion"]
"""
    (tmp_path / "sweep.toml").write_text(text)
    program("run", tmp_path / "sweep.toml", "--out", tmp_path / "out", *CPU, "--precision", precision)
    theirs = rodsweep.Results.open(tmp_path / "out").table()
    ours = rodsweep.solve(
        rodsweep.Scene.from_file(scene),
        {"coil.current": currents, "insertion": insertion},
        wrt=["coil.current", "insertion"],
        engine="cpu",
        precision=precision,
        tolerance=1e-6,
    )
    assert theirs["status"].tolist() == ours.status_name.tolist()
    assert np.array_equal(np.stack([theirs[f"coil.current.{a}"] for a in "xyz"], axis=-1), currents)

    def column(name: str) -> np.ndarray:
        # Single precision widens without loss.
        return theirs[name].astype(np.float64)

    def same(a: np.ndarray, b: np.ndarray) -> bool:
        return np.array_equal(a, b, equal_nan=True)

    for axis, letter in enumerate("xyz"):
        assert same(ours.tip_position[:, axis], column(f"tip.position.{letter}"))
        assert same(ours.tip_rotation[:, axis], column(f"tip.rotation.{letter}"))
        assert same(ours.base_moment[:, axis], column(f"base_moment.{letter}"))
        assert same(ours.base_curvature[:, axis], column(f"base_curvature.{letter}"))
        for k, name in enumerate(ours.wrt):
            assert same(ours.jacobian[:, axis, k], column(f"d(tip.position.{letter})/d({name})"))
            assert same(ours.jacobian[:, 3 + axis, k], column(f"d(tip.rotation.{letter})/d({name})"))
    assert same(ours.stability_margin, column("stability.margin"))
    assert same(ours.error_estimate, column("error_estimate"))
    assert same(ours.derivative_error, column("derivative_error"))
    assert np.all(ours.derivative_error[ours.ok] < 0.1)
    assert same(ours.residual, column("residual"))
    assert same(ours.iterations, column("iterations"))
    assert same(ours.load_fraction, column("load_fraction"))
    assert ours.stable.tolist() == [flag is True or flag is np.True_ or flag == 1 for flag in theirs["stable"].tolist()]


def test_every_branch_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    (tmp_path / "values.csv").write_text("coil.current.x\n-0.1\n0.0\n0.08\n")
    scene = root / "sweeps/scenes/tip_coil.toml"
    text = f'scene = "{scene}"\n[sampling]\nmethod = "table"\nfile = "values.csv"\n[solver]\nbranch = "all"\n'
    (tmp_path / "sweep.toml").write_text(text)
    program("run", tmp_path / "sweep.toml", "--out", tmp_path / "out", *CPU)
    theirs = rodsweep.Results.open(tmp_path / "out").table()
    ours = rodsweep.solve(
        rodsweep.Scene.from_file(scene), {"coil.current.x": [-0.1, 0.0, 0.08]}, engine="cpu", all_branches=True
    )
    assert len(ours) == len(theirs) > 3
    assert ours.sample.tolist() == theirs["sample"].tolist()
    assert ours.branch.tolist() == theirs["branch"].tolist()
    assert np.array_equal(ours.energy, theirs["energy"], equal_nan=True)
    assert np.array_equal(ours.tip_position[:, 2], theirs["tip.position.z"], equal_nan=True)
    assert ours.status_name.tolist() == theirs["status"].tolist()
    assert ours.values["coil.current.x"].tolist() == theirs["coil.current.x"].tolist()


def test_workspace_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    file = root / "sweeps/volume.toml"
    out = program("workspace", file, "--voxel", "8mm", "--out", tmp_path, *CPU, "--json").stdout
    theirs = json.loads(out)
    found = rodsweep.Sweep.from_file(file).workspace(voxel=8e-3, engine="cpu")
    assert found.account == theirs
    assert len(found.voxels) > 100
    files = found.draw(tmp_path / "figures")
    assert files and all(path.stat().st_size > 1000 for path in files)
    reach = found.reach([[0.0, -0.04, 0.08]])
    assert len(reach) == 1


def test_contact_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    file = root / "sweeps/atrial_wall.toml"
    words = ("--voxel", "15mm", "--extent", "30mm", "--robust", "--designs", 2)
    theirs = json.loads(program("contact", file, *words, "--out", tmp_path, *CPU, "--json").stdout)
    found = rodsweep.Sweep.from_file(file).contact(voxel=15e-3, extent="30 mm", designs=2, engine="cpu")
    assert found.account["check"]["checked"] > 0 and found.account["distrusted"] is None
    assert {**found.account, "seconds": 0.0} == {**theirs, "seconds": 0.0}
    assert len(found.points) == theirs["points"] and found.designs is not None and len(found.designs) == 2
    assert all(path.stat().st_size > 1000 for path in found.draw(tmp_path / "figures"))
    with pytest.raises(rodsweep.InputError, match="force") as error:
        rodsweep.Sweep.from_file(file).contact(voxel=10e-3, force=-1.0)
    assert error.value.key == "force"


def test_sensitivity_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    file = root / "sweeps/p6_errors.toml"
    out = program("sensitivity", file, "--limit", 512, "--out", tmp_path / "out", *CPU, "--json").stdout
    theirs = json.loads(out)
    sweep = rodsweep.Sweep.from_file(file)
    found = sweep.sensitivity(limit=512, engine="cpu")
    assert found.account == theirs
    assert {"indices", "moments"} <= set(found.tables)
    assert rodsweep.Results.open(tmp_path / "out").sensitivity(limit=512).account == theirs
    assert found.draw(tmp_path / "figures")


def test_control_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    scene = root / "sweeps/scenes/p6.toml"
    angle = np.linspace(0, 2 * np.pi, 9)
    positions = np.stack([5e-3 * np.cos(angle), -30e-3 + 5e-3 * np.sin(angle), np.full(9, 85e-3)], axis=-1)
    lines = ["x,y,z"] + [",".join(repr(float(x)) for x in row) for row in positions]
    (tmp_path / "targets.csv").write_text("\n".join(lines) + "\n")
    inputs = {"coil.current": 0.3, "insertion": (0.085, 0.1)}
    arguments = ["--input", "coil.current=0.3", "--input", "insertion=85mm..100mm", "--backend", "cpu", "--no-figures"]
    program("control", scene, "--targets", tmp_path / "targets.csv", *arguments, "--out", tmp_path / "out")
    found = rodsweep.control(rodsweep.Scene.from_file(scene), positions, inputs=inputs, in_order=False, engine="cpu")
    lines = (tmp_path / "out/control.csv").read_text().splitlines()
    head, rows = lines[0].split(","), [line.split(",") for line in lines[1:]]
    for k, name in enumerate(found.inputs):
        theirs = [float(row[head.index(name)]) for row in rows]
        assert found.values[:, k].tolist() == theirs, name
    assert found.outcome.tolist() == [row[head.index("status")] for row in rows]
    assert found.table["target.position.x"].tolist() == positions[:, 0].tolist()
    assert found.draw(tmp_path / "figures")


def test_fit_is_that_of_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    scene = rodsweep.Scene.from_file(root / "sweeps/scenes/p6.toml")
    true = scene.with_values({"proximal.rest_curvature.x": 1.2, "proximal.rest_curvature.y": -0.5})
    currents = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.05]])
    points = rodsweep.solve(true, {"coil.current": currents}).shape(4).position[:, 1:]
    at = true.length * np.arange(1, 4) / 3
    head = "s,x,y,z,coil.current.x,coil.current.y,coil.current.z"
    rows = [",".join(repr(float(x)) for x in (at[p], *points[m, p], *currents[m])) for m in range(3) for p in range(3)]
    (tmp_path / "shapes.csv").write_text("\n".join([head, *rows]) + "\n")
    free = ["proximal.rest_curvature.x", "proximal.rest_curvature.y"]
    done = program("fit", root / "sweeps/scenes/p6.toml", tmp_path / "shapes.csv", "--free", ",".join(free), "--json")
    found = rodsweep.fit(scene, points, at, {"coil.current": currents}, free=free)
    assert found.account == json.loads(done.stdout)
    assert np.allclose(found.value, [1.2, -0.5], atol=1e-6)
    assert found.figure()[:4] == b"\x89PNG"
    assert found.scene.parameters() != scene.parameters()
