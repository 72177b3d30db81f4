"""What comes of solving: statuses, tips, Jacobians, shapes."""

from __future__ import annotations

import json
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _frames, _html, _rodsweep
from ._errors import InputError
from ._rodsweep import Table
from ._status import Status
from ._values import Columns, Floats, names_of
from ._why import why_values
from .scene import Scene

_WORDS = np.array(_rodsweep.STATUSES)
_OK = np.array([status <= Status.RAMPED for status in Status])
_OTHER_EQUILIBRIA = (Status.UNSTABLE, Status.THROUGH_WALL)
_CONVERGED = np.array([status <= Status.RAMPED or status in _OTHER_EQUILIBRIA for status in Status])
# Columns of the library's block of numbers.
_COLUMNS: dict[str, int | slice] = {
    "tip_position": slice(0, 3),
    "tip_rotation": slice(3, 6),
    "base_curvature": slice(6, 9),
    "stability_margin": 9,
    "error_estimate": 10,
    "base_moment": slice(11, 14),
    "residual": 14,
    "iterations": 15,
    "load_fraction": 16,
    # The last one, behind the derivatives.
    "derivative_error": -1,
}
# Rows of a derivative: of the tip's pose, and with a wall of its force.
_OF_TIP = 6
_OF_FORCE = 4
# Columns of the contact with a wall: attribute, column of the block, components.
_CONTACT = (
    ("gap", "contact.gap", 1),
    ("normal_force", "contact.normal_force", 1),
    ("force", "contact.force.x", 3),
    ("friction_ratio", "contact.friction_ratio", 1),
    ("angle", "contact.angle", 1),
    ("body_gap", "contact.body_gap", 1),
    ("force_error", "contact.force_error", 1),
)
# What is kept of each sample beside its values and slopes.
_ARRAYS = (
    "status_name",
    "tip_position",
    "tip_rotation",
    "tip_tangent",
    "base_curvature",
    "base_moment",
    "stability_margin",
    "stable",
    "error_estimate",
)
_UNITS = {"tip_position": "m", "tip_rotation": "rad", "base_curvature": "1/m", "base_moment": "N·m"}


class Contact:
    """The contact of the tips with the wall of the scene. SI units, world frame; NaN where there is no equilibrium.

    Attributes
    ----------
    touching : ndarray of bool, shape (n,)
        Whether the wall presses; always of a held tip. False where that is not known.
    gap : ndarray, shape (n,)
        Between the tip's ball and the wall; negative where tissue yields (m).
    normal_force : ndarray, shape (n,)
        Of the wall on the rod along the wall's normal; a wall that holds the tip may pull (N).
    force : ndarray, shape (n, 3)
        Of the wall on the rod (N).
    friction_ratio : ndarray, shape (n,)
        The least coefficient of friction that holds the tip: force along the wall over the normal force. NaN where the
        wall does not press.
    holds : ndarray of bool, shape (n,)
        Whether the wall's friction holds a held tip. False where that is not known.
    angle : ndarray, shape (n,)
        Between the direction into the wall and the tip's tangent (rad).
    body_gap : ndarray, shape (n,)
        Least gap of the rest of the rod; 0 where the tip is nearest (m).
    force_error : ndarray, shape (n,)
        Estimated error of the force (N).
    jacobian : ndarray, shape (n, 4, k)
        Derivatives by the parameters of :attr:`Solution.wrt`: row 0 of the normal force, rows 1 to 3 of the force (N
        per unit of the parameter).
    """

    def __init__(self) -> None:
        raise TypeError("contacts come from Solution.contact")

    touching: NDArray[np.bool_]
    gap: Floats
    normal_force: Floats
    force: Floats
    friction_ratio: Floats
    holds: NDArray[np.bool_]
    angle: Floats
    body_gap: Floats
    force_error: Floats
    jacobian: Floats

    @classmethod
    def _of(cls, block: Floats, names: list[str], flags: dict[str, NDArray[np.bool_]], jacobian: Floats) -> Contact:
        self = cls.__new__(cls)
        for attribute, column, components in _CONTACT:
            at = names.index(column)
            setattr(self, attribute, block[at] if components == 1 else np.moveaxis(block[at : at + components], 0, -1))
        self.touching, self.holds = flags["contact.touching"], flags["contact.holds"]
        self.jacobian = jacobian
        return self

    def __repr__(self) -> str:
        return f"<Contact: {int(self.touching.sum())} of {self.touching.size} tips touch the wall>"


class Solution:
    """The answers of :func:`solve`, one a sample. Numbers are NaN where the status says that there is no equilibrium.

    Arrays are views of one block of memory; none is copied a row at a time. Their first axes are those of the values:
    (n, ...) for columns of n values, nothing for plain numbers. With ``branch="all"`` there is a row for each
    equilibrium, and :attr:`sample` says whose it is.
    """

    def __init__(self) -> None:
        raise TypeError("solutions come from rodsweep.solve")

    @classmethod
    def _of(cls, scene: Scene, columns: Columns, wrt: list[str], branch: str, answer: dict[str, Any]) -> Solution:
        self = cls.__new__(cls)
        self.scene = scene
        self._columns = columns
        self._branch = branch
        rows = answer.pop("rows")
        self._shape = (rows,) if branch == "all" else columns.shape
        self._block = answer.pop("numbers").reshape((len(answer["names"]), *self._shape))
        self._status = answer.pop("status").reshape(self._shape)
        self._wrt = [(name, scene.components(name)) for name in wrt]
        self._answer = answer
        return self

    scene: Scene
    """The scene that was solved."""
    _columns: Columns
    _branch: str
    _shape: tuple[int, ...]
    _block: Floats
    _status: NDArray[np.uint8]
    _wrt: list[tuple[str, list[str]]]
    _answer: dict[str, Any]

    # What became of the samples.

    @property
    def status(self) -> NDArray[np.uint8]:
        """Codes of :class:`Status`, shape (n,); :attr:`status_name` has the words."""
        return self._status

    @property
    def status_name(self) -> NDArray[np.str_]:
        """The same as words, such as ``ok`` or ``fold``, shape (n,)."""
        return np.asarray(_WORDS[self._status])

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Whether the row can be used as it stands: in balance and not known to be unstable, shape (n,)."""
        return np.asarray(_OK[self._status])

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether the row is an equilibrium, stable or not, shape (n,)."""
        return np.asarray(_CONVERGED[self._status])

    @property
    def counts(self) -> dict[Status, int]:
        """Rows by status."""
        counts = np.bincount(self._status.reshape(-1), minlength=len(Status))
        return {status: int(counts[status]) for status in Status if counts[status]}

    def why(self, row: int | tuple[int, ...] = ()) -> str:
        """What became of a row, in a sentence: what is wrong with its values where the status is ``bad-parameter``.

        ``row`` is an index into :attr:`status`; without it, of the only one.
        """
        try:
            status = Status(int(self._status[row]))
            values = {name: float(array[row]) for name, array in self.values.items()}
        except (IndexError, TypeError):
            shape = self._status.shape
            raise InputError(f"`row`: {row!r} is no row of a solution of shape {shape}", "row") from None
        return why_values(self.scene, values, status)

    def __len__(self) -> int:
        return self._status.size

    # The tip.

    def _column(self, name: str) -> Floats:
        place = _COLUMNS[name]
        if isinstance(place, slice):
            return np.moveaxis(self._block[place], 0, -1)
        return np.asarray(self._block[place])

    @property
    def tip_position(self) -> Floats:
        """Position of the tip in the world (m), shape (n, 3)."""
        return self._column("tip_position")

    @property
    def tip_rotation(self) -> Floats:
        """Rotation of the tip, body to world, as a rotation vector (rad), shape (n, 3)."""
        return self._column("tip_rotation")

    @property
    def tip_matrix(self) -> Floats:
        """Rotation of the tip, body to world, as matrices, shape (n, 3, 3)."""
        q = self.tip_quaternion
        x, y, z, w = (q[..., k] for k in range(4))
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    @property
    def tip_quaternion(self) -> Floats:
        """Rotation of the tip, body to world, as unit quaternions x, y, z, w, as SciPy has them, shape (n, 4)."""
        vector = self.tip_rotation
        angle = np.linalg.norm(vector, axis=-1, keepdims=True)
        # sinc(x) of NumPy is sin(pi x) / (pi x).
        half = 0.5 * np.sinc(angle / (2 * np.pi))
        return np.concatenate([half * vector, np.cos(0.5 * angle)], axis=-1)

    @property
    def tip_tangent(self) -> Floats:
        """Direction of the rod's axis at the tip, a unit vector in the world, shape (n, 3)."""
        return self.tip_matrix[..., :, 2]

    @property
    def base_moment(self) -> Floats:
        """Internal moment at the base in the world (N·m), shape (n, 3)."""
        return self._column("base_moment")

    @property
    def base_curvature(self) -> Floats:
        """Curvature at the start of the first flexible segment in the body frame (1/m), shape (n, 3)."""
        return self._column("base_curvature")

    @property
    def stability_margin(self) -> Floats:
        """From 1 (free of load) to 0 (about to become unstable); negative or zero where unstable, shape (n,)."""
        return self._column("stability_margin")

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the equilibrium is elastically stable; False where that is not known, shape (n,)."""
        return self._flag("stable")

    @property
    def error_estimate(self) -> Floats:
        """Estimated error of tip position over rod length or of tip rotation (rad), the larger one, shape (n,)."""
        return self._column("error_estimate")

    @property
    def derivative_error(self) -> Floats:
        """Estimated error of the derivatives: of the worst one, (dp/L, w) over its norm, shape (n,).

        1 and more say nothing.
        """
        return self._column("derivative_error")

    @property
    def residual(self) -> Floats:
        """What is left of the balance of moments at the tip, in the unit of moment of the rod, shape (n,)."""
        return self._column("residual")

    @property
    def iterations(self) -> Floats:
        """Passes over the rod, shape (n,)."""
        return self._column("iterations")

    @property
    def load_fraction(self) -> Floats:
        """Share of the full load that was reached from rest, shape (n,).

        Above 1 where the path ends beside a wall: 1 plus the share of its way that the wall came.
        """
        return self._column("load_fraction")

    @property
    def contact(self) -> Contact:
        """Contact of the tip with the wall of the scene.

        Raises :class:`InputError` where the scene has no wall.
        """
        if not self._has_wall:
            raise InputError("`contact`: the scene has no wall; add [wall] to it", "contact")
        flags = {name: self._flag(name) for name in ("contact.touching", "contact.holds")}
        jacobian = np.moveaxis(self._slopes[:, _OF_TIP:], (0, 1), (-1, -2))
        return Contact._of(self._block, self._answer["names"], flags, jacobian)

    @property
    def _has_wall(self) -> bool:
        return "contact.touching" in self._answer

    def _flag(self, name: str) -> NDArray[np.bool_]:
        return np.asarray((self._answer[name] == 1).reshape(self._shape))

    # Derivatives.

    @property
    def wrt(self) -> list[str]:
        """Names of the k parameters of the Jacobian, in the order of its columns."""
        names: list[str] = []
        for _, components in self._wrt:
            names += [name for name in components if name not in names]
        return names

    @property
    def jacobian(self) -> Floats:
        """Derivative of the tip's pose, shape (n, 6, k).

        Rows 0 to 2 are d(position) (m per unit of the parameter); rows 3 to 5 the virtual rotation w in the world (rad
        per unit): dR = hat(w) R for the rotation matrix R.
        """
        return np.moveaxis(self._slopes[:, :_OF_TIP], (0, 1), (-1, -2))

    @property
    def _slopes(self) -> Floats:
        """Derivatives by parameter, then by row."""
        rows = _OF_TIP + (_OF_FORCE if self._has_wall else 0)
        count = rows * len(self.wrt)
        # They end before the last column.
        last = len(self._answer["names"]) - 1
        return self._block[last - count : last].reshape((len(self.wrt), rows, *self._shape))

    def d(self, what: str, by: str) -> Floats:
        """Derivative of ``tip_position`` or ``tip_rotation`` by a parameter or a group.

        With a wall also of ``contact.normal_force`` and ``contact.force``. Shape (n, 3) for a parameter, (n, 3, m) for
        a group of m; without the 3 for the normal force. That of the rotation is the virtual rotation, see
        :attr:`jacobian`.
        """
        rows: dict[str, int | slice] = {"tip_position": slice(0, 3), "tip_rotation": slice(3, 6)}
        if self._has_wall:
            rows |= {"contact.normal_force": 6, "contact.force": slice(7, 10)}
        if what not in rows:
            raise InputError(f"`{what}`: has no derivative here; use one of: {', '.join(rows)}", what)
        components, known = self.scene.components(by), self.wrt
        missing = [name for name in components if name not in known]
        if missing:
            raise InputError(f"`{by}`: was not differentiated by; solve with wrt=[..., {by!r}]", by)
        columns = np.moveaxis(self._slopes, (0, 1), (-1, -2))[..., rows[what], :]
        if components == [by]:
            return columns[..., known.index(by)]
        return columns[..., [known.index(name) for name in components]]

    # Every equilibrium.

    @property
    def sample(self) -> NDArray[np.int64]:
        """Sample of each row, counted from 0 over the values, shape (n,)."""
        if "sample" in self._answer:
            return np.asarray(self._answer["sample"].astype(np.int64))
        return np.arange(len(self), dtype=np.int64).reshape(self._shape)

    @property
    def branch(self) -> NDArray[np.int64]:
        """Number of the equilibrium in its sample, lowest energy first, shape (n,)."""
        if "branch" in self._answer:
            return np.asarray(self._answer["branch"].astype(np.int64))
        return np.zeros(self._shape, dtype=np.int64)

    @property
    def energy(self) -> Floats:
        """Potential energy (J), with ``branch="all"``, shape (n,)."""
        return self._of_branches("energy")

    @property
    def from_rest(self) -> NDArray[np.bool_]:
        """Whether it is the equilibrium that is reached from rest, shape (n,)."""
        return self._of_branches("from_rest") if self._branch == "all" else np.ones(self._shape, dtype=bool)

    @property
    def balanced(self) -> NDArray[np.bool_]:
        """Whether the list of the sample's equilibria may be complete, with ``branch="all"``, shape (n,)."""
        return self._of_branches("balanced")

    def _of_branches(self, name: str) -> NDArray[Any]:
        if name not in self._answer:
            raise InputError(f'`{name}`: is known with branch="all" only', "branch")
        return np.asarray(self._answer[name])

    # How it was solved.

    @property
    def values(self) -> dict[str, Floats]:
        """Values of the parameters that were given, one a row, SI."""
        values = {}
        for name, column in zip(self._columns.names, self._columns.columns, strict=True):
            column = np.broadcast_to(column if column.size != 1 else column[0], (self._columns.count,))
            rows = column[self.sample] if self._branch == "all" else column.reshape(self._shape)
            values[name] = rows
        return values

    @property
    def method(self) -> dict[str, Any] | None:
        """Engine, precision, stepper, steps and tolerance; an argument of :func:`solve`."""
        text = self._answer["method"]
        return None if text is None else dict(json.loads(text))

    @property
    def engine(self) -> str:
        """What solved, in words."""
        return str(self._answer["engine"])

    @property
    def spot_check(self) -> dict[str, Any] | None:
        """How far a share of the samples is from the reference; None unless it was asked for."""
        text = self._answer["spot_check"]
        return None if text is None else dict(json.loads(text))

    @property
    def checked(self) -> str:
        """Whether samples were checked against the reference, in a sentence."""
        return str(self._answer["checked"])

    @property
    def notes(self) -> list[str]:
        """What happened to the engine on the way."""
        return list(self._answer["notes"])

    @property
    def seconds(self) -> float:
        """Time of the library's call (s); what Python adds is not in it."""
        return float(self._answer["seconds"])

    # Shapes.

    def shape(self, n_points: int, *, wrt: bool = False, threads: int | None = None) -> Shape:
        """Points along every rod, evenly spaced from base to tip, integrated by the reference.

        Parameters
        ----------
        n_points : int
            At least 2; the first is the base, the last the tip.
        wrt : bool
            Whether the points are differentiated by the parameters of :attr:`wrt`, too.
        threads : int, optional
            By default one for each core.

        Raises :class:`InputError` for rods beside a wall.
        """
        if self._has_wall:
            text = "`shape`: is not known here beside a wall; use rodsweep solve --shape, or Scene.view"
            raise InputError(text, "shape")
        try:
            count = int(n_points)
        except (TypeError, ValueError):
            raise InputError(f"`n_points`: is {n_points!r}; give a whole number", "n_points") from None
        if not 2 <= count <= 1_000_000:
            raise InputError(f"`n_points`: is {count}; give a number from 2 to 1,000,000", "n_points")
        shares = [k / (count - 1) for k in range(count)]
        moments = np.ascontiguousarray(self.base_moment).reshape(-1)
        columns = list(self._columns.columns)
        if self._branch == "all":
            columns = [np.ascontiguousarray(rows).reshape(-1) for rows in self.values.values()]
        names = self.wrt if wrt else []
        rows = self._status.size
        answer = _rodsweep.shape(
            self.scene._native, self._columns.names, columns, rows, names, moments, shares, threads
        )
        block = answer["numbers"].reshape((*self._shape, count, answer["width"]))
        return Shape._of(block, names)

    # For other packages.

    @property
    def table(self) -> Table:
        """One row a sample, with the columns of result files: values, status, tip, derivatives."""
        known = {parameter.name: parameter.unit for parameter in self.scene.parameters()}

        def flat(array: NDArray[Any]) -> NDArray[Any]:
            return np.ascontiguousarray(array).reshape(-1)

        columns: list[tuple[str, str, Any]] = [("sample", "", flat(self.sample).astype(np.uint64))]
        columns += [(name, known.get(name, ""), flat(array)) for name, array in self.values.items()]
        columns.append(("status", "", flat(self.status_name).tolist()))
        columns += [
            (name, _frames.unit_of_slope(name, known), flat(self._block[at]))
            for at, name in enumerate(self._answer["names"])
            if self._wrt or name != "derivative_error"
        ]
        columns.append(("stable", "", flat(self.stable)))
        if self._has_wall:
            columns += [(name, "", flat(self._flag(name))) for name in ("contact.touching", "contact.holds")]
        if self._branch == "all":
            columns.append(("branch", "", flat(self.branch).astype(np.uint64)))
            columns.append(("energy", "J", flat(self.energy)))
            columns += [("from_rest", "", flat(self.from_rest)), ("balanced", "", flat(self.balanced))]
        return Table._of(columns)

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """Arrays by names that every program takes (letters, digits, ``_``), SI.

        ``scipy.io.savemat("tips.mat", solution.to_dict())`` writes them for MATLAB.
        """
        found: dict[str, NDArray[Any]] = {_frames.plain_name(name): array for name, array in self.values.items()}
        for name in _ARRAYS:
            found[name] = getattr(self, name)
        if self._wrt:
            found |= {"wrt": np.array(self.wrt), "jacobian": self.jacobian, "derivative_error": self.derivative_error}
        if self._has_wall:
            contact = self.contact
            names = [*(attribute for attribute, _, _ in _CONTACT), "touching", "holds"]
            found |= {f"contact_{name}": getattr(contact, name) for name in names}
            found |= {"contact_jacobian": contact.jacobian} if self._wrt else {}
        if self._branch == "all":
            found |= {name: getattr(self, name) for name in ("sample", "branch", "energy", "from_rest", "balanced")}
        return found

    def to_pandas(self) -> Any:
        """:attr:`table` as a data frame of pandas; ``frame.attrs["units"]`` holds the units."""
        return self.table.to_pandas()

    def to_xarray(self) -> Any:
        """A data set of xarray, with units in ``attrs["units"]``.

        One axis of values is the dimension ``sample``. Of several, one along which a single parameter varies has its
        name and its values as coordinates. Vectors have the dimension ``axis`` (x, y, z); ``jacobian`` has ``pose`` and
        ``parameter``.
        """
        xarray = _frames.needed("xarray", "to_xarray")
        known = {parameter.name: parameter.unit for parameter in self.scene.parameters()}
        if self._branch == "all":
            dims: tuple[str, ...] = ("row",)
            coords: dict[str, Any] = {name: ("row", array) for name, array in self.values.items()}
            coords |= {"sample": ("row", self.sample), "branch": ("row", self.branch)}
        else:
            dims, coords = _frames.grid_of(self.values, self._shape)
        coords = {
            name: (dim, array, {"units": known[name]} if known.get(name) else {})
            for name, (dim, array) in coords.items()
        }
        found: dict[str, Any] = {"status": (dims, self.status_name)}
        for name in _ARRAYS[1:]:
            array = getattr(self, name)
            unit = {"units": _UNITS[name]} if name in _UNITS else {}
            found[name] = ((*dims, "axis") if array.ndim > len(dims) else dims, array, unit)
        if self._has_wall:
            contact = self.contact
            for name, column, components in _CONTACT:
                of = _frames.unit_of_slope(column, known)
                along = ("axis",) if components == 3 else ()
                found[f"contact_{name}"] = ((*dims, *along), getattr(contact, name), {"units": of} if of else {})
            found |= {"contact_touching": (dims, contact.touching), "contact_holds": (dims, contact.holds)}
        coords["axis"] = ("axis", ["x", "y", "z"])
        if self._wrt:
            by = [known.get(name, "") for name in self.wrt]
            found["jacobian"] = ((*dims, "pose", "parameter"), self.jacobian, {"units": "m and rad per unit"})
            found["derivative_error"] = (dims, self.derivative_error)
            if self._has_wall:
                found["contact_jacobian"] = ((*dims, "pull", "parameter"), contact.jacobian, {"units": "N per unit"})
                coords["pull"] = ("pull", ["normal", "x", "y", "z"])
            coords["pose"] = ("pose", ["x", "y", "z", "rotation.x", "rotation.y", "rotation.z"])
            coords["parameter"] = ("parameter", self.wrt)
            coords["parameter_unit"] = ("parameter", by)
        if self._branch == "all":
            found |= {"energy": (dims, self.energy, {"units": "J"}), "from_rest": (dims, self.from_rest)}
        return xarray.Dataset(found, coords)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the solution, replacing what is there.

        ``.npz`` holds the arrays of :meth:`to_dict` in their shapes; ``.csv`` and ``.parquet`` hold :attr:`table`, the
        latter with units.
        """
        if _frames.suffix_of(path) == ".npz":
            _frames.save_npz(path, self.to_dict())
        else:
            self.table.save(path)

    # Keeping and showing.

    def __getstate__(self) -> dict[str, Any]:
        columns = self._columns
        state = {name: value for name, value in self.__dict__.items() if name != "_columns"}
        return state | {"_columns": (columns.names, columns.columns, columns.shape)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        state = dict(state)
        state["_columns"] = Columns(*state["_columns"])
        self.__dict__.update(state)

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {status.word}" for status, count in self.counts.items())
        by = f", by {', '.join(names_of('wrt', [name for name, _ in self._wrt]))}" if self._wrt else ""
        bad = np.argwhere(self._status == Status.BAD_PARAMETER)
        # The first one stands for all.
        first = tuple(int(at) for at in bad[0]) if len(bad) else ()
        told = f"; row {', '.join(map(str, first)) or 0} {self.why(first)}" if len(bad) else ""
        return f"<Solution: {len(self)} rows ({counts or 'none'}){by}; {self.engine}{told}>"

    def _repr_html_(self) -> str:
        rows = [[status.word, str(count)] for status, count in self.counts.items()]
        table = _html.table(["status", "rows"], rows)
        shown = np.flatnonzero(self.converged.reshape(-1) & (not self._has_wall))
        shown = shown[np.linspace(0, len(shown) - 1, min(len(shown), 5)).astype(int)] if len(shown) else shown
        picture = _html.rods(list(self._some_rods(shown))) if len(shown) else ""
        return f"<b>Solution</b>, {_html.escape(self.engine)}{_html.beside(table, picture)}"

    def _some_rods(self, rows: NDArray[np.intp]) -> Floats:
        """Centre lines of a few rows."""
        columns = [np.ascontiguousarray(values.reshape(-1)[rows]) for values in self.values.values()]
        moments = np.ascontiguousarray(self.base_moment.reshape(-1, 3)[rows]).reshape(-1)
        shares = [k / 40 for k in range(41)]
        answer = _rodsweep.shape(self.scene._native, self._columns.names, columns, len(rows), [], moments, shares, None)
        return answer["numbers"].reshape(len(rows), 41, answer["width"])[..., 1:4]


class Shape:
    """Points along rods, from base to tip, NaN where there is no equilibrium. SI units.

    Attributes
    ----------
    arc_length : ndarray, shape (n, p)
        From the base (m).
    position : ndarray, shape (n, p, 3)
        In the world (m).
    rotation : ndarray, shape (n, p, 3, 3)
        Matrices, body to world.
    curvature : ndarray, shape (n, p, 3)
        Body frame, zero in rigid segments (1/m).
    position_jacobian, rotation_jacobian, curvature_jacobian : ndarray, shape (n, p, 3, k)
        By the parameters of :attr:`wrt`. Points stay at their share of the length where the length changes. That of
        the rotation is the virtual rotation w in the world: dR = hat(w) R.
    wrt : list of str
        Names of the k parameters.
    """

    def __init__(self) -> None:
        raise TypeError("shapes come from Solution.shape")

    arc_length: Floats
    position: Floats
    rotation: Floats
    curvature: Floats
    position_jacobian: Floats
    rotation_jacobian: Floats
    curvature_jacobian: Floats
    wrt: list[str]

    @classmethod
    def _of(cls, block: Floats, wrt: list[str]) -> Shape:
        self = cls.__new__(cls)
        leading = block.shape[:-1]
        self.arc_length = block[..., 0]
        self.position = block[..., 1:4]
        self.rotation = block[..., 4:13].reshape((*leading, 3, 3))
        self.curvature = block[..., 13:16]
        slopes = np.moveaxis(block[..., 16:].reshape((*leading, len(wrt), 3, 3)), -3, -1)
        self.position_jacobian = slopes[..., 0, :, :]
        self.rotation_jacobian = slopes[..., 1, :, :]
        self.curvature_jacobian = slopes[..., 2, :, :]
        self.wrt = wrt
        return self

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.position, dtype=dtype, copy=True if copy else None)

    def __repr__(self) -> str:
        return f"<Shape: position {self.position.shape}, {len(self.wrt)} derivatives>"

    def _repr_html_(self) -> str:
        rods = self.position.reshape((-1, *self.position.shape[-2:]))
        return f"<b>Shape</b> {self.position.shape}<br>{_html.rods(list(rods[:5]))}"
