"""Large work on engines that exist: one of three workers is killed on the way; nothing is lost or doubled."""

from __future__ import annotations

import importlib.util
import os
import signal
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import rodsweep


def example(root: Path, name: str) -> ModuleType:
    """A script of the examples as a module."""
    spec = importlib.util.spec_from_file_location(name, root / "python/examples" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def sweep(p6: rodsweep.Scene) -> rodsweep.Sweep:
    axes = {f"coil.current.{axis}": (-0.2, 0.2) for axis in "xyz"}
    return rodsweep.Sweep(p6, "sobol", axes, samples=2**17, derivatives="coil.current")


def check(results: rodsweep.Results, sweep: rodsweep.Sweep) -> None:
    status = results.status()
    assert status["complete"] and not status["damaged"]
    table = results.table(["sample", "tip.position.x", "tip.position.z"])
    assert np.array_equal(table["sample"], np.arange(len(sweep)))
    whole = sweep.run(engine="cpu", spot_check=False).table
    for name in ("tip.position.x", "tip.position.z"):
        assert table[name].tobytes() == whole[name].tobytes()


def parts_in(directory: Path) -> int:
    return len(list(directory.glob("part-*.parquet")))


def test_dask(p6: rodsweep.Scene, root: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    recipe = example(root, "dask_shards")
    directory, killed = tmp_path / "out", []
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            # Tasks name their module, which the workers do not have.
            run_shard: Any = recipe.run_shard
            run_shard.__module__ = "__main__"

            def kill() -> None:
                while parts_in(directory) < 6:
                    time.sleep(0.01)
                busy = [address for address, tasks in client.processing().items() if tasks]
                pid = client.run(os.getpid, workers=busy[:1])[busy[0]]
                killed.append(pid)
                os.kill(pid, signal.SIGKILL)

            killer = threading.Thread(target=kill)
            killer.start()
            results = recipe.run_on(client, sweep(p6), str(directory), shards=12)
            killer.join()
    assert killed, "no worker was killed"
    check(results, sweep(p6))


def busy_workers(mark: str) -> list[int]:
    """Processes of this test's cluster that run a shard."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            is_busy = (folder / "cmdline").read_bytes().startswith(b"ray::run_shard")
            if is_busy and mark.encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def test_ray(p6: rodsweep.Scene, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed")
    recipe = example(root, "ray_shards")
    directory, killed = tmp_path / "out", []
    monkeypatch.setenv("RODSWEEP_TEST_CLUSTER", str(tmp_path))
    ray.init(num_cpus=3, include_dashboard=False)
    try:

        def kill() -> None:
            while parts_in(directory) < 6 or not (busy := busy_workers(str(tmp_path))):
                time.sleep(0.002)
            os.kill(busy[0], signal.SIGKILL)
            killed.append(busy[0])

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        results = recipe.run_on(sweep(p6), str(directory), shards=12)
        killer.join(timeout=1)
    finally:
        ray.shutdown()
    assert killed, "no worker was killed"
    check(results, sweep(p6))
