"""The program inside the package, its page in notebooks, and what starting Vulkan writes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import rodsweep


def module(*words: object, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rodsweep", *map(str, words)], capture_output=True, text=True, timeout=300, **more
    )


def test_the_module_is_the_program(root: Path, program: Any, tmp_path: Path) -> None:
    assert module("--version").stdout == f"rodsweep {rodsweep.__version__}\n"
    scene = root / "sweeps/scenes/p6.toml"
    ours, theirs = (
        module("solve", scene, "--json", "--backend", "cpu"),
        program("solve", scene, "--json", "--backend", "cpu"),
    )
    assert ours.returncode == 0 and ours.stdout == theirs.stdout
    assert (
        "coil.curent" in (wrong := module("solve", scene, "--set", "coil.curent.x=1")).stderr and wrong.returncode == 2
    )
    assert module("no-such-command").returncode == 2
    done = module(
        "run", root / "sweeps/lap.toml", "--out", tmp_path / "out", "--backend", "cpu", "--quiet", "--no-figures"
    )
    assert done.returncode == 0, done.stderr
    assert len(rodsweep.Results.open(tmp_path / "out").table("sample")) == len(
        rodsweep.Sweep.from_file(root / "sweeps/lap.toml")
    )
    assert module("completions", "bash").stdout == program("completions", "bash").stdout


def test_the_command_is_installed(root: Path) -> None:
    command = Path(sys.executable).with_name("rodsweep")
    if not command.exists():
        pytest.skip("the package was not installed beside this interpreter")
    assert subprocess.run([command, "--version"], capture_output=True, text=True).stdout.startswith("rodsweep ")


def test_readers_open_a_folder_of_rows_whole(root: Path, program: Any, tmp_path: Path) -> None:
    """Parts that lie apart are all that pandas, polars and pyarrow find there, after a study, too."""
    out, sweeps = tmp_path / "out", root / "sweeps"
    text = (sweeps / "lap.toml").read_text()
    for name in ("scenes/p6.toml", "lap.csv"):
        text = text.replace(f'"{name}"', f'"{sweeps / name}"')
    (tmp_path / "lap.toml").write_text(text.replace('format = "csv"', 'format = "parquet"\nrows_in_folder = true'))
    program(
        "run", tmp_path / "lap.toml", "--out", out, "--backend", "cpu", "--part-size", "4", "--quiet", "--no-figures"
    )
    module("workspace", out, "--quiet")
    rows = len(rodsweep.Results.open(out).table("sample")["sample"])
    assert rows > 4 and (out / "workspace.parquet").exists()
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    dataset = pytest.importorskip("pyarrow.dataset")
    assert len(pandas.read_parquet(out / "rows")) == rows
    assert polars.read_parquet(out / "rows").height == rows
    assert polars.read_parquet(str(out / "rows" / "*.parquet")).height == rows
    assert dataset.dataset(out / "rows", format="parquet").count_rows() == rows


def test_jobs_call_the_command(root: Path, tmp_path: Path) -> None:
    scripts = tmp_path / "scripts"
    words = ["submit", "slurm", root / "sweeps/lap.toml", "--out", tmp_path / "out", "--workers", 2, "--write", scripts]
    done = module(*words)
    assert done.returncode == 0, done.stderr
    text = "".join(file.read_text() for file in scripts.iterdir() if file.is_file())
    assert f"{Path(sys.executable).resolve()} run" not in text and "rodsweep run" in text.replace("'", "")


def test_an_interrupted_run_keeps_what_is_done(root: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "rodsweep", "run", str(root / "sweeps/workspace.toml"), "--backend", "reference"]
    words += ["--out", str(tmp_path / "out"), "--no-figures"]
    running = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 60
    while not (tmp_path / "out/run.json").exists() and time.monotonic() < end:
        time.sleep(0.05)
    time.sleep(0.5)
    running.send_signal(signal.SIGINT)
    _, told = running.communicate(timeout=120)
    assert running.returncode == 130, told


def test_pages(p6: rodsweep.Scene, root: Path, tmp_path: Path, program: Any) -> None:
    page = p6.view()
    shown = page._repr_html_()
    assert shown.startswith("<iframe") and "srcdoc=" in shown and "height:640px" in shown
    assert "<script" in page.html and "<script" not in shown
    file = tmp_path / "scene.toml"
    file.write_text(p6.to_toml())
    program("view", file, "--export", tmp_path / "theirs.html")
    # The page names its file.
    theirs = (tmp_path / "theirs.html").read_text()
    assert abs(len(theirs) - len(page.html)) < 1000
    assert page.save(tmp_path / "mine.html").read_text() == page.html
    assert "MB" in repr(page)
    run = rodsweep.Sweep.from_file(root / "sweeps/lap.toml").run(tmp_path / "out", engine="cpu")
    map = run.view(height=500)
    assert len(map.html) > len(page.html) / 2 and "height:500px" in map._repr_html_()
    assert abs(len(run.results.view().html) - len(map.html)) < 100
    assert len(rodsweep.Sweep.from_file(root / "sweeps/lap.toml").view().html) > 10_000
    with pytest.raises(rodsweep.InputError, match="directory"):
        rodsweep.Sweep.from_file(root / "sweeps/lap.toml").run(limit=5, engine="cpu").view()
    with pytest.raises(rodsweep.InputError, match="height"):
        p6.view(height=5)
    with pytest.raises(rodsweep.ResultsError, match="none"):
        page.save(tmp_path / "none/page.html")


def test_every_shipped_scene_has_a_page(root: Path) -> None:
    for file in sorted((root / "sweeps/scenes").glob("*.toml")):
        assert len(rodsweep.Scene.from_file(file).view().html) > 10_000, file


def test_vulkan_is_started_without_lines_of_mesa(root: Path) -> None:
    code = f"""
import os, rodsweep
scene = rodsweep.Scene.from_file({str(root / "sweeps/scenes/p6.toml")!r})
assert "XDG_RUNTIME_DIR" not in os.environ
for engine in ("auto", "gpu"):
    try:
        rodsweep.solve(scene, {{"coil.current.x": [0.0, 0.1]}}, engine=engine)
    except rodsweep.EngineError:
        pass
folder = os.environ["XDG_RUNTIME_DIR"]
assert os.stat(folder).st_mode & 0o777 == 0o700 and not os.listdir(folder)
print(folder)
"""
    environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "XDG_RUNTIME_DIR" not in done.stderr
    assert not Path(done.stdout.strip()).exists()
    kept = subprocess.run(
        [
            sys.executable,
            "-c",
            "import os\nfrom rodsweep._runtime import prepare\nprepare()\nprint(os.environ['XDG_RUNTIME_DIR'])",
        ],
        capture_output=True,
        text=True,
        env={**environment, "XDG_RUNTIME_DIR": "/nowhere"},
    )
    assert kept.stdout == "/nowhere\n"


def test_the_package_has_its_extras() -> None:
    from importlib.metadata import metadata

    found = metadata("rodsweep")
    assert {"progress", "pandas", "xarray"} <= set(found.get_all("Provides-Extra") or [])
    assert "rodsweep contributors" in f"{found.get('Author')} {found.get('Author-email')}"
