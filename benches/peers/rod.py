"""The benchmark scene without units: lengths over the rod's, moments over what bends it by about one radian.

Parameters theta, in the order of the derivatives: three currents, tip force, insertion (length of the proximal
segment), then rest curvature, bending and torsional stiffness of the proximal and of the distal segment.
State y: p, R by rows, m in the world frame; p' = t, R' = R hat(u), m' = n x t with u = u* + K^-1 R^T m.
"""

import tomllib

import numpy as np

UNITS = {"mm": 1e-3, "T": 1.0, "mN": 1e-3, "A": 1.0, "N·m²": 1.0}
STATE = 15
# Shares of the load: Newton's method from the straight rod does not reach the whole of it in one go.
LOADS = (0.25, 0.5, 0.75, 1.0)
INSERTION = 6
# What theta holds of each flexible segment: rest curvature, bending, torsion.
OWN = (slice(7, 12), slice(12, 17))


def si(value):
    """A number, or a text with one of the units of the scene."""
    if isinstance(value, str):
        number, unit = value.split()
        return float(number) * UNITS[unit]
    return value


class Scene:
    def __init__(self, file):
        with open(file, "rb") as text:
            scene = tomllib.load(text)["scene"]
        field = np.array([si(x) for x in scene["field"]["flux_density"]])
        tip_force = [si(x) for x in scene["loads"]["tip_force"]]
        proximal, coil, distal = scene["segment"]
        lengths = [si(segment["length"]) for segment in (proximal, coil, distal)]
        own = lambda s: [*s["rest_curvature"], si(s["stiffness"]["bending"]), si(s["stiffness"]["torsion"])]
        self.length = sum(lengths)
        moment = si(proximal["stiffness"]["bending"]) / (lengths[0] + lengths[2])
        stiffness = moment * self.length
        scales = [1.0 / self.length] * 3 + [stiffness] * 2
        # One unit of each parameter in SI.
        self.scales = np.array([1.0] * 3 + [moment / self.length] * 3 + [self.length] + 2 * scales)
        self.rest = np.array([*tip_force, lengths[0], *own(proximal), *own(distal)]) / self.scales[3:]
        # Torque by one ampere along each axis of the coil, across one unit of field.
        self.turns_area = np.array(coil["coil"]["turns_area"]) * np.linalg.norm(field) / moment
        self.field = field / np.linalg.norm(field)
        self.rigid, self.distal = lengths[1] / self.length, lengths[2] / self.length

    def parameters(self, currents):
        return np.concatenate([currents, self.rest])

    def in_si(self, tip, jacobian):
        """Tip state and its derivatives (y by theta) with units; of the state only p and R are asked for."""
        rows = np.array([self.length] * 3 + [1.0] * 9)
        return tip[:12] * rows, jacobian[:12] * rows[:, None] / self.scales


def base(m0, xp):
    return xp.concatenate([xp.zeros(3), xp.eye(3).ravel(), m0])


def slopes(y, n, own, xp):
    R, m = y[3:12].reshape(3, 3), y[12:15]
    stiffness = xp.stack([own[3], own[3], own[4]])
    u = own[:3] + (R.T @ m) / stiffness
    hat = xp.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
    return xp.concatenate([R[:, 2], (R @ hat).ravel(), xp.cross(n, R[:, 2])])


def across(y, scene, n, currents, xp):
    """Over the coil, with its dipole and the lever arm of the force."""
    R = y[3:12].reshape(3, 3)
    arm = scene.rigid * R[:, 2]
    m = y[12:15] - xp.cross(R @ (scene.turns_area @ currents), scene.field) - xp.cross(arm, n)
    return xp.concatenate([y[:3] + arm, y[3:12], m])


def from_rest(step, m0, tolerance):
    """Newton's method under growing loads, each from where the last two point; step(m0, load) is its change of m0."""
    before = m0
    for load in LOADS:
        m0, before = 2 * m0 - before, m0
        # Newton squares its errors: what is left after the last step is below the tolerance.
        enough = tolerance**0.5 if load == 1.0 else 0.05
        for _ in range(10):
            change = step(m0, load)
            m0 = m0 + change
            if not np.max(np.abs(change)) > enough:
                break
    return m0
