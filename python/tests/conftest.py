"""What the tests share: the repository, its scenes, the program."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import rodsweep

ROOT = Path(__file__).resolve().parents[2]


def find_program() -> str | None:
    """The command-line program that was built beside the package."""
    asked = os.environ.get("RODSWEEP_PROGRAM")
    places = [asked] if asked else [str(ROOT / "target" / kind / "rodsweep") for kind in ("release", "debug")]
    for place in places:
        if place and Path(place).is_file():
            return place
    return shutil.which("rodsweep")


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def program() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Calls the program; a missing one is a visible skip, and an error where RODSWEEP_PROGRAM names it."""
    found = find_program()
    if found is None:
        if "RODSWEEP_PROGRAM" in os.environ:
            raise FileNotFoundError(os.environ["RODSWEEP_PROGRAM"])
        pytest.skip("the program is not built: cargo build --release")

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        words = [str(argument) for argument in arguments]
        done = subprocess.run([found, *words], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stderr}"
        return done

    return call


@pytest.fixture(scope="session")
def p6(root: Path) -> rodsweep.Scene:
    """The scene of a published catheter."""
    return rodsweep.Scene.from_file(root / "sweeps/scenes/p6.toml")


@pytest.fixture(scope="session")
def rod() -> rodsweep.Scene:
    """A plain rod with a force at its tip."""
    return rodsweep.Scene.from_dict(
        {
            "name": "rod",
            "segment": [
                {
                    "name": "rod",
                    "kind": "flexible",
                    "length": 0.1,
                    "stiffness": {"bending_x": 1e-5, "bending_y": 2e-5, "torsion": 1e-5},
                    "rest_curvature": [2.0, -1.0, 0.5],
                }
            ],
            "loads": {"tip_force": [1e-4, 3e-4, -2e-4]},
        }
    )
