"""Shooting in SciPy's best form: fsolve with the Jacobian from variational columns, slopes compiled by Numba.

Unknown are the base moment and the force. Columns are virtual rotation, position and moment (w, dp, dm) by each.
DOP853 of solve_ivp takes fewer slopes for tight tolerances, odeint (LSODA) spends less on each.
"""

import numba
import numpy as np
from scipy.integrate import odeint, solve_ivp
from scipy.optimize import fsolve

from rod import hat

DERIVATIVES = "variational columns"
STEPS = (None,)
STATE, COLUMN = 15, 9
# Tau of the wall's coming, after the free rod under growing loads.
LOADS = {"p6-tissue": (1.0,), "p6-held": (0.5, 1.0)}
COMING = {"p6-tissue": (1.0,), "p6-held": (0.5, 1.0)}


@numba.njit(cache=False)
def cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=False)
def slopes(s, y, length, n_end, weight, stiffness, rest, first_force):
    """first_force: which column is the first of three by the force, -1 where there are none."""
    d = np.empty_like(y)
    n = n_end + weight * (length - s)
    R = y[3:12].copy().reshape(3, 3)
    m = y[12:15]
    v, u, t = np.empty(3), np.empty(3), R[:, 2].copy()
    for j in range(3):
        u[j] = rest[j] + (R[0, j] * m[0] + R[1, j] * m[1] + R[2, j] * m[2]) / stiffness[j]
    d[:3] = t
    for i in range(3):
        d[3 + 3 * i] = R[i, 1] * u[2] - R[i, 2] * u[1]
        d[4 + 3 * i] = R[i, 2] * u[0] - R[i, 0] * u[2]
        d[5 + 3 * i] = R[i, 0] * u[1] - R[i, 1] * u[0]
    cross(n, t, d[12:15])
    q, e = np.empty(3), np.empty(3)
    for c in range((len(y) - STATE) // COLUMN):
        k = STATE + COLUMN * c
        w = y[k : k + 3]
        cross(w, m, v)
        for j in range(3):
            q[j] = 0.0
            for i in range(3):
                q[j] += R[i, j] * (y[k + 6 + i] - v[i])
            q[j] /= stiffness[j]
        for i in range(3):
            d[k + i] = R[i, 0] * q[0] + R[i, 1] * q[1] + R[i, 2] * q[2]
        cross(w, t, d[k + 3 : k + 6])
        cross(n, d[k + 3 : k + 6], d[k + 6 : k + 9])
        if first_force >= 0 and first_force <= c < first_force + 3:
            e[:] = 0.0
            e[c - first_force] = 1.0
            cross(e, t, v)
            d[k + 6 : k + 9] += v
    return d


@numba.njit(cache=False)
def slopes_of(y, s, length, n_end, weight, stiffness, rest, first_force):
    return slopes(s, y, length, n_end, weight, stiffness, rest, first_force)


def along(method, y, tolerance, length, *rest):
    if method == "DOP853":
        run = solve_ivp(slopes, (0.0, length), y, method=method, rtol=tolerance, atol=tolerance, args=(length, *rest))
        return run.y[:, -1]
    return odeint(slopes_of, y, (0.0, length), args=(length, *rest), rtol=tolerance, atol=tolerance)[-1]


def shoot(scene, method, tolerance, m0, f, currents, load, columns):
    """State at the tip and, where columns are wanted, theirs by m0, f and currents."""
    y = np.concatenate([np.zeros(3), np.eye(3).ravel(), m0])
    if columns:
        start = np.zeros((6, COLUMN))
        start[:3, 6:] = np.eye(3)
        y = np.concatenate([y, start.ravel()])
    for k in (0, 1):
        n_end = f + load * scene.beyond[k]
        y = along(method, y, tolerance, scene.lengths[2 * k], n_end, load * scene.weight[k], scene.stiffness[k],
                  scene.rest[k], 3 if columns else -1)
        if k == 0:
            y = across(scene, y, f, currents, load, columns)
    return y


def across(scene, y, f, currents, load, columns):
    R, arm = y[3:12].reshape(3, 3), scene.lengths[1]
    t, B = R[:, 2], load * scene.field
    mu, n = R @ scene.dipole(currents), f + load * (scene.beyond[0] - scene.coil_weight / 2)
    found = y[:STATE].copy()
    found[:3] += arm * t
    found[12:15] -= np.cross(mu, B) + arm * np.cross(t, n)
    if not columns:
        return found
    given = y[STATE:].reshape(-1, COLUMN)
    w, dt = given[:, :3], np.cross(given[:, :3], t)
    dm = given[:, 6:] - np.cross(np.cross(w, mu), B) - arm * np.cross(dt, n)
    moved = np.hstack([w, given[:, 3:6] + arm * dt, dm])
    moved[3:6, 6:] -= arm * hat(t).T
    current = np.zeros((3, COLUMN))
    current[:, 6:] = -np.cross((R @ scene.turns_area).T, B)
    return np.concatenate([found, moved.ravel(), current.ravel()])


def rows(scene, p, f, shift):
    if scene.held:
        return p - scene.anchor - shift
    return np.array([*(scene.tangents() @ f), scene.gap(p) + f @ scene.normal / scene.tissue + shift])


def row_columns(scene, dp, df):
    if scene.held:
        return dp
    return np.vstack([scene.tangents() @ df, scene.normal @ dp + scene.normal @ df / scene.tissue])


DF = np.hstack([np.zeros((3, 3)), np.eye(3), np.zeros((3, 3))])


class Rod:
    def __init__(self, scene, method, tolerance):
        self.scene, self.method, self.tolerance = scene, method, tolerance

    def shoot(self, x, currents, load=1.0, columns=False):
        return shoot(self.scene, self.method, self.tolerance, x[:3], x[3:], currents, load, columns)

    def free(self, currents, m0, load):
        """Moment at the base of the rod without wall."""
        full = lambda m0: np.concatenate([m0, np.zeros(3)])
        end = lambda m0: self.shoot(full(m0), currents, load)[12:15]
        slope = lambda m0: self.columns(full(m0), currents, load)[6:, :3]
        return fsolve(end, m0, fprime=slope, xtol=self.tolerance)

    def columns(self, x, currents, load=1.0):
        return self.shoot(x, currents, load, True)[STATE:].reshape(-1, COLUMN).T

    def touching(self, currents, x, shift):
        def wrong(x):
            y = self.shoot(x, currents)
            return np.concatenate([rows(self.scene, y[:3], x[3:], shift), y[12:15]])

        def slope(x):
            columns = self.columns(x, currents)
            return np.vstack([row_columns(self.scene, columns[3:6], DF), columns[6:]])[:, :6]

        return fsolve(wrong, x, fprime=slope, xtol=self.tolerance)

    def solve(self, currents):
        m0, scene = np.zeros(3), self.scene
        for load in LOADS[scene.name]:
            m0 = self.free(currents, m0, load)
        x = np.concatenate([m0, np.zeros(3)])
        tip = self.shoot(x, currents)[:3]
        apart = tip - scene.anchor if scene.held else -scene.gap(tip)
        before = x
        for k, tau in enumerate(COMING[scene.name]):
            guess = 2 * x - before if k > 1 else x
            before, x = x, self.touching(currents, guess, (1.0 - tau) * apart)
        self.x = x
        return x[3:], self.shoot(x, currents)[:3]

    def derivatives(self, currents, step=None):
        """d(force)/d(current) where the last solve ended."""
        columns = self.columns(self.x, currents)
        W = np.vstack([row_columns(self.scene, columns[3:6], DF), columns[6:]])
        return -np.linalg.solve(W[:, :6], W[:, 6:])[3:]
