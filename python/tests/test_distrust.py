"""Rows that are not to be trusted: every door of Python says so first."""

from __future__ import annotations

import json
import pickle
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rodsweep

DATA = Path(__file__).parents[2] / "tests" / "data" / "two_coil_elsewhere"


@pytest.fixture
def coils(tmp_path: Path) -> Path:
    return Path(shutil.copytree(DATA, tmp_path / "coils"))


def _rod() -> rodsweep.Scene:
    return rodsweep.Scene.from_dict({
        "segment": [
            {"name": "rod", "kind": "flexible", "length": 0.1, "stiffness": {"bending": 1e-5, "torsion": 1e-5}}
        ],
    })


def test_results_that_are_distrusted_are_not_opened_unseen(coils: Path, tmp_path: Path) -> None:
    with pytest.raises(rodsweep.DistrustedRun, match=r"coilA\.current\.x") as caught:
        rodsweep.Results.open(coils)
    error = caught.value
    assert "--backend cpu" not in str(error) and "allow_distrusted=True" in str(error)
    assert error.verdict["doubts"][0]["kind"] == "rows-elsewhere"
    assert len(error.run.table()) == 512
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, rodsweep.DistrustedRun) and str(again) == str(error)
    with pytest.warns(rodsweep.DistrustedWarning, match="do not trust these rows"):
        results = rodsweep.Results.open(coils, allow_distrusted=True)
    assert results.verdict is not None and not results.verdict["sound"]
    files = results.draw(tmp_path / "figures")
    marked = [file for file in files if file.suffix == ".svg"]
    assert marked and all("DISTRUSTED: " in file.read_text() for file in marked)
    found = results.workspace(voxel=4e-3, fast=True)
    assert found.account["distrusted"].startswith("DISTRUSTED: ") and str(found).startswith("DISTRUSTED: ")


def test_a_run_without_a_usable_row_raises(tmp_path: Path) -> None:
    sweep = rodsweep.Sweep(_rod(), "grid", {"rod.length": (-0.02, -0.01, 4)})
    with pytest.raises(rodsweep.DistrustedRun, match="none of 4 samples can be used") as caught:
        sweep.run()
    assert caught.value.run.counts == {"bad-parameter": 4}
    assert caught.value.verdict["doubts"][0]["kind"] == "nothing-usable"
    with pytest.warns(rodsweep.DistrustedWarning):
        run = sweep.run(tmp_path / "out", allow_distrusted=True)
    assert not run.verdict["sound"] and len(run.results.table()) == 4
    with pytest.raises(rodsweep.DistrustedRun):
        rodsweep.Results.open(tmp_path / "out")


def test_sound_runs_say_what_was_checked(tmp_path: Path) -> None:
    sweep = rodsweep.Sweep(_rod(), "grid", {"loads.tip_force.x": ("-1 mN", "1 mN", 5)})
    run = sweep.run(tmp_path / "out")
    assert run.verdict["sound"] and run.verdict["checked"] == 5
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["verdict"] == run.verdict
    few = rodsweep.solve(_rod(), {"loads.tip_force.x": np.linspace(0, 1e-3, 5)})
    assert few.checked == "these rows were not checked against the reference"
    many = rodsweep.solve(_rod(), {"loads.tip_force.x": np.linspace(0, 1e-3, 2000)})
    assert many.checked.startswith("2 of 2000 samples were checked")
    found = rodsweep.control(_rod(), [[0, 0.01, 0.099]], inputs={"loads.tip_force": "2 mN"}, coordinates="y")
    assert found.account["check"]["checked"] == 1 and found.account["distrusted"] is None
    assert "checked against the reference" in str(found)


def test_fits_are_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    def fit(**options: bool) -> rodsweep.Fit:
        return rodsweep.fit(_rod(), [[0, -0.0049, 0.0998]], free="rod.rest_curvature.x", **options)

    found = fit()
    assert found.account["check"]["checked"] == 1 and found.account["distrusted"] is None
    assert "1 of 1 equilibria were checked against the reference" in str(found)

    class Doubted:
        def __init__(self, native: Any) -> None:
            self.native = native

        def json(self) -> str:
            return json.dumps({**json.loads(self.native.json()), "distrusted": "DISTRUSTED: 1 of 1 equilibria"})

        def __getattr__(self, name: str) -> Any:
            return getattr(self.native, name)

    native = rodsweep._rodsweep.fit
    monkeypatch.setattr(rodsweep._rodsweep, "fit", lambda *arguments: Doubted(native(*arguments)))
    with pytest.raises(rodsweep.DistrustedRun, match="DISTRUSTED: 1 of 1") as caught:
        fit()
    assert caught.value.run.names == ["rod.rest_curvature.x"]
    with pytest.warns(rodsweep.DistrustedWarning):
        assert fit(allow_distrusted=True).converged


def test_every_path_is_followed_twice_where_asked_for() -> None:
    sweep = rodsweep.Sweep(_rod(), "grid", {"loads.tip_force.x": ("-1 mN", "1 mN", 9)})
    assert not sweep.run().account["path_check"]["all"]
    run = sweep.run(certain=True)
    assert run.account["path_check"]["all"] and run.account["path_check"]["followed"] == 9
    assert run.sensitivity(["tip.position"]).account["checked"] == "9 of 9 samples were checked against the reference"
    assert rodsweep.solve(_rod(), {"loads.tip_force.x": 1e-3}, certain=True).ok


def test_names_and_numbers_are_data() -> None:
    hostile = "\x1b[31mred\x07 \u202e"
    scene = rodsweep.Scene.from_dict({
        "name": hostile,
        "segment": [
            {"name": "rod", "kind": "flexible", "length": 0.1, "stiffness": {"bending": 1e-5, "torsion": 1e-5}}
        ],
    })
    with pytest.raises(rodsweep.InputError) as caught:
        rodsweep.solve(scene, {hostile: 1.0})
    assert "\x1b" not in str(caught.value)
    for tangent in (None, [[1e200, 1e200, 0.0]]):
        with pytest.raises(rodsweep.InputError, match="1e60"):
            rodsweep.control(scene, [[1e300, 0, 0]] if tangent is None else [[0, 0.01, 0.09]], tangent)
    assert "Apache License" in rodsweep.licenses()
