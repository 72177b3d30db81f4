"""SciPy's solve_bvp with analytic Jacobians: both flexible segments side by side on [0, 1], the force a parameter.

Each segment has position, quaternion and moment; the rigid segment is in the boundary conditions.
"""

import numpy as np
from scipy.integrate import solve_bvp

from rod import differences, hat

DERIVATIVES = "central differences"
STATE = 10
P, Q, M = slice(0, 3), slice(3, 7), slice(7, 10)
# Steps of the differences, in amperes: the best is taken.
STEPS = (1e-2, 1e-3, 1e-4, 1e-5)
NODES = {"p6-tissue": 4, "p6-held": 6}
# What is solved on the way to the last problem needs no accuracy.
ROUGH = 1.0
# Tau of the wall's coming. The held rod has other equilibria: with fewer steps some currents nearby end there.
COMING = {"p6-tissue": (1.0,), "p6-held": tuple(np.arange(1, 9) / 8)}


def products():
    """R by two quaternions, and q (0, u) by a quaternion and a vector, as tensors."""
    def R(q):
        return (q[0] ** 2 - q[1:] @ q[1:]) * np.eye(3) + 2 * np.outer(q[1:], q[1:]) + 2 * q[0] * hat(q[1:])

    one = np.eye(4)
    pair = lambda a, b: (R(one[a] + one[b]) - R(one[a]) - R(one[b])) / 2
    rotation = np.array([[pair(a, b) for b in range(4)] for a in range(4)]).transpose(2, 3, 0, 1)
    turn = np.zeros((4, 4, 3))
    for a in range(4):
        for i in range(3):
            v = one[a][1:]
            turn[:, a, i] = [-v[i], *(one[a][0] * np.eye(3)[i] + np.cross(v, np.eye(3)[i]))]
    return rotation, turn / 2


ROTATION, TURN = products()


def across(a, b):
    """Vectors across each other along the first axis; NumPy's own cross is slower for short ones."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


class Rod:
    def __init__(self, scene, tolerance):
        self.scene, self.tolerance = scene, tolerance

    def force(self, k, x, f, load):
        scene = self.scene
        length = scene.lengths[2 * k]
        return (f + load * scene.beyond[k])[:, None] + load * np.outer(scene.weight[k] * length, 1.0 - x)

    def slopes(self, x, y, f, load):
        out = np.empty_like(y)
        for k in (0, 1):
            scene, part = self.scene, slice(STATE * k, STATE * (k + 1))
            p, q, m = (y[part][s] for s in (P, Q, M))
            dR = np.tensordot(ROTATION, q, 1)
            R = (dR * q).sum(2)
            u = scene.rest[k][:, None] + (R * m[:, None]).sum(0) / scene.stiffness[k][:, None]
            t = R[:, 2]
            n = self.force(k, x, f, load)
            turned = (np.tensordot(TURN, u, 1) * q).sum(1)
            out[part] = scene.lengths[2 * k] * np.concatenate([t, turned, across(n, t)])
        return out

    def slope_columns(self, x, y, f, load):
        by_y, by_f = np.zeros((2 * STATE, 2 * STATE, x.size)), np.zeros((2 * STATE, 3, x.size))
        for k in (0, 1):
            scene, at, length = self.scene, STATE * k, self.scene.lengths[2 * k]
            q, m = y[at + 3 : at + 7], y[at + 7 : at + 10]
            half = np.tensordot(ROTATION, q, 1)
            R, dR = (half * q).sum(2), 2 * half
            soft = 1 / scene.stiffness[k][:, None]
            u = scene.rest[k][:, None] + (R * m[:, None]).sum(0) * soft
            du_dq = (dR * m[:, None, None]).sum(0) * soft[:, None]
            du_dm = R.transpose(1, 0, 2) * soft[:, None]
            t, dt = R[:, 2], dR[:, 2]
            n = self.force(k, x, f, load)
            by_u = np.einsum("abi,bx->aix", TURN, q)
            rows = lambda s: slice(at + s.start, at + s.stop)
            by_y[rows(P), rows(Q)] = length * dt
            by_y[rows(Q), rows(Q)] = length * (np.tensordot(TURN, u, 1) + np.einsum("aix,ibx->abx", by_u, du_dq))
            by_y[rows(Q), rows(M)] = length * np.einsum("aix,ijx->ajx", by_u, du_dm)
            by_y[rows(M), rows(Q)] = length * across(n[:, None], dt)
            by_f[rows(M)] = length * hat(-t)
        return by_y, by_f

    def ends(self, a, b, f, load, currents, close):
        """close(p, f): the three rows of the force."""
        scene, q = self.scene, b[Q]
        R = np.einsum("ijab,a,b->ij", ROTATION, q, q)
        t, arm = R[:, 2], scene.lengths[1]
        n = f + load * (scene.beyond[0] - scene.coil_weight / 2)
        m = b[M] - np.cross(R @ scene.dipole(currents), load * scene.field) - arm * np.cross(t, n)
        second = np.concatenate([b[P] + arm * t, q, m])
        return np.concatenate([a[P], a[Q] - [1, 0, 0, 0], a[STATE:] - second, b[STATE:][M], close(b[STATE:][P], f)])

    def end_columns(self, a, b, f, load, currents, close_columns):
        scene, q = self.scene, b[Q]
        by_a, by_b, by_f = np.zeros((23, 20)), np.zeros((23, 20)), np.zeros((23, 3))
        by_a[:7, :7] = np.eye(7)
        by_a[7:17, STATE:] = np.eye(STATE)
        dR = 2 * np.einsum("ijab,a->ijb", ROTATION, q)
        t, dt, arm = np.einsum("ia,a->i", dR[:, 2], q) / 2, dR[:, 2], scene.lengths[1]
        n = f + load * (scene.beyond[0] - scene.coil_weight / 2)
        dmu = np.einsum("ijb,j->ib", dR, scene.dipole(currents))
        by_b[7:10, P], by_b[7:10, Q] = -np.eye(3), -arm * dt
        by_b[10:14, Q] = -np.eye(4)
        by_b[14:17, M] = -np.eye(3)
        by_b[14:17, Q] = -hat(load * scene.field) @ dmu - arm * hat(n) @ dt
        by_f[14:17] = arm * hat(t)
        by_b[17:20, STATE + 7 :] = np.eye(3)
        by_b[20:, STATE : STATE + 3], by_f[20:] = close_columns
        return by_a, by_b, by_f

    def one(self, x, y, f, load, currents, close, close_columns, tolerance):
        found = solve_bvp(
            lambda x, y, f: self.slopes(x, y, f, load),
            lambda a, b, f: self.ends(a, b, f, load, currents, close),
            x, y, p=f, tol=tolerance, max_nodes=20_000,
            fun_jac=lambda x, y, f: self.slope_columns(x, y, f, load),
            bc_jac=lambda a, b, f: self.end_columns(a, b, f, load, currents, close_columns),
        )
        return found.x, found.y, found.p

    def touching(self, guess, currents, shift, tolerance):
        scene = self.scene
        if scene.held:
            close, columns = lambda p, f: p - scene.anchor - shift, (np.eye(3), np.zeros((3, 3)))
        else:
            T, n = scene.tangents(), scene.normal
            close = lambda p, f: np.array([*(T @ f), scene.gap(p) + n @ f / scene.tissue + shift])
            columns = np.vstack([np.zeros((2, 3)), n]), np.vstack([T, n / scene.tissue])
        return self.one(*guess, 1.0, currents, close, columns, tolerance)

    def solve(self, currents):
        scene, nodes = self.scene, NODES[self.scene.name]
        x = np.linspace(0, 1, nodes)
        y = np.zeros((2 * STATE, nodes))
        y[3] = y[STATE + 3] = 1.0
        y[2], y[STATE + 2] = x * scene.lengths[0], scene.lengths[:2].sum() + x * scene.lengths[2]
        free = lambda p, f: f, (np.zeros((3, 3)), np.eye(3))
        at = self.one(x, y, np.zeros(3), 1.0, currents, *free, ROUGH)
        tip = at[1][STATE : STATE + 3, -1]
        apart = tip - scene.anchor if scene.held else -scene.gap(tip)
        for tau in COMING[scene.name]:
            at = self.touching(at, currents, (1.0 - tau) * apart, self.tolerance if tau == 1.0 else ROUGH)
        self.at = at
        return at[2], at[1][STATE : STATE + 3, -1]

    def derivatives(self, currents, step):
        return differences(lambda at: self.touching(self.at, at, 0.0, self.tolerance)[2], currents, step)
