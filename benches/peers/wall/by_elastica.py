"""PyElastica: one rod damped to rest, its rigid segment one element, weights and torque as forcings.

A stiff element before the clamp lets the first real one bend over its whole length. Its own plane contact acts on the
middles of elements, cancels what presses and holds rigidly: tissue is a spring on the last node instead. It
cannot hold a tip: that is a constraint of the last node's place. Mass is free for a state of rest and is spread evenly.
"""

import elastica as ea
import numba
import numpy as np

from rod import differences

DERIVATIVES = "central differences"
# Steps of the differences, in amperes: the best is taken.
STEPS = (1e-2,)
# The stiffness of shear and stretch is over EI/L²; the tube's own is 1e4.
# Time step over an element's time of travel, and damping rate; the slowest free mode takes a time of 1.8.
STEP_SHARE, DAMPING = 0.45, 12.0
COMING, WINDOW, MOST = 1.0, 0.2, 60.0
# Steps between values that are looked at.
SAMPLED = 10


class System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    pass


@numba.njit(cache=False)
def load(forces, torques, weights, directors, coil, dipole, field):
    forces += weights
    b = np.zeros(3)
    for i in range(3):
        for j in range(3):
            b[i] += directors[i, j, coil] * field[j]
    torques[0, coil] += dipole[1] * b[2] - dipole[2] * b[1]
    torques[1, coil] += dipole[2] * b[0] - dipole[0] * b[2]
    torques[2, coil] += dipole[0] * b[1] - dipole[1] * b[0]


@numba.njit(cache=False)
def press(forces, positions, normal, offset, tissue):
    gap = -offset
    for i in range(3):
        gap += normal[i] * positions[i, -1]
    if gap < 0.0:
        for i in range(3):
            forces[i, -1] -= tissue * gap * normal[i]


class Loads(ea.NoForces):
    def __init__(self, owner):
        super().__init__()
        self.owner = owner

    def apply_forces(self, system, time=0.0):
        at, scene = self.owner, self.owner.scene
        forces, torques = system.external_forces, system.external_torques
        load(forces, torques, at.weights, system.director_collection, at.coil, at.dipole, scene.field)
        if at.touching and not scene.held:
            offset = scene.offset - at.shift
            press(system.external_forces, system.position_collection, scene.normal, offset, scene.tissue)


class Held(ea.ConstraintBase):
    """The clamp at the base and, where wanted, the tip's place."""

    def __init__(self, *fixed, owner, **kwargs):
        super().__init__(*fixed, **kwargs)
        self.owner = owner

    def constrain_values(self, system, time):
        at = self.owner
        system.position_collection[:, :2] = at.base
        system.director_collection[:, :, 0] = at.clamp
        if at.touching and at.scene.held:
            system.position_collection[:, -1] = at.scene.anchor + at.shift

    def constrain_rates(self, system, time):
        system.velocity_collection[:, :2] = 0.0
        system.omega_collection[:, 0] = 0.0
        if self.owner.touching and self.owner.scene.held:
            system.velocity_collection[:, -1] = 0.0


class Rod:
    def __init__(self, scene, elements, shear, tolerance):
        self.scene, self.elements, self.shear, self.tolerance = scene, elements, shear, tolerance

    def build(self):
        scene = self.scene
        proximal = round(self.elements * scene.lengths[0] / (scene.lengths[0] + scene.lengths[2]))
        counts = proximal, self.elements - proximal
        piece = [scene.lengths[2 * k] / counts[k] for k in (0, 1)]
        lengths = np.array([piece[0]] * (proximal + 1) + [scene.lengths[1]] + [piece[1]] * counts[1])
        # Half of an element bends about each of its ends; the first and the coil's do not.
        of = np.array([0] * (proximal + 1) + [-1] + [1] * counts[1])
        bends = np.where(of < 0, 0.0, lengths / 2)
        bends[0] = 0.0
        positions = np.zeros((3, len(lengths) + 1))
        positions[2] = np.concatenate([[0.0], np.cumsum(lengths)]) - piece[0]
        self.system = System()
        self.rod = ea.CosseratRod.straight_rod(
            len(lengths), positions[:, 0], np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), lengths.sum(), 0.02,
            1.0, youngs_modulus=1.0, shear_modulus=0.5, position=positions,
        )
        rod = self.rod
        self.coil = proximal + 1
        over = rod.rest_voronoi_lengths
        for i in range(len(over)):
            both = [(bends[j], max(of[j], 0)) for j in (i, i + 1)]
            compliance = sum(b / scene.stiffness[k] for b, k in both)
            rod.bend_matrix[:, :, i] = np.diag(over[i] / compliance)
            rod.rest_kappa[:, i] = sum(b * scene.rest[k] for b, k in both) / over[i]
        for i in range(len(lengths)):
            rod.shear_matrix[:, :, i] = self.shear * np.eye(3)
            inertia = lengths[i] * min(piece) ** 2 / 4
            rod.mass_second_moment_of_inertia[:, :, i] = inertia * np.eye(3)
            rod.inv_mass_second_moment_of_inertia[:, :, i] = np.eye(3) / inertia
        mass = lengths / 2
        rod.mass[:] = np.concatenate([mass, [0]]) + np.concatenate([[0], mass])
        weight = np.array([scene.weight[k] * h if k >= 0 else scene.coil_weight for k, h in zip(of, lengths)])
        weight[0] = 0.0
        self.weights = np.zeros((3, len(lengths) + 1))
        self.weights[:, :-1] += weight.T / 2
        self.weights[:, 1:] += weight.T / 2
        self.base, self.clamp = positions[:, :2].copy(), rod.director_collection[:, :, 0].copy()
        self.dt = STEP_SHARE * min(piece) / np.sqrt(self.shear)
        self.touching, self.shift, self.time = False, 0.0, 0.0
        self.system.append(rod)
        self.system.constrain(rod).using(
            Held, constrained_position_idx=(0, 1), constrained_director_idx=(0,), owner=self
        )
        self.system.add_forcing_to(rod).using(Loads, self)
        self.system.dampen(rod).using(
            ea.AnalyticalLinearDamper, uniform_damping_constant=DAMPING, time_step=self.dt
        )
        self.system.finalize()
        self.stepper = ea.PositionVerlet()

    def tip(self):
        return self.rod.position_collection[:, -1].copy()

    def force(self):
        if self.scene.held:
            return -self.rod.internal_forces[:, -1] - self.weights[:, -1]
        gap = self.scene.gap(self.tip())
        return max(-gap, 0.0) * self.scene.tissue * self.scene.normal

    def settle(self, value):
        """Until a window changes the value by less than the tolerance; values of the last window."""
        before, count = value(), round(WINDOW / self.dt)
        for _ in range(round(MOST / WINDOW)):
            window = []
            for k in range(count):
                self.time = self.stepper.step(self.system, self.time, self.dt)
                if k % SAMPLED == 0 or k == count - 1:
                    window.append(value())
            self.steps += count
            if np.linalg.norm(window[-1] - before) <= self.tolerance * np.linalg.norm(window[-1]):
                break
            before = window[-1]
        return np.array(window)

    def solve(self, currents):
        scene, self.steps = self.scene, 0
        self.build()
        self.dipole = scene.dipole(currents)
        tight, self.tolerance = self.tolerance, max(self.tolerance, 1e-2)
        self.settle(self.tip)
        self.tolerance, tip = tight, self.tip()
        apart = tip - scene.anchor if scene.held else -scene.gap(tip)
        self.touching = True
        count = round(COMING / self.dt)
        for k in range(count):
            self.shift = (1.0 - (k + 1) / count) * apart
            self.time = self.stepper.step(self.system, self.time, self.dt)
        self.steps += count
        return self.rest(currents)

    def rest(self, currents):
        """Goes on from where it is."""
        self.dipole = self.scene.dipole(currents)
        window = self.settle(self.force)
        self.noise = np.max(np.std(window, axis=0)) / np.linalg.norm(window.mean(0))
        return window[-1], self.tip()

    def derivatives(self, currents, step):
        columns = differences(lambda at: self.rest(at)[0], currents, step)
        self.rest(currents)
        return columns
