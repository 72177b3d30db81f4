"""Times one contact force by every peer, writes the table as CSV and prints it as Markdown.

Every error is against the golden data. A time is that of one solve from rest, the fastest of some; what is compiled is
compiled before. The noise of a dynamic peer is the deviation of its force over the last steps; that of the others is
the deviation from a polynomial, of forces that are solved from rest at currents along a line. Both are over the mean.
"""

import csv
import importlib
import importlib.metadata
import platform
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import rod

COLUMNS = ("peer", "version", "scene", "setting", "seconds", "force_error", "tip_error", "derivatives",
           "derivative_error", "derivative_seconds", "noise", "noise_of")
# Currents of the noise: points, and how far they go at most, relative.
LINE, AROUND = 17, 0.01
# A force that is farther off than this, relative, is one of another equilibrium; along the line, from the middle one.
ELSEWHERE, JUMP = 0.5, 0.1

def both(*settings):
    return {name: settings for name in rod.NAMES}


# Name, package, module, arguments after the scene, repeats.
PEERS = [
    ("SciPy, shooting with fsolve", "scipy", "by_shooting", {
        "p6-tissue": (*[("odeint", t) for t in (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)], ("DOP853", 1e-6)),
        "p6-held": (("DOP853", 1e-2), *[("odeint", t) for t in (1e-6, 1e-7, 1e-8, 1e-10)], ("DOP853", 1e-6)),
    }, 10),
    ("SciPy, solve_bvp", "scipy", "by_bvp", both((1e-1,), (1e-2,), (1e-4,), (1e-5,), (1e-6,), (1e-8,)), 10),
    ("Pseudo-rigid chain, SLSQP", "scipy", "by_chain", both((4, 1e-9), (8, 1e-12), (16, 1e-12), (32, 1e-12)), 3),
    ("MuJoCo", "mujoco", "by_mujoco", both((4, 1e-4), (16, 1e-4), (16, 1e-8), (32, 1e-8), (64, 1e-8)), 5),
    ("PyElastica", "pyelastica", "by_elastica", {
        "p6-tissue": ((8, 1e3, 1e-3), (16, 3e3, 1e-5), (32, 1e4, 1e-6)),
        "p6-held": ((12, 3e3, 1e-3), (20, 1e4, 1e-5), (32, 3e4, 1e-6)),
    }, 1),
]
# What compiles a slow peer.
WARM = {"by_elastica": (4, 100.0, 1.0)}
# What a peer has not, and why.
CANNOT = [
    ("PyElastica, its own plane contact", "pyelastica", "p6-tissue", "cannot: it cancels what presses, as if rigid"),
    ("PyElastica, its own plane contact", "pyelastica", "p6-held", "cannot: a tip that touches slides or lifts"),
    ("MuJoCo, its own cable", "mujoco", "p6-tissue", "cannot: version 4 has none with frames for a coil"),
    ("MuJoCo, its own cable", "mujoco", "p6-held", "cannot: version 4 has none with frames for a coil"),
]
SETTINGS = {
    "by_shooting": "{}, tolerance {:g}", "by_bvp": "tolerance {:g}", "by_chain": "{} joints, ftol {:g}",
    "by_mujoco": "{} joints, settled to {:g}", "by_elastica": "{} elements, shear {:g}, settled to {:g}",
}


def scatter(forces):
    """Deviation from a polynomial of degree 5 over the mean."""
    x = np.linspace(-1, 1, len(forces))
    middle = forces[len(forces) // 2]
    here = np.linalg.norm(forces - middle, axis=1) < JUMP * np.linalg.norm(middle)
    gone = len(forces) - np.count_nonzero(here)
    x, forces = x[here], forces[here]
    left = forces - np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyfit(x, forces, 5)).T
    noise = np.max(np.std(left, axis=0)) / np.linalg.norm(forces.mean(0))
    return {"noise": noise, "noise_of": f"solves, {gone} of {len(here)} elsewhere" if gone else "solves"}


def along(peer, scene):
    forces = []
    for share in np.linspace(-AROUND, AROUND, LINE):
        forces.append(peer.solve(scene.currents * [1 + share, 1, 1])[0])
    return np.array(forces)


def measured(scene, module, setting, repeats):
    peer = module.Rod(scene, *setting)
    seconds = np.inf
    for _ in range(repeats):
        start = time.process_time()
        force, tip = peer.solve(scene.currents)
        seconds = min(seconds, time.process_time() - start)
    wrong, off = scene.errors(force, tip)
    row = {"seconds": seconds, "force_error": wrong, "tip_error": off, "derivatives": module.DERIVATIVES}
    if not wrong < ELSEWHERE:
        return row | {"derivatives": "ended elsewhere"}
    if hasattr(peer, "noise"):
        row |= {"noise": peer.noise, "noise_of": "steps"}
    best = np.inf
    for step in module.STEPS:
        start = time.process_time()
        error = scene.column_error(peer.derivatives(scene.currents, step))
        if error < best:
            best = error
            row |= {"derivative_error": error, "derivative_seconds": time.process_time() - start}
    if "noise" not in row:
        row |= scatter(along(peer, scene))
    return row


def rodsweep_rows(work):
    import by_rodsweep

    head = {"peer": "rodsweep", "version": by_rodsweep.version(), "derivatives": "reciprocity, in the time"}
    for name in rod.NAMES:
        scene = rod.Scene(name)

        def row(setting, found, seconds, **more):
            wrong, off = scene.errors(*found[:2])
            return head | {"scene": name, "setting": setting, "seconds": seconds, "force_error": wrong,
                           "tip_error": off, "derivative_error": scene.column_error(found[2])} | more

        for tolerance in (1e-3, 1e-9):
            found, seconds = by_rodsweep.solve(scene, work, tolerance, 20)
            yield row(f"a process with derivatives, tolerance {tolerance:g}", found, seconds)
        for tolerance in (1e-3, 1e-6, 1e-9):
            found, solving, whole, forces = by_rodsweep.sweep(scene, work, tolerance)
            noise = scatter(forces)
            yield row(f"a row of a sweep with derivatives, tolerance {tolerance:g}", found, solving, **noise)
            yield row(f"such a row and its share of checks and files, tolerance {tolerance:g}", found, whole, **noise)


def peer_rows():
    for peer, package, name, settings, repeats in PEERS:
        try:
            module, version = importlib.import_module(name), importlib.metadata.version(package)
        except ImportError as error:
            print(f"{peer} is left out: {error}", file=sys.stderr)
            continue
        for scene_name in rod.NAMES:
            for setting in settings[scene_name]:
                scene = rod.Scene(scene_name)
                # Compiles what is compiled.
                module.Rod(scene, *WARM.get(name, setting)).solve(scene.currents)
                text = SETTINGS[name].format(*setting)
                row = {"peer": peer, "version": version, "scene": scene_name, "setting": text}
                yield row | measured(scene, module, setting, repeats)
    for peer, package, scene_name, why in CANNOT:
        try:
            yield {"peer": peer, "version": importlib.metadata.version(package), "scene": scene_name, "setting": why}
        except ImportError:
            continue


def summary(rows):
    """Fastest to 1 % and to 1e-6 of the force, and the least error that was reached."""
    print("\n| peer | scene | to 1 % (s) | to 1e-6 (s) | least error | least error of derivatives |")
    print("|---" * 6 + "|")
    kind = lambda row: row["peer"] + (", " + row["setting"].split(",")[0] if row["peer"] == "rodsweep" else "")
    rows = [row for row in rows if row["seconds"] != ""]
    for scene in rod.NAMES:
        for name in dict.fromkeys(map(kind, rows)):
            mine = [row for row in rows if kind(row) == name and row["scene"] == scene]
            times = lambda bound: [row["seconds"] for row in mine if row["force_error"] <= bound]
            within = lambda bound: min(times(bound), default="not reached")
            least = lambda column: min((row[column] for row in mine if row[column] != ""), default="")
            cells = name, scene, within(1e-2), within(1e-6), least("force_error"), least("derivative_error")
            print("| " + " | ".join(map(shown, cells)) + " |")


def shown(value):
    return f"{value:.1e}" if isinstance(value, float) else str(value)


def main():
    (file,) = sys.argv[1:]
    warnings.simplefilter("ignore")
    rows = []
    print(f"Python {platform.python_version()}, NumPy {np.__version__}\n")
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS))
    with tempfile.TemporaryDirectory() as work:
        for source in (rodsweep_rows(Path(work)), peer_rows()):
            for row in source:
                row = {c: float(v) if isinstance(v, np.floating) else v for c in COLUMNS for v in (row.get(c, ""),)}
                rows.append(row)
                print("| " + " | ".join(shown(row[c]) for c in COLUMNS) + " |", flush=True)
    summary(rows)
    with open(file, "w", newline="") as text:
        table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows({c: f"{v:.4e}" if isinstance(v, float) else v for c, v in row.items()} for row in rows)


if __name__ == "__main__":
    main()
