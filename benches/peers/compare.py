"""Times what a researcher would write instead on samples that the reference has solved, and writes peers.csv.

All integrate the rod as one would write it down (rod.py): force balance by hand, p, R and m along the rod, shooting on
the base moment from rest under growing loads. A peer that cannot be imported is left out and said so.
"""

import csv
import datetime
import importlib.metadata
import platform
import sys
import time

import numpy as np

import rod

SMALL_COLUMN = 1e-3
REPEATS = 5
# Samples of those that take long.
FEW = {"SciPy": 3, "CasADi, CVODES": 24}


def jax_points(scene):
    import by_jax

    for method, all_steps in (("rk4", (8, 12, 24, 48, 96)), ("dop853", (2, 4, 6))):
        for steps in all_steps:
            solve = by_jax.solver(scene, method, steps)
            yield method, steps, lambda thetas, solve=solve: [np.asarray(x) for x in solve(thetas)]


def blocked_jax_points(scene):
    import by_jax_blocks

    for method, all_steps in (("rk4", (8, 24, 96)), ("dop853", (2, 4, 6))):
        for steps in all_steps:
            yield method, steps, by_jax_blocks.solver(scene, method, steps)


def cpp_points(scene):
    import by_cpp

    built = by_cpp.library()
    for method, all_steps in (("rk4", (8, 12, 24, 96)), ("dop853", (2, 4, 6, 8))):
        for steps in all_steps:
            yield method, steps, by_cpp.solver(built, scene, method, steps, 1e-9)


def cpp_version():
    import by_cpp

    return by_cpp.compiler()


def package(name):
    return lambda: importlib.metadata.version(name)


def each(solve):
    return lambda thetas: list(zip(*[solve(theta) for theta in thetas]))


def scipy_points(scene):
    import by_scipy

    for tolerance in (1e-6, 1e-9):
        yield "DOP853", tolerance, each(lambda theta, to=tolerance: by_scipy.solve(scene, theta, to))


def casadi_points(scene):
    import by_casadi

    for tolerance in (1e-5, 1e-7, 1e-9, 1e-11):
        yield "Adams", tolerance, each(by_casadi.solver(scene, tolerance))


def heyoka_points(scene):
    import by_heyoka

    for tolerance in (1e-4, 1e-6, 1e-9, 1e-12):
        yield "Taylor", tolerance, by_heyoka.solver(scene, tolerance)


# Name, version, what to measure.
PEERS = [
    ("C++ by hand, g++", cpp_version, cpp_points),
    ("heyoka.py", package("heyoka"), heyoka_points),
    ("JAX in blocks", package("jax"), blocked_jax_points),
    ("JAX", package("jax"), jax_points),
    ("CasADi, CVODES", package("casadi"), casadi_points),
    ("SciPy", package("scipy"), scipy_points),
]


def errors(scene, truth, tips, jacobians):
    """Of the tip over the length, and of the worst column (dp/L, w), as `bench` has them; and what is elsewhere."""
    scale = np.array([scene.length] * 3 + [1.0] * 3)[:, None]
    largest = np.max([np.linalg.norm(t["jacobian"] / scale, axis=0) for t in truth], axis=0)
    tip_errors, column_errors, elsewhere = [], [], 0
    for t, tip, jacobian in zip(truth, tips, jacobians):
        tip, jacobian = scene.in_si(np.asarray(tip), np.asarray(jacobian))
        error = np.linalg.norm(tip[:3] - t["tip"]) / scene.length
        if not error < 0.02:
            elsewhere += 1
            continue
        R = tip[3:12].reshape(3, 3)
        # w of each column from dR = hat(w) R.
        turns = [jacobian[3:12, k].reshape(3, 3) @ R.T for k in range(jacobian.shape[1])]
        w = np.array([[s[2, 1] - s[1, 2], s[0, 2] - s[2, 0], s[1, 0] - s[0, 1]] for s in turns]).T / 2
        found = np.vstack([jacobian[:3], w]) / scale
        true = t["jacobian"] / scale
        size = np.maximum(np.linalg.norm(true, axis=0), SMALL_COLUMN * largest)
        tip_errors.append(error)
        column_errors.append(np.max(np.linalg.norm(found - true, axis=0) / size))
    at = lambda all: [float(np.quantile(all, q, method="inverted_cdf")) if all else "" for q in (0.5, 0.95, 1.0)]
    return at(tip_errors), at(column_errors), elsewhere


def read_truth(files):
    truth = []
    for file in files:
        with open(file, newline="") as text:
            rows = csv.reader(line for line in text if not line.startswith("#"))
            header = next(rows)
            names = [name[name.index("/d(") + 3 : -1] for name in header if name.startswith("d(tip.position.x)/d(")]
            for row in rows:
                cells = dict(zip(header, row))
                if cells["status"] not in ("ok", "ramped", "refined"):
                    continue
                column = lambda of: [float(cells[f"d(tip.{of}.{a})/d({n})"]) for a in "xyz" for n in names]
                jacobian = np.array(column("position") + column("rotation")).reshape(6, len(names))
                truth.append({
                    "currents": np.array([float(cells[f"coil.current.{a}"]) for a in "xyz"]),
                    "tip": np.array([float(cells[f"tip.position.{a}"]) for a in "xyz"]),
                    "jacobian": jacobian,
                })
    return truth


def measured(scene, truth, solve, repeats):
    """Errors, and the time of each repeat; what is compiled is compiled before."""
    thetas = np.array([scene.parameters(t["currents"]) for t in truth])
    found, times = solve(thetas), []
    for _ in range(repeats):
        start = time.process_time()
        solve(thetas)
        times.append(time.process_time() - start)
    return errors(scene, truth, *found), sorted(times)


def row_of(engine, method, size, samples, found, times):
    tip, column, elsewhere = found
    median, least = times[len(times) // 2] / samples, times[0] / samples
    row = {
        "part": "peers", "case": "benchmark", "work": "cold", "engine": engine, "precision": "f64", "method": method,
        "size": size, "samples": samples, "failed": 0, "elsewhere": elsewhere, "seconds": f"{median:.4e}",
        "least": f"{least:.4e}", "spread": f"{median / least - 1:.4e}",
    }
    for name, three in (("tip", tip), ("column", column)):
        row |= {f"{name}_{part}": x and f"{x:.4e}" for part, x in zip(("median", "p95", "worst"), three)}
    print(f"{engine} {method} {size}: tip {row['tip_p95']}, column {row['column_p95']}, {1e6 * median:.1f} us", file=sys.stderr)
    return row


def processor():
    with open("/proc/cpuinfo") as info:
        return next((line.split(": ")[1].strip() for line in info if line.startswith("model name")), "")


def main():
    scene_file, *truth_files, raw = sys.argv[1:]
    scene, truth = rod.Scene(scene_file), read_truth(truth_files)
    if not truth:
        sys.exit(f"{truth_files}: no sample has an answer")
    versions = [f"Python {platform.python_version()}", f"NumPy {np.__version__}"]
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    rows = [{"part": "peers run", "case": date, "engine": processor(), "status": ", ".join(versions)}]
    for name, version, points in PEERS:
        some = truth[: FEW.get(name, len(truth))]
        try:
            engine = f"{name} {version()}"
            for method, size, solve in points(scene):
                found, times = measured(scene, some, solve, 1 if name == "SciPy" else REPEATS)
                rows.append(row_of(engine, method, size, len(some), found, times))
        except ImportError as error:
            print(f"{name} is left out: {error}; `pip install {package}` where it has a wheel", file=sys.stderr)
    # Under the header of the table beside it.
    with open(raw, newline="") as text:
        header = next(csv.reader(text))
    with open(raw.removesuffix("raw.csv") + "peers.csv", "w", newline="") as text:
        table = csv.DictWriter(text, header, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    main()
