"""Times JAX and SciPy on samples that the reference has solved, and appends rows to raw.csv.

Both integrate the rod as one would write it down: tip-to-base force balance by hand, then p' = t, R' = R hat(u),
m' = -t x n with u = u* + K^-1 R^T m, shooting on the base moment from rest under growing loads. JAX: fixed RK4 steps,
jit, vmap over samples, Jacobian by forward mode and the implicit function theorem. SciPy: solve_ivp with DOP853, fsolve,
Jacobian by forward differences.
"""

import csv
import sys
import time
import tomllib

import jax
import jax.numpy as jnp
import numpy as np

SMALL_COLUMN = 1e-3
REPEATS = 5
SCIPY_SAMPLES = 3
UNITS = {"mm": 1e-3, "T": 1.0, "mN": 1e-3, "A": 1.0, "N·m²": 1.0}


def si(value):
    """A number, or a text with one of the units of the scene."""
    if isinstance(value, str):
        number, unit = value.split()
        return float(number) * UNITS[unit]
    return value


class Scene:
    def __init__(self, file):
        with open(file, "rb") as text:
            scene = tomllib.load(text)["scene"]
        self.field = np.array([si(x) for x in scene["field"]["flux_density"]])
        self.tip_force = np.array([si(x) for x in scene["loads"]["tip_force"]])
        proximal, coil, distal = scene["segment"]
        self.lengths = [si(segment["length"]) for segment in (proximal, coil, distal)]
        self.turns_area = np.array(coil["coil"]["turns_area"])
        numbers = lambda s: [*s["rest_curvature"], si(s["stiffness"]["bending"]), si(s["stiffness"]["torsion"])]
        # In the order of the derivatives: tip force, insertion, then each flexible segment's own.
        self.rest = np.array([*self.tip_force, self.lengths[0], *numbers(proximal), *numbers(distal)])

    def parameters(self, currents):
        return np.concatenate([currents, self.rest])


def hat(u, xp):
    return xp.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])


def slopes(y, n, u_star, stiffness, xp):
    """y: p, R by rows, m."""
    R, m = y[3:12].reshape(3, 3), y[12:15]
    u = u_star + (R.T @ m) / stiffness
    t = R[:, 2]
    return xp.concatenate([t, (R @ hat(u, xp)).ravel(), -xp.cross(t, n)])


def across(y, scene, n, currents, xp):
    """Over the coil, with its dipole and the lever arm of the force."""
    R = y[3:12].reshape(3, 3)
    mu, t = R @ (scene.turns_area @ currents), R[:, 2]
    m = y[12:15] - xp.cross(mu, scene.field * 1.0) - scene.lengths[1] * xp.cross(t, n)
    return xp.concatenate([y[:3] + scene.lengths[1] * t, y[3:12], m])


def jax_methods(scene, steps):
    """Jitted functions over all samples: base moments and Jacobians from rest."""
    counts = [max(1, round(steps * scene.lengths[k] / (scene.lengths[0] + scene.lengths[2]))) for k in (0, 2)]

    def shoot(m0, theta, load):
        currents, n = load * theta[:3], load * theta[3:6]
        pieces = [(theta[6], theta[7:12], counts[0]), (scene.lengths[2], theta[12:17], counts[1])]
        y = jnp.concatenate([jnp.zeros(3), jnp.eye(3).ravel(), m0])
        for index, (length, numbers, count) in enumerate(pieces):
            stiffness = jnp.array([numbers[3], numbers[3], numbers[4]])
            h = length / count

            def step(y, _, h=h, stiffness=stiffness, u_star=numbers[:3]):
                f = lambda y: slopes(y, n, u_star, stiffness, jnp)
                a = f(y)
                b = f(y + 0.5 * h * a)
                c = f(y + 0.5 * h * b)
                d = f(y + h * c)
                return y + h / 6 * (a + 2 * b + 2 * c + d), None

            y, _ = jax.lax.scan(step, y, None, length=count)
            if index == 0:
                y = across(y, scene, n, currents, jnp)
        return y

    def residual(m0, theta, load):
        return shoot(m0, theta, load)[12:15]

    def solve(theta):
        def newton(m0, load):
            for _ in range(2):
                matrix = jax.jacfwd(residual)(m0, theta, load)
                m0 = m0 - jnp.linalg.solve(matrix, residual(m0, theta, load))
            return m0, None

        m0, _ = jax.lax.scan(newton, jnp.zeros(3), jnp.arange(1, 9) / 8)
        for _ in range(2):
            m0 = m0 - jnp.linalg.solve(jax.jacfwd(residual)(m0, theta, 1.0), residual(m0, theta, 1.0))
        tip = shoot(m0, theta, 1.0)
        by_m0, by_theta = jax.jacfwd(shoot, argnums=(0, 1))(m0, theta, 1.0)
        dm0 = -jnp.linalg.solve(by_m0[12:15], by_theta[12:15])
        return tip, by_theta + by_m0 @ dm0

    return jax.jit(jax.vmap(solve))


def scipy_solve(scene, theta, tolerance):
    from scipy.integrate import solve_ivp
    from scipy.optimize import fsolve

    def shoot(m0, theta, load=1.0):
        currents, n = load * theta[:3], load * theta[3:6]
        y = np.concatenate([np.zeros(3), np.eye(3).ravel(), m0])
        for index, (length, numbers) in enumerate([(theta[6], theta[7:12]), (scene.lengths[2], theta[12:17])]):
            stiffness = np.array([numbers[3], numbers[3], numbers[4]])
            f = lambda s, y: slopes(y, n, numbers[:3], stiffness, np)
            y = solve_ivp(f, (0.0, length), y, method="DOP853", rtol=tolerance, atol=1e-3 * tolerance).y[:, -1]
            if index == 0:
                y = across(y, scene, n, currents, np)
        return y

    scale = 1e-4
    equilibrium = lambda theta, m0, load=1.0: scale * fsolve(
        lambda x: shoot(scale * x, theta, load)[12:15] / scale, m0 / scale, xtol=1e-10
    )
    m0 = np.zeros(3)
    for load in (0.25, 0.5, 0.75, 1.0):
        m0 = equilibrium(theta, m0, load)
    tip = shoot(m0, theta)
    columns = []
    for k in range(len(theta)):
        moved = theta.copy()
        step = 1e-5 * max(abs(theta[k]), {0: 0.1, 1: 0.1, 2: 0.1, 3: 1e-3, 4: 1e-3, 5: 1e-3}.get(k, 1e-6))
        moved[k] += step
        columns.append((shoot(equilibrium(moved, m0), moved) - tip) / step)
    return tip, np.array(columns).T


def errors(scene, truth, tips, jacobians):
    """Of the tip over the length, and of the worst column (dp/L, w), as `bench` has them."""
    length = sum(scene.lengths)
    scale = np.array([length] * 3 + [1.0] * 3)[:, None]
    largest = np.max([np.linalg.norm(t["jacobian"] / scale, axis=0) for t in truth], axis=0)
    tip_errors, column_errors = [], []
    for t, tip, jacobian in zip(truth, tips, jacobians):
        tip, jacobian = np.asarray(tip), np.asarray(jacobian)
        R = tip[3:12].reshape(3, 3)
        # w of each column from dR = hat(w) R.
        turns = [jacobian[3:12, k].reshape(3, 3) @ R.T for k in range(jacobian.shape[1])]
        w = np.array([[s[2, 1] - s[1, 2], s[0, 2] - s[2, 0], s[1, 0] - s[0, 1]] for s in turns]).T / 2
        found = np.vstack([jacobian[:3], w]) / scale
        true = t["jacobian"] / scale
        size = np.maximum(np.linalg.norm(true, axis=0), SMALL_COLUMN * largest)
        tip_errors.append(np.linalg.norm(tip[:3] - t["tip"]) / length)
        column_errors.append(np.max(np.linalg.norm(found - true, axis=0) / size))
    at = lambda all: [float(np.quantile(all, q, method="inverted_cdf")) for q in (0.5, 0.95, 1.0)]
    return at(tip_errors), at(column_errors)


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


def record(file, engine, method, size, samples, tip, column, times):
    """Appends a row under the header that the table has."""
    with open(file, newline="") as text:
        header = next(csv.reader(text))
    median, least = sorted(times)[len(times) // 2] / samples, min(times) / samples
    row = {
        "part": "peers", "case": "benchmark", "work": "cold", "engine": engine, "precision": "f64", "method": method,
        "size": size, "samples": samples, "failed": 0, "elsewhere": 0, "seconds": f"{median:.4e}",
        "least": f"{least:.4e}", "spread": f"{median / least - 1:.4e}",
    }
    for name, three in (("tip", tip), ("column", column)):
        row |= {f"{name}_{part}": f"{x:.4e}" for part, x in zip(("median", "p95", "worst"), three)}
    with open(file, "a", newline="") as text:
        csv.DictWriter(text, header, lineterminator="\n").writerow(row)
    print(f"{engine} {method} {size}: tip {tip[1]:.1e}, column {column[1]:.1e}, {1e6 * median:.1f} us", file=sys.stderr)


def forget(file):
    """Drops the rows of an earlier comparison."""
    with open(file) as text:
        lines = [line for line in text if not line.startswith("peers,")]
    with open(file, "w") as text:
        text.writelines(lines)


def main():
    import scipy

    jax.config.update("jax_enable_x64", True)
    scene_file, *truth_files, raw = sys.argv[1:]
    scene, truth = Scene(scene_file), read_truth(truth_files)
    if not truth:
        sys.exit(f"{truth_files}: no sample has an answer")
    forget(raw)
    thetas = np.array([scene.parameters(t["currents"]) for t in truth])
    for steps in (12, 24, 48, 96):
        solve = jax_methods(scene, steps)
        tips, jacobians = jax.block_until_ready(solve(thetas))
        times = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            jax.block_until_ready(solve(thetas))
            times.append(time.perf_counter() - start)
        record(raw, f"JAX {jax.__version__}", "rk4", steps, len(truth), *errors(scene, truth, tips, jacobians), times)
    few = truth[:SCIPY_SAMPLES]
    for tolerance in (1e-6, 1e-9):
        start = time.perf_counter()
        found = [scipy_solve(scene, scene.parameters(t["currents"]), tolerance) for t in few]
        times = [time.perf_counter() - start]
        measured = errors(scene, few, *zip(*found))
        record(raw, f"SciPy {scipy.__version__}", f"DOP853 to {tolerance:.0e}", "", len(few), *measured, times)


if __name__ == "__main__":
    main()
