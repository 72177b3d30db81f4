"""rodsweep as a program: one scene a process, and rows of a sweep on one core.

The sweep is a grid of currents about the scene's own, with derivatives by them. Its middle row is the scene; rows
along the first current tell the noise.
"""

import csv
import json
import math
import os
import re
import subprocess
import time

import numpy as np

PROGRAM = os.environ.get("RODSWEEP_PROGRAM", "target/release/rodsweep")
# Points along each current: odd, so that one is the scene's own.
POINTS, AROUND = 17, 0.01


def command(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=True).stdout


def version():
    return command("--version").split()[1]


def solve(scene, work, tolerance, repeats):
    """Force, tip, columns of the force and seconds of the fastest of some whole processes."""
    file = work / f"{scene.name}.toml"
    file.write_text(scene.text)
    best = math.inf
    for _ in range(repeats):
        start = time.perf_counter()
        options = "--wrt", "coil.current", "--backend", "cpu", "--tolerance", str(tolerance)
        out = command("solve", str(file), "--json", *options)
        best = min(best, time.perf_counter() - start)
    found = json.loads(out)
    force, tip = found["contact"]["force"], found["tip"]["position"]
    columns = found["jacobian"]["force"]
    return in_units(scene, force, tip, columns), best


def in_units(scene, force, tip, columns):
    return np.array(force) / scene.force_unit, np.array(tip) / scene.length, np.array(columns) / scene.force_unit


def sweep(scene, work, tolerance):
    """As `solve`, with seconds a row of solving and of the whole run, and forces along the first current."""
    # Tables of the scene, moved below [scene].
    lines = re.sub(r"^(\[+)", r"\1scene.", scene.text, flags=re.MULTILINE)
    axes = "".join(
        f'[[axis]]\nparameter = "coil.current.{a}"\n'
        f"from = {i * (1 - AROUND)!r}\nto = {i * (1 + AROUND)!r}\npoints = {POINTS}\n\n"
        for a, i in zip("xyz", map(float, scene.currents))
    )
    text = (f'[sampling]\nmethod = "grid"\n\n{axes}[solver]\ntolerance = {tolerance}\n\n'
            f'[output]\nformat = "csv"\nderivatives = ["coil.current"]\n\n[scene]\n' + lines)
    file, out = work / f"{scene.name}-sweep.toml", work / f"{scene.name}-rows-{tolerance}"
    file.write_text(text)
    command("run", str(file), "--out", str(out), "--backend", "cpu", "--no-figures", "--quiet", "--force")
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["failed"] == 0, f"{out}: rows failed"
    rows = []
    for part in sorted(out.glob("part-*.csv")):
        with open(part, newline="") as text:
            rows += list(csv.DictReader(line for line in text if not line.startswith("#")))
    numbers = lambda row, of: [float(row[f"{of}.{a}"]) for a in "xyz"]
    currents = np.array([numbers(row, "coil.current") for row in rows])
    apart = np.abs(currents / scene.currents - 1)
    middle = rows[np.argmin(apart.max(1))]
    columns = [[float(middle[f"d(contact.force.{f})/d(coil.current.{i})"]) for i in "xyz"] for f in "xyz"]
    found = in_units(scene, numbers(middle, "contact.force"), numbers(middle, "tip.position"), columns)
    along = [row for row, far in zip(rows, apart[:, 1:].max(1)) if far < 1e-6]
    forces = np.array([numbers(row, "contact.force") for row in along]) / scene.force_unit
    timings = manifest["timings"]
    return found, (timings["solve"] + timings["refine"]) / len(rows), timings["total"] / len(rows), forces
