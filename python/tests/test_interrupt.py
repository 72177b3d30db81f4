"""Ctrl-C ends every long call within 0.2 s, and the GIL is free meanwhile."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rodsweep

LIMIT = 0.2


def interrupted(work: Callable[[], object]) -> float:
    """Seconds from Ctrl-C to the exception."""
    sent: list[float] = []

    def send() -> None:
        time.sleep(0.4)
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=send).start()
    with pytest.raises(KeyboardInterrupt):
        work()
    return time.perf_counter() - sent[0]


@pytest.mark.parametrize("engine", ["cpu", "reference"])
def test_solve_is_interrupted(p6: rodsweep.Scene, engine: str) -> None:
    count = 3_000_000 if engine == "cpu" else 3000
    values = {"coil.current": np.random.default_rng(0).uniform(-0.3, 0.3, (count, 3))}
    assert interrupted(lambda: rodsweep.solve(p6, values, wrt="coil.current", engine=engine)) < LIMIT


def test_sweeps_and_studies_are_interrupted(p6: rodsweep.Scene, root: Path, tmp_path: Path) -> None:
    sweep = rodsweep.Sweep(p6, "sobol", {"coil.current.x": (-0.3, 0.3), "coil.current.y": (-0.3, 0.3)}, samples=2**22)
    assert interrupted(lambda: sweep.run(engine="cpu")) < LIMIT
    assert interrupted(lambda: sweep.run(tmp_path / "out", engine="cpu")) < LIMIT
    volume = rodsweep.Sweep.from_file(root / "sweeps/volume.toml")
    assert interrupted(lambda: volume.workspace(voxel=1e-3, engine="cpu")) < LIMIT
    targets = np.random.default_rng(0).normal(0, 0.03, (3000, 3)) + [0, 0, 0.08]
    assert interrupted(lambda: rodsweep.control(p6, targets)) < LIMIT


def test_hard_samples_are_interrupted() -> None:
    """Forces under which a single pass loses its digits: each sample is solved by nodes."""
    rod = rodsweep.Scene.from_dict(
        {
            "segment": [
                {
                    "name": "rod",
                    "kind": "flexible",
                    "length": 0.1,
                    "stiffness": {"bending": 1e-5, "torsion": 1e-5},
                    "rest_curvature": [10, 0, 0],
                }
            ]
        }
    )
    forces = np.random.default_rng(0).normal(0, 0.1, (4000, 3))
    assert interrupted(lambda: rodsweep.solve(rod, {"loads.tip_force": forces}, engine="cpu")) < LIMIT


def test_other_threads_go_on(p6: rodsweep.Scene) -> None:
    """While a batch is solved, Python counts in another thread."""
    values = {"coil.current": np.random.default_rng(0).uniform(-0.3, 0.3, (400_000, 3))}
    counted, stop = [0], threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    solution = rodsweep.solve(p6, values, engine="cpu", threads=1)
    during = counted[0] - before
    stop.set()
    thread.join()
    # A GIL that is held would let it count once at most.
    assert during > 10, f"counted {during} in {solution.seconds} s"
