"""What both scripts need: a sweep, the program, and a result to compare with."""

import argparse
import os
import pathlib
import shutil
import subprocess
import tempfile

SCENE = """name = "test"
[field]
flux_density = [0, "3 T", 0]
[[segment]]
name = "tube"
kind = "flexible"
length = "80 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "1 mm" }
youngs_modulus = "5 MPa"
shear_modulus = "2 MPa"
[[segment]]
name = "coil"
kind = "rigid"
length = "13 mm"
coil = { turns = [30, 30, 100], area = ["4.67 mm^2", "4.67 mm^2", "1.13 mm^2"], current = [0, 0, 0] }
"""
SWEEP = """scene = "scene.toml"
[sampling]
method = "uniform"
samples = %d
seed = 7
[[axis]]
parameter = "coil.current.x"
from = "-0.1 A"
to = "0.1 A"
[[axis]]
parameter = "coil.current.y"
from = "-0.1 A"
to = "0.1 A"
[solver]
steps = 4
tolerance = 1e-3
[output]
quantities = ["tip_position", "error_estimate"]
format = "%s"
[workspace]
voxel = "2 mm"
"""
FORMATS = ["parquet", "csv", "npz", "none"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
# What belongs to one run and says nothing of its rows.
ACCOUNT = {"manifest.json", "spot-check-worst.toml"}


def arguments(rounds):
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=os.environ.get("RODSWEEP_PROGRAM", ROOT / "target/release/rodsweep"))
    parser.add_argument("--rounds", type=int, default=rounds, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--only", help="a word of the kinds that are run")
    return parser.parse_args()


class Place:
    """A directory with a sweep in each format, and the results of runs that nothing disturbed."""

    def __init__(self, program, samples):
        self.program = str(pathlib.Path(program).resolve())
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rodsweep-faults-"))
        (self.folder / "scene.toml").write_text(SCENE)
        self.whole = {}
        for form in FORMATS:
            (self.folder / f"{form}.toml").write_text(SWEEP % (samples, form))

    def reference(self, form):
        if form not in self.whole:
            self.run(form, self.folder / f"whole-{form}").check_returncode()
            self.whole[form] = rows(self.folder / f"whole-{form}")
        return self.whole[form]

    def command(self, form, out, *options):
        sweep = str(self.folder / f"{form}.toml")
        return [self.program, "run", sweep, "--out", str(out), "--backend", "cpu", "--quiet", *options]

    def run(self, form, out, *options, **environment):
        return self.call(self.command(form, out, "--no-figures", *options), **environment)

    def call(self, command, **environment):
        environment = {**os.environ, "XDG_RUNTIME_DIR": "/tmp", **environment}
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)

    def new(self):
        out = self.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        return out

    def close(self):
        shutil.rmtree(self.folder)


def rows(out):
    """Every file of a result that holds rows, or says what they are: name and bytes."""
    files = sorted(path for path in out.iterdir() if not path.name.startswith("."))
    return {path.name: path.read_bytes() for path in files if path.name not in ACCOUNT and is_row_file(path.name)}


def is_row_file(name):
    return name.startswith(("part-", "run.json", "sweep.toml", "workspace.parquet", "tips.parquet"))
