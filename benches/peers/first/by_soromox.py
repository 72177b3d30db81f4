"""Shape and Jacobian of the planar soft robot of SoRoMoX's quick start, at given strains."""

import jax
import jax.numpy as jnp
from soromox.systems import LinkSpec, PlanarPCS

jax.config.update("jax_enable_x64", True)
link = LinkSpec.circular(
    length=0.1,
    radius=0.02,
    density=1070.0,
    reference_strain=[0.0, 1.0, 0.0],
    young_modulus=2e3,
    shear_modulus=1e3,
    material_damping_coefficient=318.0,
)
robot = PlanarPCS.from_links([link] * 3)
strains = jnp.array([0.1, 0.0, 0.0, 0.2, 0.0, 0.0, 0.3, 0.0, 0.0])
shape = jax.vmap(robot.forward_kinematics, in_axes=(None, 0))(strains, jnp.linspace(0, 0.3, 100))
print("tip", shape[-1], "Jacobian", robot.jacobian(strains, 0.3))
