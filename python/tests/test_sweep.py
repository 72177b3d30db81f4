"""Sweeps built in Python, result directories, Arrow."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import rodsweep

AXES = {"coil.current.x": ("-0.2 A", "0.2 A"), "insertion": (0.085, 0.1)}


def test_a_sweep_built_in_python_is_that_of_a_file(p6: rodsweep.Scene, root: Path, tmp_path: Path) -> None:
    scene = root / "sweeps/scenes/p6.toml"
    (tmp_path / "a.toml").write_text(
        f"""scene = "{scene}"
[sampling]
method = "sobol"
samples = 256
seed = 7
[[axis]]
parameter = "coil.current.x"
from = "-0.2 A"
to = "0.2 A"
[[axis]]
parameter = "insertion"
from = 0.085
to = 0.1
[output]
derivatives = ["coil.current"]
"""
    )
    file = rodsweep.Sweep.from_file(tmp_path / "a.toml")
    built = rodsweep.Sweep(p6, "sobol", AXES, samples=256, seed=7, derivatives="coil.current")
    assert built == file
    assert built.replace(tolerance=1e-8).info["tolerance"] == 1e-8
    assert built.replace(derivatives=["insertion"]).info["derivatives"] == ["insertion"]
    assert built.replace(scene=p6.with_values({"coil.current.y": 0.1})).scene != p6
    values = built.values(0, 4)
    assert values["insertion"].shape == (4,) and built.values()["insertion"].shape == (256,)
    assert np.array_equal(built.run(engine="cpu").table["insertion"], built.values()["insertion"])


def test_sweeps_over_arrays(p6: rodsweep.Scene) -> None:
    values = {"coil.current": np.random.default_rng(0).uniform(-0.2, 0.2, (50, 3)), "insertion": 0.09}
    run = rodsweep.Sweep.from_values(p6, values, derivatives="insertion").run(engine="cpu")
    solution = rodsweep.solve(p6, values, wrt="insertion", engine="cpu")
    assert np.array_equal(run.table["tip.position.x"], solution.tip_position[:, 0])
    assert np.array_equal(run.table["d(tip.position.z)/d(insertion)"], solution.d("tip_position", "insertion")[:, 2])
    assert run.counts == {status.word: count for status, count in solution.counts.items()}


def test_arrow_takes_tables_without_a_copy(root: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    run = rodsweep.Sweep.from_file(root / "sweeps/two_coil.toml").run(limit=200, engine="cpu")
    table = arrow.table(run.table)
    assert table.column_names == run.table.columns
    assert table.num_rows == 200
    assert table.schema.field("tip.position.x").metadata == {b"unit": b"m"}
    x = run.table["tip.position.x"]
    address = table["tip.position.x"].chunk(0).buffers()[1].address
    assert address == x.__array_interface__["data"][0]
    assert not x.flags.writeable
    assert table["tip.position.x"].null_count == np.isnan(x).sum()
    assert arrow.table(run).num_rows == 200
    assert repr(run.table).startswith("<Table: 200 rows, ") and "[A]" in repr(run.table)
    assert run.table._repr_html_().count("<tr>") == 6
    assert "status" in run.table and "x" not in run.table
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(run.table)
    assert frame.shape == run.table.shape
    del run, table
    assert np.isfinite(x).any()


def test_parts_stream(root: Path, tmp_path: Path) -> None:
    sweep = rodsweep.Sweep.from_file(root / "sweeps/workspace.toml")
    run = sweep.run(tmp_path / "out", limit=1000, part_size=300, engine="cpu")
    results = run.results
    parts = results.parts(["sample", "status"])
    assert len(parts) == 4
    assert [len(part) for part in parts] == [300, 300, 300, 100]
    arrow = pytest.importorskip("pyarrow")
    reader = arrow.RecordBatchReader.from_stream(results.parts("tip.position.x"))
    assert sum(batch.num_rows for batch in reader) == 1000
    status = results.status()
    assert status["complete"] and status["samples_done"] == 1000
    assert results.manifest()["complete"]
    assert results.sweep.info["sample_count"] == len(sweep)
    assert results.draw(tmp_path / "figures")
    with pytest.raises(rodsweep.InputError, match="did you mean") as error:
        results.table("tip.position.xx")
    assert error.value.key == "tip.position.xx"
    with pytest.raises(rodsweep.ResultsError, match="already holds a run"):
        sweep.run(tmp_path / "out", limit=1000, part_size=300, engine="cpu")
    again = sweep.run(tmp_path / "out", limit=1000, part_size=300, engine="cpu", resume=True)
    assert again.account["resumed"] == 1000
    with pytest.raises(rodsweep.ResultsError):
        rodsweep.Results.open(tmp_path / "none")


def test_shards_make_one_directory(root: Path, tmp_path: Path) -> None:
    sweep = rodsweep.Sweep.from_file(root / "sweeps/lap.toml")
    shards = sweep.shards(3)
    for shard in shards[::-1]:
        shard.run(tmp_path / "out", engine="cpu")
    shards[1].run(tmp_path / "out", engine="cpu")
    table = rodsweep.Results.open(tmp_path / "out").table()
    whole = sweep.run(engine="cpu").table
    assert table["sample"].tolist() == list(range(len(sweep)))
    assert table["tip.position.x"].tobytes() == whole["tip.position.x"].tobytes()


def run_shard(shard: rodsweep.Shard, directory: str) -> None:
    """In a process of its own."""
    shard.run(directory, engine="cpu", threads=1, spot_check=False)


def test_shards_may_begin_at_the_same_moment(p6: rodsweep.Scene, tmp_path: Path) -> None:
    sweep = rodsweep.Sweep(p6, "sobol", {"coil.current.x": (-0.2, 0.2)}, samples=2**10)
    with ProcessPoolExecutor(4, multiprocessing.get_context("spawn")) as pool:
        for trial in range(6):
            directory = str(tmp_path / f"out{trial}")
            list(pool.map(run_shard, sweep.shards(4), [directory] * 4))
            table = rodsweep.Results.open(directory).table("sample")
            assert np.array_equal(table["sample"], np.arange(len(sweep)))


def test_sensitivity_of_rows_in_memory(root: Path) -> None:
    sweep = rodsweep.Sweep.from_file(root / "sweeps/p6_errors.toml")
    found = sweep.run(limit=512, engine="cpu").sensitivity("tip.position", limit=512)
    assert "tip.position.x" in found.tables["moments"]["output"].tolist()
    assert "Sensitivity" in repr(found) and "<pre>" in found._repr_html_()


def test_a_forked_child_is_told(root: Path) -> None:
    if sys.platform != "linux":
        pytest.skip("only Linux forks")
    code = f"""
import os, rodsweep
scene = rodsweep.Scene.from_file({str(root / "sweeps/scenes/p6.toml")!r})
rodsweep.solve(scene, engine="cpu")
child = os.fork()
if child == 0:
    try:
        rodsweep.solve(scene, engine="cpu")
    except rodsweep.EngineError as error:
        os._exit(7 if "spawn" in str(error) else 8)
    os._exit(9)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "7", done.stderr


def test_laws_of_axes(p6: rodsweep.Scene) -> None:
    axes = {
        "coil.current.x": {"values": [0.1, 0.3, -0.2]},
        "proximal.youngs_modulus": {"spacing": "log", "from": 1e6, "to": 1e8},
        "distal.youngs_modulus": {"distribution": "triangular", "relative": 0.1},
        "insertion": {"distribution": "lognormal", "relative": 0.01},
    }
    sweep = rodsweep.Sweep(p6, "latin_hypercube", axes, samples=30, seed=7)
    assert [axis["distribution"] for axis in sweep.axes] == ["values", "log-uniform", "triangular", "lognormal"]
    shown = sweep._repr_html_()
    assert "0.1, 0.3, -0.2" in shown and "log-uniform, from 1e+06, to 1e+08" in shown and "lognormal, mean" in shown
    rows = sweep.run(engine="cpu").table
    found = np.asarray(rows["coil.current.x"])
    assert sorted(set(found)) == [-0.2, 0.1, 0.3] and all((found == value).sum() == 10 for value in set(found))
    moduli = np.log10(np.asarray(rows["proximal.youngs_modulus"]))
    assert ((moduli < 7).sum(), moduli.min() > 6, moduli.max() < 8) == (15, True, True)
