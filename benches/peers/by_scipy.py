"""SciPy as most would write it first: solve_ivp with DOP853, fsolve, Jacobian by forward differences."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import rod


def solve(scene, theta, tolerance):
    def shoot(m0, theta, load=1.0):
        currents, n = load * theta[:3], load * theta[3:6]
        y = rod.base(m0, np)
        for index, length in enumerate((theta[rod.INSERTION], scene.distal)):
            f = lambda s, y: rod.slopes(y, n, theta[rod.OWN[index]], np)
            y = solve_ivp(f, (0.0, length), y, method="DOP853", rtol=tolerance, atol=tolerance).y[:, -1]
            if index == 0:
                y = rod.across(y, scene, n, currents, np)
        return y

    equilibrium = lambda theta, m0, load=1.0: fsolve(lambda m0: shoot(m0, theta, load)[12:15], m0, xtol=1e-10)
    m0 = np.zeros(3)
    for load in rod.LOADS:
        m0 = equilibrium(theta, m0, load)
    tip = shoot(m0, theta)
    columns = []
    for k in range(len(theta)):
        moved = theta.copy()
        moved[k] += 1e-5
        columns.append((shoot(equilibrium(moved, m0), moved) - tip) / 1e-5)
    return tip, np.array(columns).T
