"""Ctrl-C ends every long call on its way, and the GIL is free meanwhile. Seconds: ``benchmarks/interrupt.py``."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rodsweep

Listener = Callable[..., None]


def share_done(told: tuple[object, ...]) -> float:
    """What a listener hears, as a share of the work; 0 where it is no count."""
    if len(told) == 4:
        done, total = told[:2]
        assert isinstance(done, int)
        assert isinstance(total, int)
        return done / total
    counted = re.match(r"([\d,]+) of ([\d,]+) ", str(told[0]))
    return int(counted[1].replace(",", "")) / int(counted[2].replace(",", "")) if counted else 0.0


def assert_interrupted(work: Callable[[Listener], object]) -> None:
    """Ctrl-C while `work` goes on ends it before half of it is done. No clock judges: only the work that is done."""
    shares = [0.0]
    signalled = threading.Timer(0.4, lambda: os.kill(os.getpid(), signal.SIGINT))
    signalled.start()
    with pytest.raises(KeyboardInterrupt):
        work(lambda *told: shares.append(share_done(told)))
    assert not signalled.is_alive()
    assert max(shares) < 0.5


@pytest.mark.parametrize("engine", ["cpu", "reference"])
def test_solve_is_interrupted(p6: rodsweep.Scene, engine: str) -> None:
    count = 3_000_000 if engine == "cpu" else 30_000
    values = {"coil.current": np.random.default_rng(0).uniform(-0.3, 0.3, (count, 3))}
    assert_interrupted(
        lambda listener: rodsweep.solve(p6, values, wrt="coil.current", engine=engine, progress=listener)
    )


def test_sweeps_and_studies_are_interrupted(p6: rodsweep.Scene, root: Path, tmp_path: Path) -> None:
    sweep = rodsweep.Sweep(p6, "sobol", {"coil.current.x": (-0.3, 0.3), "coil.current.y": (-0.3, 0.3)}, samples=2**22)
    assert_interrupted(lambda listener: sweep.run(engine="cpu", progress=listener))
    assert_interrupted(lambda listener: sweep.run(tmp_path / "out", engine="cpu", progress=listener))
    volume = rodsweep.Sweep.from_file(root / "sweeps/volume.toml")
    assert_interrupted(lambda listener: volume.workspace(voxel=1e-3, engine="cpu", progress=listener))
    targets = np.random.default_rng(0).normal(0, 0.03, (30_000, 3)) + [0, 0, 0.08]
    assert_interrupted(lambda listener: rodsweep.control(p6, targets, progress=listener))


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
    forces = np.random.default_rng(0).normal(0, 0.1, (20_000, 3))
    assert_interrupted(
        lambda listener: rodsweep.solve(rod, {"loads.tip_force": forces}, engine="cpu", progress=listener)
    )


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
