"""Times on a GPU what a researcher would write in JAX, on samples that the reference has solved.

    peer_jax.py f32|f64 SCENE TRUTH.csv... JAX.csv [--quick]

vmap over samples, RK4 in 64 steps, Newton's method from rest under growing loads, the 6 x 17 Jacobian by forward mode
and the implicit function theorem, see benches/peers/by_jax.py. Times are of batches that stay on the device.
"""

import csv
import datetime
import pathlib
import sys
import time

import jax
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "peers"))
import by_jax
import rod
from compare import errors, read_truth

STEPS = 64
BATCHES = (4096, 65536)
QUICK = (256,)
REPEATS = 5


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--quick"]
    precision, scene_file, *truth_files, table = arguments
    jax.config.update("jax_enable_x64", precision == "f64")
    scene, truth = rod.Scene(scene_file), read_truth(truth_files)
    if not truth:
        sys.exit(f"{truth_files}: no sample has an answer")
    few = np.array([scene.parameters(t["currents"]) for t in truth])
    solve = by_jax.solver(scene, "rk4", STEPS)
    device = jax.devices()[0]
    for batch in QUICK if "--quick" in sys.argv else BATCHES:
        thetas = jax.device_put(np.resize(few, (batch, few.shape[1])).astype(precision.replace("f", "float")), device)
        start = time.perf_counter()
        tips, jacobians = jax.block_until_ready(solve(thetas))
        first = time.perf_counter() - start
        times = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            jax.block_until_ready(solve(thetas))
            times.append(time.perf_counter() - start)
        tip, column, elsewhere = errors(scene, truth, tips[: len(truth)], jacobians[: len(truth)])
        row = {
            "date": datetime.date.today().isoformat(), "device": device.device_kind, "jax": jax.__version__,
            "precision": precision, "steps": STEPS, "batch": batch, "compile_seconds": f"{first - min(times):.3f}",
            "seconds_a_sample": f"{sorted(times)[REPEATS // 2] / batch:.4e}", "least": f"{min(times) / batch:.4e}",
            "tip_p95": f"{tip[1]:.2e}", "column_p95": f"{column[1]:.2e}",
            "elsewhere": elsewhere,
        }
        is_new = not pathlib.Path(table).exists()
        with open(table, "a", newline="") as text:
            writer = csv.DictWriter(text, row, lineterminator="\n")
            if is_new:
                writer.writeheader()
            writer.writerow(row)
        print(row, file=sys.stderr)


main()
