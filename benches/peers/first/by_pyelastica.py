"""A cantilever under a force at its tip, damped until it rests."""

import elastica as ea
import numpy as np


class Scene(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    pass


scene = Scene()
rod = ea.CosseratRod.straight_rod(
    n_elements=20,
    start=np.zeros(3),
    direction=np.array([0.0, 0.0, 1.0]),
    normal=np.array([0.0, 1.0, 0.0]),
    base_length=0.1,
    base_radius=1e-3,
    density=1000.0,
    youngs_modulus=1e7,
    shear_modulus=1e7 / 3,
)
scene.append(rod)
scene.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
force = np.array([-1e-3, 0.0, 0.0])
scene.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), force, ramp_up_time=0.1)
scene.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=20.0, time_step=1e-5)
scene.finalize()
ea.integrate(ea.PositionVerlet(), scene, 2.0, 200_000)
print("tip", rod.position_collection[:, -1], "fastest", abs(rod.velocity_collection).max())
