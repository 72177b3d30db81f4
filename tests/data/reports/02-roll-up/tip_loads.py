"""Clamped rods under a dead tip force, a dead tip moment and their weight, for tip_loads.json.

solve_bvp of SciPy follows the rod from rest in equal load steps. Unknown along the rod: position, rotation as a quaternion,
internal moment (world frame). The end is sharpened by shooting with DOP853. Usage: python tip_loads.py > tip_loads.json
"""
import json
import sys

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import root

LENGTH = 10.0
STEPS = 40
EI = 1e4
CASES = [
    dict(K=[EI, EI, EI], force=[0, 0, 0], moment=[0, 6000, 0], weight=[0, 0, 0]),
    dict(K=[EI, EI, EI], force=[40, 10, 120], moment=[0, 4000, 0], weight=[0, 0, 0]),
    dict(K=[EI, EI, EI / 1.3], force=[0, 30, 60], moment=[300, 3500, 900], weight=[0, 0, 0]),
    dict(K=[EI, EI, 3e3], force=[20, 0, 50], moment=[0, 2500, 0], weight=[0, -5, 0]),
    dict(K=[2e3, EI, EI / 1.3], force=[0, 5, 20], moment=[0, 3000, 200], weight=[1, 0, -2]),
    dict(K=[EI, EI, EI / 1.3], force=[0, 0, 200], moment=[0, 0, 6000], weight=[0, -8, 0]),
    dict(K=[EI, EI, EI / 1.3], force=[-60, 20, 0], moment=[1500, 5000, 0], weight=[0, 0, 3]),
]


def rotation(q):
    w, x, y, z = q
    return np.array([
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ])


def slope(s, y, share, case):
    """In units of the length and of EI / length."""
    q, m = y[3:7], y[7:10]
    R = rotation(q)
    u = np.einsum("jik,jk->ik", R, m) / (np.array(case["K"]) / EI)[:, None]
    scale = share * LENGTH**2 / EI
    n = scale * (np.array(case["force"])[:, None] + LENGTH * np.array(case["weight"])[:, None] * (1 - s))
    turned = q[0] * u + np.cross(q[1:4], u, axis=0)
    return np.concatenate([R[:, 2], [-0.5 * np.sum(q[1:4] * u, axis=0)], 0.5 * turned, -np.cross(R[:, 2], n, axis=0)])


def solve(case):
    moment = np.array(case["moment"], float) * LENGTH / EI
    s = np.linspace(0, 1, 41)
    y = np.zeros((10, s.size))
    y[2], y[3] = s, 1
    for share in np.linspace(0, 1, STEPS + 1)[1:]:
        ends = lambda a, b: np.concatenate([a[0:3], a[3:7] - [1, 0, 0, 0], b[7:10] - share * moment])
        found = solve_bvp(lambda s, y: slope(s, y, share, case), ends, s, y, tol=1e-5, max_nodes=5000)
        assert found.success, (case, share, found.message)
        s = np.linspace(0, 1, 81)
        y = found.sol(s)
    shot = lambda m0: solve_ivp(
        lambda s, y: slope(np.array([s]), y[:, None], 1.0, case)[:, 0], (0, 1),
        np.concatenate([[0, 0, 0, 1, 0, 0, 0], m0]), method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    sharp = root(lambda m0: shot(m0)[7:10] - moment, y[7:10, 0], tol=1e-13)
    end = shot(sharp.x)
    assert np.abs(sharp.x - y[7:10, 0]).max() < 1e-3 and np.abs(end[7:10] - moment).max() < 1e-9, sharp
    q = end[3:7] / np.linalg.norm(end[3:7])
    return dict(tip=(end[0:3] * LENGTH).tolist(), rotation=rotation(q).tolist(), base_moment=(sharp.x * EI / LENGTH).tolist())


cases = []
for case in CASES:
    try:
        cases.append(dict(case, length=LENGTH, **solve(case)))
        print(case, cases[-1]["tip"], file=sys.stderr, flush=True)
    except AssertionError as lost:
        print("lost", lost, file=sys.stderr, flush=True)
how = "tip_loads.py: solve_bvp of SciPy from rest in 40 load steps, sharpened by shooting with DOP853; m, N, N·m"
print(json.dumps(dict(how=how, cases=cases), indent=1, ensure_ascii=False))
