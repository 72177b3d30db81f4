"""Types hold, and every example in a docstring gives what it says."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rodsweep

MODULES = [module.name for module in pkgutil.iter_modules(rodsweep.__path__)]


@pytest.mark.parametrize("name", ["__init__", *MODULES])
def test_docstrings(name: str) -> None:
    if name in ("jax", "torch"):
        pytest.importorskip(name)
    module = rodsweep if name == "__init__" else importlib.import_module(f"rodsweep.{name}")
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


def test_enough_examples() -> None:
    finder = doctest.DocTestFinder()
    modules = [
        rodsweep,
        *(importlib.import_module(f"rodsweep.{name}") for name in ("solve", "sweep", "scene", "control", "fit")),
    ]
    assert sum(len(test.examples) > 0 for module in modules for test in finder.find(module)) >= 6


def test_public_names_have_docstrings() -> None:
    for name in rodsweep.__all__:
        thing = getattr(rodsweep, name)
        if name != "__version__":
            assert thing.__doc__, name
        for member, value in vars(thing).items() if isinstance(thing, type) else ():
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__ or thing.__module__ == "rodsweep._rodsweep" or issubclass(thing, (int, tuple)), (
                    f"{name}.{member}"
                )


def test_mypy_strict(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    # A copy, since mypy takes what lies among installed packages for theirs.
    package = tmp_path / "rodsweep"
    package.mkdir()
    for pattern in ("*.py", "*.pyi", "py.typed"):
        for file in Path(rodsweep.__path__[0]).glob(pattern):
            shutil.copy(file, package / file.name)
    use = tmp_path / "use.py"
    use.write_text(
        "import numpy as np\nimport rodsweep\n\n"
        "scene = rodsweep.Scene.from_file('a.toml')\n"
        "solution = rodsweep.solve(scene, {'insertion': np.linspace(0, 1, 3)}, wrt='insertion')\n"
        "tip: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = solution.tip_position\n"
        "count: int = len(rodsweep.Sweep.from_file('b.toml').run().table)\n"
    )
    config = tmp_path / "mypy.ini"
    config.write_text(
        "[mypy]\nstrict = true\npython_version = 3.10\n"
        + "".join(
            f"[mypy-{name}.*]\nignore_missing_imports = true\nfollow_imports = skip\n"
            for name in ("jax", "torch", "tqdm")
        )
    )
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--config-file",
        str(config),
        "--cache-dir",
        str(tmp_path),
        str(package),
        str(use),
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_stubs_name_what_there_is() -> None:
    """Every class and function of the stub is there, and nothing is left out of it."""
    import ast

    native = importlib.import_module("rodsweep._rodsweep")
    stub = ast.parse((Path(rodsweep.__path__[0]) / "_rodsweep.pyi").read_text())
    named = {
        node.name
        for node in stub.body
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_")
    }
    there = {name for name in dir(native) if not name.startswith("_") and callable(getattr(native, name))}
    assert named == there
    for node in stub.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            members = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            assert all(hasattr(getattr(native, node.name), member) for member in members), node.name


def test_neither_jax_nor_torch_is_needed() -> None:
    others = {"jax", "torch", "pyarrow", "polars", "tqdm", "pandas", "xarray", "pint", "astropy"}
    code = f"import sys, rodsweep; print(sorted(set(sys.modules) & {others}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
