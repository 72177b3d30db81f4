"""What Python adds to the library's own call: ratios of times measured in one run.

    python benchmarks/overhead.py

``Solution.seconds`` is the time of the library's call on the same arrays; the rest is Python's share: columns in,
thread, block of numbers out. The batch's
ratio is the median over repeats. On a busy machine only the best of many single calls tells what a call costs.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import rodsweep

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = 100_000
REPEATS = 15
SINGLES = 500


def pair(scene: rodsweep.Scene, values: dict[str, np.ndarray], method: dict[str, object] | None) -> tuple[float, float]:
    """Seconds of a call from Python, and of the library's call in it."""
    begin = time.perf_counter()
    solution = rodsweep.solve(scene, values, wrt=["coil.current", "insertion"], engine="cpu", method=method)
    arrays = solution.tip_position, solution.jacobian, solution.status
    seconds = time.perf_counter() - begin
    assert all(len(array) == len(solution) for array in arrays)
    return seconds, solution.seconds


def import_seconds() -> tuple[float, float]:
    """Seconds that the import takes beside NumPy's, and NumPy's own."""
    code = (
        "import time; a = time.perf_counter(); import numpy; b = time.perf_counter(); import rodsweep; "
        "print(b - a, time.perf_counter() - b)"
    )
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(7)]
    times = [tuple(map(float, run.stdout.split())) for run in runs]
    return statistics.median(own for _, own in times), statistics.median(numpy for numpy, _ in times)


def main() -> None:
    """Prints the ratios."""
    scene = rodsweep.Scene.from_file(ROOT / "sweeps/scenes/p6.toml")
    generator = np.random.default_rng(0)
    values = {
        "coil.current": generator.uniform(-0.2, 0.2, (SAMPLES, 3)),
        "insertion": generator.uniform(0.09, 0.1, SAMPLES),
    }
    pair(scene, values, None)
    times = [pair(scene, values, None) for _ in range(REPEATS)]
    ratio = statistics.median(python / library for python, library in times)
    print(f"solve of {SAMPLES:,} samples with Jacobian: {statistics.median(t for t, _ in times):.3f} s,", end=" ")
    print(f"{ratio:.4f} times the library's call")
    one = {name: column[:1] for name, column in values.items()}
    method = rodsweep.solve(scene, one, engine="cpu").method
    singles = [pair(scene, one, method) for _ in range(SINGLES)]
    extra = 1e6 * np.quantile([python - library for python, library in singles], [0, 0.1, 0.5])
    print(f"solve of one sample: {1e6 * np.quantile([s for _, s in singles], 0.1):.0f} µs in the library,", end=" ")
    print(f"on top {extra[0]:.0f} µs at best, {extra[1]:.0f} in the best tenth, {extra[2]:.0f} in the middle")
    own, numpy = import_seconds()
    print(f"import: {own:.3f} s beside NumPy's {numpy:.3f} s")


if __name__ == "__main__":
    main()
