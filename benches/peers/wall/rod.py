"""Golden scenes of a tip on a plane, without units: lengths over the rod's, moments over EI/L, forces over EI/L².

The rod is a flexible segment, a rigid one with coils and weight, and a flexible segment. The unknown force f of the
wall acts at its end. A wall of tissue is a spring along its normal; a held tip stays at its anchor.
"""

import json
import tomllib
from pathlib import Path

import numpy as np

GOLDEN = Path(__file__).parents[3] / "tests/data/wall"
NAMES = ("p6-tissue", "p6-held")


class Scene:
    def __init__(self, name):
        with open(GOLDEN / f"{name}.json") as text:
            golden = json.load(text)
        self.name, self.text = name, golden["scene"]
        scene = tomllib.loads(self.text)
        proximal, coil, distal = scene["segment"]
        gravity = np.array(scene["loads"]["gravity"])
        outer, inner = proximal["tube"]["outer_radius"], proximal["tube"]["inner_radius"]
        area_moment = np.pi / 4 * (outer**4 - inner**4)
        bending = proximal["youngs_modulus"] * area_moment
        self.length = sum(segment["length"] for segment in scene["segment"])
        moment = bending / self.length
        self.force_unit = moment / self.length
        self.lengths = np.array([s["length"] for s in (proximal, coil, distal)]) / self.length
        # Per flexible segment: diagonal of the stiffness, rest curvature, weight of a length.
        young, shear = [np.array([s[f"{kind}_modulus"] for s in (proximal, distal)]) for kind in ("youngs", "shear")]
        self.stiffness = area_moment * np.array([young, young, 2 * shear]).T / bending
        self.rest = np.array([s["rest_curvature"] for s in (proximal, distal)]) * self.length
        self.weight = np.array([s["linear_density"] * gravity for s in (proximal, distal)])
        self.weight *= self.length / self.force_unit
        self.coil_weight = coil["mass"] * gravity / self.force_unit
        field = np.array(scene["field"]["flux_density"])
        self.field = field / np.linalg.norm(field)
        self.turns_area = np.array(coil["coil"]["turns_area"]) * np.linalg.norm(field) / moment
        self.currents = np.array(coil["coil"]["current"])
        # Forces at the distal ends of both flexible segments, less f.
        self.beyond = np.array([self.coil_weight + self.weight[1] * self.lengths[2], np.zeros(3)])
        wall = scene["wall"]
        self.normal = np.array(wall["normal"]) / np.linalg.norm(wall["normal"])
        self.offset = (self.normal @ wall["position"] + wall.get("tip_radius", 0.0)) / self.length
        self.held = wall["tip"] == "sticks"
        if self.held:
            anchor = np.array(wall["anchor"]) / self.length
            self.anchor = anchor - self.gap(anchor) * self.normal
        else:
            self.tissue = wall["stiffness"] * self.length / self.force_unit
        by = [golden["parameters"].index(f"coil.current.{a}") for a in "xyz"]
        self.true_force = np.array(golden["contact"]["force"]) / self.force_unit
        self.true_tip = np.array(golden["tip"]["position"]) / self.length
        self.true_columns = np.array(golden["derivatives"]["force"])[:, by] / self.force_unit

    def gap(self, p):
        return self.normal @ p - self.offset

    def dipole(self, currents):
        return self.turns_area @ currents

    def tangents(self):
        """Two unit vectors along the wall, across each other."""
        across = np.linalg.svd(self.normal[None])[2]
        return across[1:]

    def errors(self, force, tip):
        """Of the force, relative, and of the tip over the rod's length."""
        size = np.linalg.norm(self.true_force)
        return np.linalg.norm(force - self.true_force) / size, np.linalg.norm(tip - self.true_tip)

    def column_error(self, columns):
        """Of d(force)/d(current): the worst of three columns, relative."""
        wrong = np.linalg.norm(columns - self.true_columns, axis=0)
        return np.max(wrong / np.linalg.norm(self.true_columns, axis=0))


def hat(v):
    """The matrix of a cross product; of many vectors along the axes after the first."""
    zero = 0.0 * v[0]
    return np.array([[zero, -v[2], v[1]], [v[2], zero, -v[0]], [-v[1], v[0], zero]])


def differences(force, currents, step):
    """d(force)/d(current) by central differences: three columns."""
    sides = [[force(currents + side * step * e) for side in (1, -1)] for e in np.eye(3)]
    return np.array([(above - below) / (2 * step) for above, below in sides]).T
