"""Seconds from Ctrl-C to the exception, for a batch, a run with files and a control. On a quiet machine: below 0.2.

    python benchmarks/interrupt.py
"""

from __future__ import annotations

import os
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import rodsweep

ROOT = Path(__file__).resolve().parents[2]


def seconds(work: Callable[[], object]) -> float:
    """Seconds from Ctrl-C to the exception."""
    sent: list[float] = []

    def send() -> None:
        time.sleep(0.4)
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=send).start()
    try:
        work()
    except KeyboardInterrupt:
        return time.perf_counter() - sent[0]
    raise SystemExit("the work ended before it was interrupted")


def main() -> None:
    """Prints the seconds."""
    scene = rodsweep.Scene.from_file(ROOT / "sweeps/scenes/p6.toml")
    generator = np.random.default_rng(0)
    values = {"coil.current": generator.uniform(-0.3, 0.3, (3_000_000, 3))}
    sweep = rodsweep.Sweep(scene, "sobol", {"coil.current.x": (-0.3, 0.3)}, samples=2**22)
    targets = generator.normal(0, 0.03, (3000, 3)) + [0, 0, 0.08]
    with tempfile.TemporaryDirectory() as folder:
        calls: dict[str, Callable[[], object]] = {
            "solve": lambda: rodsweep.solve(scene, values, engine="cpu"),
            "run with files": lambda: sweep.run(Path(folder) / "out", engine="cpu"),
            "control": lambda: rodsweep.control(scene, targets),
        }
        for name, call in calls.items():
            print(f"{name}: {seconds(call):.3f} s")


if __name__ == "__main__":
    main()
