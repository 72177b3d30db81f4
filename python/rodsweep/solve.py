"""Many samples of one scene in one call."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _rodsweep
from ._errors import InputError, judge
from ._progress import Listener, Shown
from ._units import number
from ._values import Columns, names_of
from .scene import Scene, check_scene
from .solution import Solution


def solve(
    scene: Scene,
    values: Mapping[str, Any] | None = None,
    wrt: str | Sequence[str] | None = None,
    *,
    tolerance: float = 1e-6,
    engine: str = "auto",
    precision: str | None = None,
    threads: int | None = None,
    branch: str = "from_rest",
    all_branches: bool = False,
    method: Mapping[str, Any] | None = None,
    spot_check: bool | None = None,
    certain: bool = False,
    allow_distrusted: bool = False,
    progress: Listener = None,
) -> Solution:
    """Solves equilibria of a scene for many values at once, and differentiates their tips.

    It is the same computation as a sweep of the command line with ``method = "table"``: the same choice of engine,
    stepper and steps, the same second attempts, the same statuses, on the CPU the same bits.

    Parameters
    ----------
    scene : Scene
        The rod.
    values : dict, optional
        Names of parameters, or of groups such as ``coil.current``, to numbers or arrays in SI units. Arrays broadcast
        against each other; those of a group hold its components along their last axis. Texts with a unit ("90 mm"),
        lists of them, and quantities of pint and astropy are converted. A bare number far out of proportion to the
        scene's own warns (:class:`UnitWarning`).
    wrt : str or sequence of str, optional
        What to differentiate by: k parameters; a group stands for its components.
    tolerance : float
        Target error of tip position over rod length and of tip rotation (rad), between 0 and 1.
    engine : {"auto", "gpu", "cpu", "reference"}
        What solves. ``auto`` takes a GPU that meets the tolerance where there is one, else the CPU.
    precision : {"f32", "f64", "auto"}, optional
        Arithmetic: by default, and by ``auto``, f32 on a GPU and f64 elsewhere.
    threads : int, optional
        Threads of the CPU engine; by default one for each core.
    branch : {"from_rest", "all"}
        The equilibrium that is reached from rest, or every one that can be found.
    all_branches : bool
        The same as ``branch="all"``.
    method : dict, optional
        :attr:`Solution.method` of another solution: engine, precision, stepper, steps and tolerance as there, with no
        pilot run. Loops that solve alike batches many times gain from it.
    spot_check : bool, optional
        Whether a share of the samples is solved again by the reference; see :attr:`Solution.spot_check`. By default one
        of a thousand, from a thousand samples on; :attr:`Solution.checked` says it. True: at least 256.
    certain : bool
        Whether every path from rest is followed twice, as ``rodsweep run --certain``.
    allow_distrusted : bool
        Whether to warn, and not to raise, where the reference contradicts a sample.
    progress : callable or True, optional
        Called with samples done, samples in all, samples failed, samples a second. True shows a bar (tqdm), or plain
        lines on the standard error without that package.

    Returns
    -------
    Solution
        Arrays of shape (n, ...), or without n where all values are numbers.

    Raises
    ------
    InputError
        A name, a value or an argument that makes no sense; ``error.key`` says which.
    EngineError
        An engine that cannot be used.
    DistrustedRun
        The reference contradicts a sample that was checked; the solution is in ``error.run``.

    Notes
    -----
    The GIL is released. Ctrl-C interrupts within 0.2 s.

    Examples
    --------
    >>> import numpy as np
    >>> scene = Scene.from_dict({
    ...     "segment": [{
    ...         "name": "rod", "kind": "flexible", "length": 0.1,
    ...         "stiffness": {"bending": 1e-5, "torsion": 1e-5},
    ...     }],
    ... })
    >>> force = np.linspace(0, 1e-3, 5)
    >>> solution = solve(scene, {"loads.tip_force.y": force}, wrt=["loads.tip_force", "insertion"])
    >>> solution.tip_position.shape
    (5, 3)
    >>> solution.ok.all()
    np.True_
    >>> solution.d("tip_position", "loads.tip_force").shape
    (5, 3, 3)
    """
    check_scene(scene)
    if all_branches:
        branch = "all"
    columns = Columns.of(scene, values)
    with Shown(progress, columns.count) as listener:
        solution = _solve(
            scene,
            columns,
            names_of("wrt", wrt),
            tolerance=number("tolerance", tolerance, ""),
            engine=engine,
            precision=precision,
            threads=_count("threads", threads),
            branch=branch,
            method=method,
            spot_check=None if spot_check is None else bool(spot_check),
            certain=bool(certain),
            progress=listener,
        )
    judge(solution, solution._answer["distrust"], None, allow_distrusted)
    return solution


def _solve(
    scene: Scene,
    columns: Columns,
    wrt: list[str],
    *,
    tolerance: float,
    engine: str = "auto",
    precision: str | None = None,
    threads: int | None = None,
    branch: str = "from_rest",
    method: Mapping[str, Any] | None = None,
    spot_check: bool | None = False,
    certain: bool = False,
    lenient: bool = False,
    progress: Callable[..., object] | None = None,
) -> Solution:
    """The same for columns. Lenient: rows with a value that is not finite get the status ``bad-parameter``."""
    for key, word in (("engine", engine), ("branch", branch), ("precision", precision)):
        if not isinstance(word, str) and (word is not None or key != "precision"):
            raise InputError(f"`{key}`: is of type {type(word).__name__}; give a text", key)
    try:
        text = None if method is None else json.dumps(dict(method))
    except (TypeError, ValueError) as error:
        raise InputError(f"`method`: {error}; give the `method` of a solution", "method") from None
    answer = _rodsweep.solve(
        scene._native,
        columns.names,
        columns.columns,
        columns.count,
        # Names in full are found at once.
        [component for name in wrt for component in scene.components(name)],
        engine=engine,
        precision=precision,
        tolerance=tolerance,
        branch=branch,
        threads=threads,
        method=text,
        spot_check=spot_check,
        certain=certain,
        lenient=lenient,
        progress=progress,
    )
    return Solution._of(scene, columns, wrt, branch, dict(answer))


def _count(key: str, value: Any, least: int = 1, most: int = 2**63 - 1) -> int | None:
    if value is None:
        return None
    try:
        count = operator.index(value)
    except TypeError:
        raise InputError(f"`{key}`: is {value!r}; give a whole number, or None", key) from None
    if isinstance(value, bool) or not least <= count <= most:
        raise InputError(f"`{key}`: is {value!r}; give a whole number from {least}, or None", key)
    return count
