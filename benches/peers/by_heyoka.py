"""heyoka.py: Taylor's method with error control, compiled, eight samples in a register; the sensitivities are written
into the system by hand, with nine numbers a column (dp, w, dm), and Newton's method runs on all samples at once."""

import heyoka as hy
import numpy as np

import rod

BATCH = 8
# Columns: base moment, currents, tip force, insertion, the segment's own numbers, those of the other segment.
COUNT = 3 + 3 + 3 + 1 + 5 + 5
FORCE, OWN, OTHER = 6, 10, 15


def dot(a, b):
    return sum(x * y for x, y in zip(a[1:], b[1:])) + a[0] * b[0]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def system(columns):
    """The augmented system; parameters: length, n, rest curvature, bending, torsion."""
    length, n, u_star = hy.par[0], [hy.par[k] for k in (1, 2, 3)], [hy.par[k] for k in (4, 5, 6)]
    stiffness = [hy.par[7], hy.par[7], hy.par[8]]
    p, m = hy.make_vars("px", "py", "pz"), hy.make_vars("mx", "my", "mz")
    R = [hy.make_vars(*(f"R{row}{column}" for column in range(3))) for row in range(3)]
    axes = [[R[row][column] for row in range(3)] for column in range(3)]
    t = axes[2]
    strain = [dot(axes[k], m) / stiffness[k] for k in range(3)]
    u = [u_star[k] + strain[k] for k in range(3)]
    turned = [[R[i][1] * u[2] - R[i][2] * u[1], R[i][2] * u[0] - R[i][0] * u[2], R[i][0] * u[1] - R[i][1] * u[0]] for i in range(3)]
    world = lambda v: [dot(R[i], v) for i in range(3)]
    equations = list(zip(p, t)) + [(R[i][j], turned[i][j]) for i in range(3) for j in range(3)] + list(zip(m, cross(n, t)))
    for column in range(columns):
        dp, w, dm = ([hy.make_vars(f"{name}{column}{axis}") for axis in "xyz"] for name in ("dp", "w", "dm"))
        dt, pull = cross(w, t), [a - b for a, b in zip(dm, cross(w, m))]
        du = [dot(axes[k], pull) / stiffness[k] for k in range(3)]
        torque = cross(n, dt)
        if OWN <= column < OWN + 3:
            du[column - OWN] += 1.0
        elif column == OWN + 3:
            du[0] -= strain[0] / stiffness[0]
            du[1] -= strain[1] / stiffness[1]
        elif column == OWN + 4:
            du[2] -= strain[2] / stiffness[2]
        elif FORCE <= column < FORCE + 3:
            unit = [float(column - FORCE == k) for k in range(3)]
            torque = [a + b for a, b in zip(torque, cross(unit, t))]
        equations += list(zip(dp, dt)) + list(zip(w, world(du))) + list(zip(dm, torque))
    return [(x, length * slope) for x, slope in equations]


def crossed(a, b):
    """Along the first axis; NumPy's own takes ten times as long on arrays this small."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


class Shooting:
    """From base to tip with so many columns; arrays are (numbers, samples)."""

    def __init__(self, scene, columns, tolerance):
        self.scene, self.columns = scene, columns
        state = np.zeros((rod.STATE + 9 * columns, BATCH))
        pars = np.ones((9, BATCH))
        self.integrator = hy.taylor_adaptive_batch(system(columns), state, pars=pars, tol=tolerance)

    def segment(self, y, length, n, own):
        integrator, end = self.integrator, np.empty_like(y)
        pars = np.concatenate([np.broadcast_to(length, (1, y.shape[1])), n, own])
        for block in range(0, y.shape[1], BATCH):
            some = slice(block, block + BATCH)
            integrator.set_time(0.0)
            integrator.state[:] = y[:, some]
            integrator.pars[:] = pars[:, some]
            integrator.propagate_until(1.0)
            end[:, some] = integrator.state
        return end

    def __call__(self, m0, theta, load):
        scene, n, own = self.scene, load * theta[3:6], (theta[rod.OWN[0]], theta[rod.OWN[1]])
        y = np.zeros((rod.STATE + 9 * self.columns, m0.shape[1]))
        y[3] = y[7] = y[11] = 1.0
        y[12:15] = m0
        columns = y[rod.STATE :].reshape(self.columns, 9, -1)
        columns[[0, 1, 2], [6, 7, 8]] = 1.0
        if self.columns > 3:
            # By the insertion the base moves on along itself; the moment there is free.
            u = own[0][:3] + m0 / own[0][[3, 3, 4]]
            columns[9, 2], columns[9, 3:6] = 1.0, u
        y = self.segment(y, theta[rod.INSERTION], n, own[0])
        y = self.across(y, n, load * theta[:3])
        columns = y[rod.STATE :].reshape(self.columns, 9, -1)
        if self.columns > 3:
            columns[OWN:] = np.concatenate([columns[OTHER:], columns[OWN:OTHER]])
        y = self.segment(y, scene.distal, n, own[1])
        columns = y[rod.STATE :].reshape(self.columns, 9, -1)
        if self.columns > 3:
            columns[OWN:] = np.concatenate([columns[OTHER:], columns[OWN:OTHER]])
        return y[: rod.STATE], columns

    def across(self, y, n, currents):
        scene, R = self.scene, y[3:12].reshape(3, 3, -1)
        field = scene.field[:, None]
        arm, mu = scene.rigid * R[:, 2], np.einsum("ijk,jk->ik", R, scene.turns_area @ currents)
        y = y.copy()
        columns = y[rod.STATE :].reshape(self.columns, 9, -1)
        w = columns[:, 3:6].transpose(1, 0, 2)
        darm = crossed(w, arm[:, None, :])
        change = crossed(crossed(w, mu[:, None, :]), field[:, :, None]) + crossed(darm, n[:, None, :])
        if self.columns > 3:
            for axis in range(3):
                change[:, 3 + axis] += crossed(np.einsum("ijk,j->ik", R, scene.turns_area[:, axis]), field)
                change[:, FORCE + axis] += crossed(arm, np.eye(3)[:, [axis]])
        columns[:, 0:3] += darm.transpose(1, 0, 2)
        columns[:, 6:9] -= change.transpose(1, 0, 2)
        y[0:3] += arm
        y[12:15] -= crossed(mu, field) + crossed(arm, n)
        return y


def solver(scene, tolerance):
    """A function of all thetas that returns tips and Jacobians from rest."""
    newton, answer = Shooting(scene, 3, tolerance), Shooting(scene, COUNT, tolerance)

    def solve(thetas):
        count = len(thetas)
        theta = np.concatenate([thetas, thetas[: -count % BATCH]]).T

        def step(m0, load):
            y, columns = newton(m0, theta, load)
            return -np.linalg.solve(columns[:, 6:9].transpose(2, 1, 0), y[12:15].T[:, :, None])[:, :, 0].T

        m0 = rod.from_rest(step, np.zeros((3, theta.shape[1])), tolerance)
        y, columns = answer(m0, theta, 1.0)
        by_m0, by_theta = columns[:3], columns[3:]
        change = np.linalg.solve(by_m0[:, 6:9].transpose(2, 1, 0), by_theta[:, 6:9].transpose(2, 1, 0))
        total = by_theta - np.einsum("skt,kns->tns", change, by_m0)
        # dR = hat(w) R, by rows.
        w, R = total[:, 3:6].transpose(1, 0, 2), y[3:12].reshape(3, 3, -1)
        dR = np.stack([crossed(w, R[:, [j]]) for j in range(3)], axis=1)
        jacobian = np.concatenate([total[:, :3].transpose(1, 0, 2), dR.reshape(9, *total.shape[::2])])
        return y.T[:count], jacobian.transpose(2, 0, 1)[:count]

    return solve
