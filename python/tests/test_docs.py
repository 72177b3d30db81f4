"""Every Python block of the README and the guide runs, and so do the notebooks."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest

PAGES = {"README.md": 1, "docs/python.md": 8, "python/README.md": 1}
NOTEBOOKS = ["reachable_surface", "stiffness_errors", "rest_curvature_design"]


@pytest.mark.parametrize("page", PAGES)
def test_python_blocks_run(page: str, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", (root / page).read_text(), re.DOTALL | re.MULTILINE)
    assert len(blocks) >= PAGES[page]
    shutil.copytree(root / "sweeps", tmp_path / "sweeps", ignore=shutil.ignore_patterns("reports"))
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


def test_the_quick_starts_have_ten_lines(root: Path) -> None:
    block = re.search(r"^```python\n(.*?)^```", (root / "README.md").read_text(), re.DOTALL | re.MULTILINE)
    assert block is not None and len(block[1].strip().splitlines()) <= 10


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_run(name: str, root: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("matplotlib")
    pytest.importorskip("ipykernel")
    os.environ.setdefault("XDG_RUNTIME_DIR", "/tmp")
    folder = root / "python/examples"
    notebook = nbformat.read(folder / f"{name}.ipynb", as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in cells), "the notebook was not executed"
    pictures = sum("image/png" in output.get("data", {}) for cell in cells for output in cell.outputs)
    assert pictures >= 1
    begin = time.perf_counter()
    nbclient.NotebookClient(notebook, timeout=180, resources={"metadata": {"path": str(folder)}}).execute()
    print(f"{name}: {time.perf_counter() - begin:.1f} s")


def test_the_tutorial_draws_its_figure(
    root: Path, program: Callable[..., object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in ("matplotlib", "pandas", "pyarrow"):
        pytest.importorskip(package)
    page = (root / "docs/tutorial.md").read_text("utf-8")
    for name, text in re.findall(r"^```toml\n# (\S+)\n(.*?)^```", page, re.DOTALL | re.MULTILINE):
        (tmp_path / name).write_text(text, "utf-8")
    program("run", tmp_path / "map.toml", "--out", tmp_path / "results/map", "--no-figures", "--quiet")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    [block] = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    exec(compile(block, "docs/tutorial.md", "exec"), {})
    assert (tmp_path / "tips.pdf").read_bytes().startswith(b"%PDF")
    assert b"<svg" in (tmp_path / "tips.svg").read_bytes()
