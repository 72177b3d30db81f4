"""Quantities of pint and astropy, texts with units, and bare numbers that look like another unit."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodsweep


def of_pint(values: Any, unit: str) -> Any:
    return pytest.importorskip("pint").get_application_registry().Quantity(values, unit)


def of_astropy(values: Any, unit: str) -> Any:
    return pytest.importorskip("astropy.units").Quantity(values, unit)


@pytest.fixture(params=[of_pint, of_astropy], ids=["pint", "astropy"])
def quantity(request: pytest.FixtureRequest) -> Callable[[Any, str], Any]:
    """Makes a quantity."""
    return request.param


@pytest.fixture(autouse=True)
def no_unit_warning() -> Iterator[None]:
    """A test that waits for no doubt must not meet one."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", rodsweep.UnitWarning)
        yield


def value_of(scene: rodsweep.Scene, name: str) -> float:
    return {parameter.name: parameter.value for parameter in scene.parameters()}[name]


def test_quantities_are_what_their_numbers_in_si_are(p6: rodsweep.Scene, quantity: Any) -> None:
    lengths = np.linspace(88, 95, 5)
    plain = rodsweep.solve(
        p6, {"insertion": lengths * 1e-3, "coil.current": np.full((5, 3), 0.05), "base.rotation.x": 0.25 * math.pi}
    )
    found = rodsweep.solve(
        p6,
        {
            "insertion": quantity(lengths, "mm"),
            "coil.current": quantity(np.full((5, 3), 50.0), "mA"),
            "base.rotation.x": quantity(45.0, "deg"),
        },
    )
    assert np.allclose(found.tip_position, plain.tip_position, rtol=0, atol=1e-12)
    with pytest.raises(rodsweep.InputError, match="'2'"):
        rodsweep.solve(p6, {"insertion": [0.09, "2"]})
    # A list of them, also of two units.
    listed = rodsweep.solve(p6, {"insertion": [quantity(88.0, "mm"), quantity(0.095, "m"), "90 mm", 0.09]})
    assert np.allclose(listed.values["insertion"], [0.088, 0.095, 0.09, 0.09], rtol=1e-15)


@pytest.mark.parametrize(
    ("name", "value", "unit", "expected"),
    [
        ("proximal.youngs_modulus", 5.0, "MPa", 5e6),
        ("proximal.rest_curvature.x", 2.0, "1/m", 2.0),
        ("proximal.rest_curvature.x", 2.0, "rad/m", 2.0),
        ("loads.tip_force.y", 3.0, "mN", 3e-3),
        ("loads.tip_moment.y", 3.0, "uN*m", 3e-6),
        ("loads.fluid_density", 1.06, "g/cm**3", 1060.0),
        ("coil.area.z", 11.0, "mm**2", 1.1e-5),
        ("loads.gravity.z", 9.0, "m/s**2", 9.0),
        ("coil.mass", 60.0, "mg", 6e-5),
        ("proximal.linear_density", 0.29, "g/m", 2.9e-4),
        ("field.flux_density.y", 1500.0, "mT", 1.5),
    ],
)
def test_every_kind_of_unit(
    p6: rodsweep.Scene, quantity: Any, name: str, value: float, unit: str, expected: float
) -> None:
    given = quantity(value, unit)
    assert value_of(p6.with_values({name: given}), name) == pytest.approx(expected, rel=1e-14)
    found = rodsweep.solve(p6, {name: given}, engine="cpu").values[name]
    assert float(found) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "unit"), [("insertion", "kg"), ("insertion", "deg"), ("insertion", ""), ("coil.current", "V")]
)
def test_a_wrong_dimension_is_refused(p6: rodsweep.Scene, quantity: Any, name: str, unit: str) -> None:
    given = quantity(0.09, unit)
    for call in (lambda: rodsweep.solve(p6, {name: given}), lambda: p6.with_values({name: given})):
        with pytest.raises(rodsweep.InputError) as error:
            call()
        assert name in str(error.value) and error.value.key == name


def scene_tables(length: Any, force: Any, modulus: Any, rotation: Any) -> dict[str, Any]:
    return {
        "base": {"rotation": rotation},
        "segment": [
            {
                "name": "rod",
                "kind": "flexible",
                "length": length,
                "tube": {"inner_radius": 0.0, "outer_radius": "0.5 mm"},
                "youngs_modulus": modulus,
                "poisson_ratio": 0.3,
            }
        ],
        "loads": {"tip_force": force},
    }


def test_dictionaries_take_quantities(quantity: Any) -> None:
    scene = rodsweep.Scene.from_dict(
        scene_tables(
            quantity(90.0, "mm"),
            quantity(np.array([0.0, 2.0, 0.0]), "mN"),
            quantity(2.0, "GPa"),
            [quantity(20.0, "deg"), 0, 0],
        )
    )
    plain = rodsweep.Scene.from_dict(scene_tables("90 mm", [0, "2 mN", 0], "2 GPa", ["20 deg", 0, 0]))
    for one, other in zip(scene.parameters(), plain.parameters(), strict=True):
        assert one.value == pytest.approx(other.value, rel=1e-14), one.name
    with pytest.raises(rodsweep.InputError, match="length") as error:
        rodsweep.Scene.from_dict(scene_tables(quantity(90.0, "deg"), [0, 0, 0], 2e9, [0, 0, 0]))
    assert error.value.key == "segment[0].length"
    with pytest.raises(rodsweep.InputError, match="length"):
        rodsweep.Scene.from_dict(scene_tables(quantity(90.0, ""), [0, 0, 0], 2e9, [0, 0, 0]))


def test_sweeps_take_quantities(p6: rodsweep.Scene, quantity: Any) -> None:
    axes = {
        "coil.current.x": (quantity(-50.0, "mA"), quantity(50.0, "mA"), 3),
        "insertion": (quantity(9, "cm"), "94 mm", 2),
    }
    sweep = rodsweep.Sweep(p6, "grid", axes)
    assert np.allclose(sweep.values()["coil.current.x"][:3], [-0.05, 0, 0.05])
    assert sweep.axes[1]["from"] == pytest.approx(0.09)
    listed = rodsweep.Sweep(p6, "grid", [{"parameter": "insertion", "values": quantity(np.array([90.0, 93.0]), "mm")}])
    assert np.allclose(listed.values()["insertion"], [0.09, 0.093])
    table = rodsweep.Sweep.from_values(p6, {"insertion": quantity(np.array([90.0, 93.0]), "mm")})
    assert np.allclose(table.values()["insertion"], [0.09, 0.093])


def test_studies_take_quantities_and_texts(p6: rodsweep.Scene, root: Path, quantity: Any) -> None:
    sweep = rodsweep.Sweep.from_file(root / "sweeps/volume.toml")
    sizes = [sweep.workspace(voxel=v, fast=True, engine="cpu").account for v in (8e-3, "8 mm", quantity(8.0, "mm"))]
    assert sizes[0] == sizes[1] == sizes[2]
    with pytest.raises(rodsweep.InputError, match="mass") as error:
        sweep.workspace(voxel="8 kg")
    assert error.value.key == "voxel"
    with pytest.raises(rodsweep.InputError) as error:
        sweep.workspace(voxel=quantity(8.0, "s"))
    assert error.value.key == "voxel"
    target = np.array([[0.0, -0.03, 0.085]])
    limits = {"coil.current": quantity(300.0, "mA"), "insertion": (quantity(8.0, "cm"), 0.1)}
    found = rodsweep.control(p6, quantity(1e3 * target, "mm"), inputs=limits, tolerance=quantity(0.1, "mm"))
    plain = rodsweep.control(p6, target, inputs={"coil.current": 0.3, "insertion": (0.08, 0.1)}, tolerance=1e-4)
    assert np.allclose(found.values, plain.values, rtol=1e-9)
    fits = [
        rodsweep.fit(p6, tip, values={"coil.current": 0.01}, free="proximal.rest_curvature.x", noise=noise)
        for tip, noise in ((plain.tip_position, 1e-3), (quantity(1e3 * plain.tip_position, "mm"), "1 mm"))
    ]
    assert np.allclose(fits[0].value, fits[1].value, rtol=1e-9)
    study = rodsweep.Sweep.from_file(root / "sweeps/p6_errors.toml")
    texts = [str(study.sensitivity(limit=64, noise=noise, engine="cpu")) for noise in (1e-3, quantity(1.0, "mm"))]
    assert texts[0] == texts[1]


def test_arrays_with_units_of_others(p6: rodsweep.Scene) -> None:
    xarray = pytest.importorskip("xarray")
    named = xarray.DataArray([88.0, 94.0], dims="sample", attrs={"units": "mm"})
    assert np.allclose(rodsweep.solve(p6, {"insertion": named}).values["insertion"], [0.088, 0.094])
    assert np.allclose(rodsweep.solve(p6, {"insertion": named.drop_attrs() / 1e3}).values["insertion"], [0.088, 0.094])
    with pytest.raises(rodsweep.InputError, match="mass"):
        rodsweep.solve(p6, {"insertion": named.assign_attrs(units="kg")})

    class Foreign(float):
        units = "furlong"

    for call in (
        lambda: rodsweep.solve(p6, {"insertion": Foreign(0.09)}),
        lambda: rodsweep.solve(p6, {"insertion": [0.09, Foreign(0.09)]}),
        lambda: p6.with_values({"insertion": Foreign(0.09)}),
        lambda: rodsweep.Scene.from_dict(scene_tables(Foreign(0.09), [0, 0, 0], 2e9, [0, 0, 0])),
        lambda: rodsweep.control(p6, np.array([[0, 0, 0.09]]), inputs={"insertion": Foreign(0.1)}),
    ):
        with pytest.raises(rodsweep.InputError, match="pint"):
            call()


def test_differentiable_functions_take_quantities(p6: rodsweep.Scene, quantity: Any) -> None:
    from rodsweep._differentiable import Model

    model = Model(p6, ["insertion", "coil.current"], ["tip_position"], 3, {"engine": "cpu"})
    stack = lambda columns: np.stack([np.asarray(column, float) for column in columns], axis=-1)
    theta = model.theta({"insertion": quantity(90.0, "mm"), "coil.current": quantity(np.full(3, 50.0), "mA")}, stack)
    assert np.allclose(theta, [0.09, 0.05, 0.05, 0.05])


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("insertion", 90, r"`insertion` is 90 m, 950 times the scene's; metres\?"),
        ("insertion", np.array([88.0, 90.0]), r"`insertion` is 90 m, 950 times"),
        ("base.rotation.x", 90, r"`base.rotation.x` is 90 rad, 14 turns; radians\?"),
        ("proximal.youngs_modulus", 8, r"`proximal.youngs_modulus` is 8 Pa, 1/670,000 of the scene's; pascals\?"),
        ("proximal.tube.outer_radius", 1.6, r"1,000 times the scene's; metres\?"),
        ("base.position.x", 90.0, r"metres\?"),
        ("field.flux_density.x", 3000.0, r"1,000 times the scene's; teslas\?"),
    ],
)
def test_bare_numbers_out_of_proportion_are_told(p6: rodsweep.Scene, name: str, value: Any, words: str) -> None:
    with pytest.warns(rodsweep.UnitWarning, match=words) as told:
        rodsweep.Sweep.from_values(p6, {name: value})
    assert told[0].filename == __file__
    with pytest.warns(rodsweep.UnitWarning, match=words):
        p6.with_values({name: np.max(value)})
    with pytest.warns(rodsweep.UnitWarning, match=words):
        rodsweep.Sweep(p6, "sobol", {name: (0.5 * np.max(value), float(np.max(value)))}, samples=4)


def test_solving_tells_it_before_it_begins(p6: rodsweep.Scene) -> None:
    with pytest.warns(rodsweep.UnitWarning, match="14 turns") as told:
        rodsweep.solve(p6, {"base.rotation.x": [0.0, 90.0]}, engine="cpu")
    assert told[0].filename == __file__


def test_bare_lengths_of_options_are_told(p6: rodsweep.Scene, root: Path) -> None:
    with pytest.warns(rodsweep.UnitWarning, match=r"`positions` is 85 m, .* times the rod's length; metres\?"):
        rodsweep.control(p6, [[0.0, -30.0, 85.0]], inputs={"coil.current": 0.3}, engine="cpu", allow_distrusted=True)
    with pytest.warns(rodsweep.UnitWarning, match=r"`voxel` is 8 m, 85 times the rod's length"):
        rodsweep.Sweep.from_file(root / "sweeps/volume.toml").workspace(voxel=8, fast=True, engine="cpu")
    with pytest.warns(rodsweep.UnitWarning, match=r"`segment\[0\].length` is 90 m; metres\?"):
        rodsweep.Scene.from_dict(scene_tables(90, [0, 0, 0], 2e9, [0, 0, 0]))
    with pytest.warns(rodsweep.UnitWarning, match=r"`segment\[0\].youngs_modulus` is 8 Pa; pascals\?"):
        rodsweep.Scene.from_dict(scene_tables(0.09, [0, 0, 0], 8, [0, 0, 0]))
    with pytest.warns(rodsweep.UnitWarning, match=r"`base.rotation` holds 90 rad; radians\?"):
        rodsweep.Scene.from_dict(scene_tables(0.09, [0, 0, 0], 2e9, [90, 0, 0]))


def test_texts_with_units_are_never_doubted(p6: rodsweep.Scene, quantity: Any) -> None:
    p6.with_values({"insertion": "90 m", "base.rotation.x": "900 deg", "proximal.youngs_modulus": "8 Pa"})
    p6.with_values({"insertion": quantity(90.0, "m")})


def test_no_false_alarm_on_shipped_scenes(root: Path) -> None:
    """Each number of each scene, from a tenth to ten times its own and with either sign, and ordinary loads."""
    from rodsweep._values import Columns

    files = sorted((root / "sweeps/scenes").glob("*.toml"))
    assert len(files) >= 7
    for file in files:
        scene = rodsweep.Scene.from_file(file)
        for parameter in scene.parameters():
            # A turn of the base is never ten of them.
            most = 2 if parameter.unit == "rad" else 10
            Columns.of(scene, {parameter.name: [0.1 * parameter.value, most * parameter.value]})
        for name, value in (
            ("loads.tip_force", 0.5),
            ("loads.tip_moment", 0.01),
            ("base.position", 1.0),
            ("base.rotation", math.pi),
            ("field.flux_density", 7.0),
        ):
            Columns.of(scene, {name: [[-value] * 3, [value] * 3]})
    for file in sorted((root / "sweeps").glob("*.toml")):
        if "[sampling]" in file.read_text():
            rodsweep.Sweep.from_file(file)


def test_a_file_that_is_missing_is_a_file_not_found_error(tmp_path: Path) -> None:
    (tmp_path / "sweep.toml").write_text('scene = "none.toml"\n[sampling]\nmethod = "grid"\n')
    (tmp_path / "table.toml").write_text('scene = "scene.toml"\n[sampling]\nmethod = "table"\nfile = "none.csv"\n')
    segment = {"name": "rod", "kind": "flexible", "length": 0.1, "stiffness": {"bending": 1e-5, "torsion": 1e-5}}
    (tmp_path / "scene.toml").write_text(rodsweep.Scene.from_dict({"segment": [segment]}).to_toml())
    for call in (
        lambda: rodsweep.Scene.from_file(tmp_path / "none.toml"),
        lambda: rodsweep.Sweep.from_file(tmp_path / "none.toml"),
        lambda: rodsweep.Sweep.from_file(tmp_path / "sweep.toml"),
        lambda: rodsweep.Sweep.from_file(tmp_path / "table.toml"),
        lambda: rodsweep.Results.open(tmp_path / "none"),
    ):
        for kind in (FileNotFoundError, rodsweep.InputError, rodsweep.ResultsError):
            with pytest.raises(kind, match=r"none|sweep|table") as error:
                call()
        assert isinstance(error.value, rodsweep.MissingFileError)
        assert error.value.filename and "none" in str(error.value)
    # A file that is there and wrong is not missing.
    (tmp_path / "wrong.toml").write_text("x = 1\n")
    with pytest.raises(rodsweep.InputError) as wrong:
        rodsweep.Scene.from_file(tmp_path / "wrong.toml")
    assert not isinstance(wrong.value, FileNotFoundError)
    with pytest.raises(rodsweep.ResultsError) as empty:
        rodsweep.Results.open(tmp_path)
    assert not isinstance(empty.value, FileNotFoundError)


def test_bad_parameters_say_why(p6: rodsweep.Scene) -> None:
    solution = rodsweep.solve(p6, {"insertion": [0.09, -0.1]}, engine="cpu")
    assert solution.status_name.tolist()[1] == "bad-parameter"
    assert "`proximal.length` is -0.13" in solution.why(1) and "not negative" in solution.why(1)
    assert "`proximal.length` is -0.13" in repr(solution) and "row 1" in repr(solution)
    assert solution.why(0).startswith(solution.status_name[0])
    with pytest.raises(rodsweep.InputError, match="no row"):
        solution.why(2)
    run = rodsweep.Sweep.from_values(p6, {"insertion": [0.09, -0.1]}).run(engine="cpu", allow_distrusted=True)
    assert "`proximal.length` is -0.13" in run.why(1)
    with pytest.raises(rodsweep.InputError, match="no row of sample 7"):
        run.why(7)


def test_statuses_are_words() -> None:
    assert str(rodsweep.Status.STEP_LIMIT) == f"{rodsweep.Status.STEP_LIMIT}" == "step-limit"
    assert f"{rodsweep.Status.FOLD:d}" == "3" and f"{rodsweep.Status.FOLD:>6}" == "  fold"
    assert rodsweep.Status.FOLD == 3 and all(status.meaning.endswith(".") for status in rodsweep.Status)
