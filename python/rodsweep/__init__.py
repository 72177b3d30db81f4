"""Batches of static Cosserat rods with Jacobians, on NumPy arrays.

>>> import rodsweep
>>> scene = rodsweep.Scene.from_dict({
...     "field": {"flux_density": [0, "3 T", 0]},
...     "segment": [
...         {"name": "tube", "kind": "flexible", "length": "80 mm", "stiffness": {"bending": 8e-6, "torsion": 6e-6}},
...         {"name": "coil", "kind": "rigid", "length": "13 mm",
...          "coil": {"turns": [30, 30, 100], "area": ["4.7 mm^2", "4.7 mm^2", "1.1 mm^2"], "current": [0, 0, 0]}},
...     ],
... })
>>> solution = rodsweep.solve(scene, {"coil.current.x": [0.0, 0.1, 0.2]}, wrt="coil.current")
>>> solution.tip_position.shape, solution.jacobian.shape
((3, 3), (3, 6, 3))

Numbers are in SI units: metres, newtons, tesla, amperes, radians. Texts with units ("90 mm") and quantities of pint and
astropy are converted wherever a number may stand.
"""

from ._errors import (
    DistrustedRun,
    DistrustedWarning,
    EngineError,
    InputError,
    MissingFileError,
    ResultsError,
    RodsweepError,
    UnitWarning,
)
from ._page import Page
from ._rodsweep import Parts, Table, __version__, licenses
from ._status import Status
from .control import Control, control
from .fit import Fit, fit
from .results import Results
from .scene import Parameter, Scene
from .solution import Contact, Shape, Solution
from .solve import solve
from .studies import ContactMap, Sensitivity, Workspace
from .sweep import Run, Shard, Sweep

__all__ = [
    "Contact",
    "ContactMap",
    "Control",
    "DistrustedRun",
    "DistrustedWarning",
    "EngineError",
    "Fit",
    "InputError",
    "MissingFileError",
    "Page",
    "Parameter",
    "Parts",
    "Results",
    "ResultsError",
    "RodsweepError",
    "Run",
    "Scene",
    "Sensitivity",
    "Shape",
    "Shard",
    "Solution",
    "Status",
    "Sweep",
    "Table",
    "UnitWarning",
    "Workspace",
    "__version__",
    "control",
    "fit",
    "licenses",
    "solve",
]
