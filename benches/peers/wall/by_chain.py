"""The pseudo-rigid chain: rigid links, springs in ball joints, least energy by SciPy's SLSQP with analytic gradients.

Each joint has a rotation vector and stands in the middle of its piece of a flexible segment. Tissue is a slack
variable: the depth of the tip, with the energy of its spring. The force of a held tip is the multiplier of its
constraint.
"""

import numpy as np
from scipy.optimize import minimize

from rod import differences, hat

DERIVATIVES = "central differences"
# Steps of the differences, in amperes: the best is taken.
STEPS = (3e-2, 1e-2, 1e-3, 1e-4)


def exponential(v):
    """exp(hat(v)) and its right Jacobian: a change of v turns by J dv, in the body's frame."""
    angle = np.sqrt(v @ v)
    if angle < 1e-6:
        return np.eye(3) + hat(v), np.eye(3) - hat(v) / 2
    H = hat(v)
    HH = H @ H
    sine, less = np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2
    return np.eye(3) + sine * H + less * HH, np.eye(3) - less * H + (1 - sine) / angle**2 * HH


class Rod:
    def __init__(self, scene, joints, tolerance):
        self.scene, self.tolerance = scene, tolerance
        proximal = round(joints * scene.lengths[0] / (scene.lengths[0] + scene.lengths[2]))
        counts = proximal, joints - proximal
        self.proximal, self.joints = proximal, joints
        piece = [scene.lengths[2 * k] / counts[k] for k in (0, 1) for _ in range(counts[k])]
        self.of = np.repeat((0, 1), counts)
        self.piece = np.array(piece)
        self.stiffness = scene.stiffness[self.of] / self.piece[:, None]
        self.rest = scene.rest[self.of] * self.piece[:, None]
        self.weight = scene.weight[self.of] * self.piece[:, None]

    def shape(self, angles):
        """Pivots, R and R J behind each joint, middle of the coil, its R, tip."""
        scene, R, at = self.scene, np.eye(3), np.zeros(3)
        pivots, turned = np.empty((self.joints, 3)), np.empty((self.joints, 3, 3))
        for i in range(self.joints):
            if i == self.proximal:
                middle, coil = at + scene.lengths[1] / 2 * R[:, 2], R
                at = at + scene.lengths[1] * R[:, 2]
            at = pivots[i] = at + self.piece[i] / 2 * R[:, 2]
            turn, J = exponential(angles[i])
            R = R @ turn
            turned[i] = R @ J
            at = at + self.piece[i] / 2 * R[:, 2]
        return pivots, turned, middle, coil, at

    def energy(self, x, currents):
        scene, angles = self.scene, x[: 3 * self.joints].reshape(-1, 3)
        pivots, turned, middle, coil, _ = self.shape(angles)
        moment = self.stiffness * (angles - self.rest)
        mu = coil @ scene.dipole(currents)
        value = np.sum(moment * (angles - self.rest)) / 2 - mu @ scene.field
        value -= np.sum(self.weight * pivots) + scene.coil_weight @ middle
        # About each joint: weights of the joints beyond it, those of the coil and its torque.
        torque = np.cross(pivots, self.weight)[::-1].cumsum(0)[::-1]
        torque -= np.cross(pivots, self.weight[::-1].cumsum(0)[::-1])
        near = slice(0, self.proximal)
        torque[near] += np.cross(middle - pivots[near], scene.coil_weight) + np.cross(mu, scene.field)
        slope = moment - np.einsum("kij,ki->kj", turned, torque)
        if scene.held:
            return value, slope.ravel()
        return value + scene.tissue * x[-1] ** 2 / 2, np.append(slope.ravel(), scene.tissue * x[-1])

    def tip(self, x):
        return self.shape(x[: 3 * self.joints].reshape(-1, 3))[4]

    def tip_columns(self, x):
        pivots, turned, _, _, tip = self.shape(x[: 3 * self.joints].reshape(-1, 3))
        return np.hstack([-hat(tip - pivot) @ turn for pivot, turn in zip(pivots, turned)])

    def least(self, x, currents):
        scene = self.scene
        if scene.held:
            wall = {"type": "eq", "fun": lambda x: self.tip(x) - scene.anchor, "jac": self.tip_columns}
            bounds = None
        else:
            depth = np.zeros(3 * self.joints + 1)
            depth[-1] = 1.0
            column = lambda x: scene.normal @ np.hstack([self.tip_columns(x), np.zeros((3, 1))]) + depth
            wall = {"type": "ineq", "fun": lambda x: scene.gap(self.tip(x)) + x[-1], "jac": column}
            bounds = [(None, None)] * (3 * self.joints) + [(0.0, None)]
        found = minimize(self.energy, x, args=(currents,), jac=True, method="SLSQP", bounds=bounds, constraints=[wall],
                         options={"ftol": self.tolerance, "maxiter": 1000})
        return found.x, found.multipliers

    def solve(self, currents, start=None):
        scene = self.scene
        if start is None:
            start = self.rest.ravel() if scene.held else np.append(self.rest.ravel(), 0.0)
        self.x, multipliers = self.least(start, currents)
        force = multipliers[:3] if scene.held else scene.tissue * self.x[-1] * scene.normal
        return force, self.tip(self.x)

    def derivatives(self, currents, step):
        start = self.x
        columns = differences(lambda at: self.solve(at, start)[0], currents, step)
        self.x = start
        return columns
