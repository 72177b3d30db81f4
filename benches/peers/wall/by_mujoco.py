"""MuJoCo: rigid links with three sprung hinges in each joint, settled by the integrator that takes springs implicitly.

MuJoCo 4 has no cable of its own that carries a rigid coil: its one-dimensional flex has points instead of frames. Each
joint stands in the middle of its piece of a flexible segment. Tissue is a pad on a sprung slide along the wall's
normal, the tip a ball that slides on it without friction; a held tip is a `connect` to a body that is moved to
the anchor.
Masses are free for a state of rest: weights are forces, and inertia is what settles soonest.
"""

import mujoco
import numpy as np

from rod import differences

DERIVATIVES = "central differences"
# Steps of the differences, in amperes: the best is taken.
STEPS = (1e-2, 1e-3, 1e-4)
BALL, PAD, MASS = 0.02, 2.0, 1e-3
# As stiff as the step takes them: a stiffer contact chatters, by half of its force.
CONTACT = 'solref="0.05 1" solimp="0.99 0.99 0.001"'
CONNECT = 'solref="0.001 1" solimp="0.9999 0.9999 0.001"'
# Of each joint, relative to its stiffness; a time step and steps over which the wall comes.
DAMPING, DT, COMING = 0.2, 0.1, 10
# Steps of a window, at whose end the force is compared with the one before.
WINDOW, MOST = 10, 20_000


def text(values):
    return " ".join(f"{float(x):.17g}" for x in np.atleast_1d(values))


class Rod:
    def __init__(self, scene, joints, tolerance):
        self.scene, self.joints, self.tolerance = scene, joints, tolerance
        proximal = round(joints * scene.lengths[0] / (scene.lengths[0] + scene.lengths[2]))
        counts = proximal, joints - proximal
        of = np.repeat((0, 1), counts)
        piece = np.array([scene.lengths[2 * k] / counts[k] for k in of])
        inertia = f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="{text([MASS * 1e-2] * 3)}"/>'
        opened, at = "", 0.0
        for i in range(joints):
            at += piece[i] / 2
            opened += f'<body name="link{i}" pos="0 0 {text(at)}">{inertia}'
            # Every other joint turns in the opposite order: what the order does to the curvature cancels.
            for axis in (range(3), reversed(range(3)))[i % 2]:
                spring = scene.stiffness[of[i], axis] / piece[i]
                opened += (f'<joint type="hinge" axis="{text(np.eye(3)[axis])}" stiffness="{text(spring)}" '
                           f'damping="{text(DAMPING * spring)}" '
                           f'springref="{text(scene.rest[of[i], axis] * piece[i])}"/>')
            at = piece[i] / 2
            if i == proximal - 1:
                opened += f'<body name="coil" pos="0 0 {text(at + scene.lengths[1] / 2)}">{inertia}</body>'
                at += scene.lengths[1]
        opened += f'<site name="tip" pos="0 0 {text(at)}"/>'
        if scene.held:
            wall, last = '<body name="hand" mocap="true" pos="0 0 1"/>', f"link{joints - 1}"
            more = f'<equality><connect body1="hand" body2="{last}" anchor="0 0 0" active="false"/></equality>'
        else:
            opened += f'<geom type="sphere" pos="0 0 {text(at)}" size="{BALL}" mass="0"/>'
            # The ball's middle is where the tip is, so the face lies a ball's radius behind.
            centre = (scene.offset - BALL - PAD) * scene.normal
            wall = (f'<body name="pad" pos="{text(centre)}">{inertia}'
                    f'<joint name="pad" type="slide" axis="{text(scene.normal)}" stiffness="{text(scene.tissue)}" '
                    f'damping="{text(DAMPING * scene.tissue)}"/>'
                    f'<geom type="box" size="{PAD} {PAD} {PAD}" zaxis="{text(scene.normal)}" mass="0"/></body>')
            more = ""
        xml = f"""<mujoco><compiler angle="radian"/>
            <option gravity="0 0 0" integrator="discrete" timestep="{DT}" tolerance="1e-12" iterations="200"/>
            <default><geom condim="1" {CONTACT}/><equality {CONNECT}/></default>
            <worldbody>{opened}{'</body>' * joints}{wall}</worldbody>{more}</mujoco>"""
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        body = lambda name: mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
        self.links = np.array([body(f"link{i}") for i in range(joints)])
        self.coil, self.end = body("coil"), at
        self.forces = np.zeros((self.model.nbody, 6))
        self.forces[self.links, :3] = scene.weight[of] * piece[:, None]
        self.forces[self.coil, :3] = scene.coil_weight
        if not scene.held:
            self.pad = self.model.jnt_qposadr[self.model.joint("pad").id]

    def tip(self):
        return self.data.site("tip").xpos.copy()

    def force(self):
        """Of the wall on the tip."""
        if self.scene.held:
            return -self.data.efc_force[:3] if self.data.nefc else np.zeros(3)
        found = np.zeros(6)
        if not self.data.ncon:
            return np.zeros(3)
        mujoco.mj_contactForce(self.model, self.data, 0, found)
        return found[0] * self.scene.normal

    def step(self, dipole):
        R = self.data.xmat[self.coil].reshape(3, 3)
        self.forces[self.coil, 3:] = np.cross(R @ dipole, self.scene.field)
        self.data.xfrc_applied[:] = self.forces
        mujoco.mj_step(self.model, self.data)

    def settle(self, dipole, value):
        """Until a window changes the value by less than the tolerance; values of the last window."""
        before, count = value(), 0
        while count < MOST:
            window = []
            for _ in range(WINDOW):
                self.step(dipole)
                window.append(value())
            count += WINDOW
            self.steps += WINDOW
            if np.linalg.norm(window[-1] - before) <= self.tolerance * np.linalg.norm(window[-1]):
                break
            before = window[-1]
        return np.array(window)

    def solve(self, currents):
        scene, data, dipole = self.scene, self.data, self.scene.dipole(currents)
        mujoco.mj_resetData(self.model, data)
        self.steps = COMING
        if scene.held:
            # What is held is the tip, in the frame of its link.
            self.model.eq_data[0, 3:6] = [0, 0, self.end]
            mujoco.mj_forward(self.model, data)
        else:
            # Out of the way at first.
            self.model.qpos_spring[self.pad] = data.qpos[self.pad] = -1.0
            mujoco.mj_forward(self.model, data)
        loose, self.tolerance = self.tolerance, max(self.tolerance, 1e-3)
        self.settle(dipole, self.tip)
        self.tolerance, tip = loose, self.tip()
        apart = tip - scene.anchor if scene.held else -scene.gap(tip) * 1.02
        if scene.held:
            data.mocap_pos[0] = tip
            data.eq_active[0] = 1
        else:
            self.model.qpos_spring[self.pad] = data.qpos[self.pad] = -apart
            data.qvel[:] = 0.0
        for k in range(COMING):
            shift = (1.0 - (k + 1) / COMING) * apart
            if scene.held:
                data.mocap_pos[0] = scene.anchor + shift
            else:
                self.model.qpos_spring[self.pad] = -shift
            self.step(dipole)
        return self.rest(currents)

    def rest(self, currents):
        """Goes on from where it is."""
        window = self.settle(self.scene.dipole(currents), self.force)
        self.noise = np.max(np.std(window, axis=0)) / np.linalg.norm(window.mean(0))
        return window[-1], self.tip()

    def derivatives(self, currents, step):
        columns = differences(lambda at: self.rest(at)[0], currents, step)
        self.rest(currents)
        return columns
