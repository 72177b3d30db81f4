"""C++ by hand (rod.cpp), a sample at a time: fixed steps, variational equations, vectorised over columns."""

import ctypes
import os
import subprocess
import tempfile

import numpy as np

import rod
from tableaus import TABLEAUS

FLAGS = ["-O3", "-march=native", "-ffast-math", "-funroll-loops", "-std=c++17", "-shared", "-fPIC"]


def compiler():
    """Name and version; an ImportError where there is none."""
    try:
        return subprocess.run(["g++", "-dumpfullversion"], capture_output=True, text=True, check=True).stdout.strip()
    except OSError as error:
        raise ImportError("there is no g++") from error


def library():
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "rod.cpp")
    with tempfile.TemporaryDirectory() as folder:
        built = os.path.join(folder, "rod.so")
        subprocess.run(["g++", *FLAGS, source, "-o", built], check=True)
        return ctypes.CDLL(built)


def solver(built, scene, method, steps, tolerance):
    flexible = scene.rest[3] + scene.distal
    counts = [max(1, round(steps * length / flexible)) for length in (scene.rest[3], scene.distal)]
    numbers = np.concatenate([scene.turns_area.ravel(), scene.field, [scene.rigid, scene.distal]])
    A, b = (np.ascontiguousarray(x, dtype=float) for x in TABLEAUS[method])
    steps_of = np.array(counts, dtype=np.int32)
    at = lambda array: array.ctypes.data_as(ctypes.c_void_p)

    def solve(thetas):
        thetas = np.ascontiguousarray(thetas)
        tips, jacobians = np.empty((len(thetas), rod.STATE)), np.empty((len(thetas), rod.STATE, thetas.shape[1]))
        built.solve_samples(
            len(thetas), at(thetas), at(numbers), len(b), at(A), at(b), at(steps_of), ctypes.c_double(tolerance), at(tips), at(jacobians)
        )
        return tips, jacobians

    return solve
