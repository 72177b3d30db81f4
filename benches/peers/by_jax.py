"""JAX: fixed steps of RK4 or DOP853, jit, vmap over all samples, Newton's method on the base moment with exact
derivatives (forward mode), two steps under each share of the load and four under all of it, the Jacobian by the
implicit function theorem."""

import jax
import jax.numpy as jnp

import rod
from tableaus import TABLEAUS

jax.config.update("jax_enable_x64", True)


def step(y, h, f, method):
    """One explicit step; coefficients that are zero are left out."""
    A, b = TABLEAUS[method]
    sum_of = lambda weights, slopes: sum(h * w * k for w, k in zip(weights, slopes) if w != 0.0)
    slopes = []
    for row in A:
        slopes.append(f(y + sum_of(row, slopes)))
    return y + sum_of(b, slopes)


def solver(scene, method, steps):
    """A jitted function over all samples: tips and Jacobians from rest."""
    flexible = scene.rest[3] + scene.distal
    counts = [max(1, round(steps * length / flexible)) for length in (scene.rest[3], scene.distal)]

    def shoot(m0, theta, load):
        currents, n = load * theta[:3], load * theta[3:6]
        y = rod.base(m0, jnp)
        for index, (length, count) in enumerate(zip((theta[rod.INSERTION], scene.distal), counts)):
            f = lambda y, own=theta[rod.OWN[index]]: rod.slopes(y, n, own, jnp)
            y, _ = jax.lax.scan(lambda y, _: (step(y, length / count, f, method), None), y, None, length=count)
            if index == 0:
                y = rod.across(y, scene, n, currents, jnp)
        return y

    def solve(theta):
        def newton(m0, load):
            def twice(m0):
                y = shoot(m0, theta, load)
                return y[12:15], y[12:15]

            matrix, residual = jax.jacfwd(twice, has_aux=True)(m0)
            return m0 - jnp.linalg.solve(matrix, residual)

        def under(states, load):
            m0, before = states
            guess = 2 * m0 - before
            return (newton(newton(guess, load), load), m0), None

        (m0, _), _ = jax.lax.scan(under, (jnp.zeros(3), jnp.zeros(3)), jnp.array(rod.LOADS))
        m0 = newton(newton(m0, 1.0), 1.0)
        tip = shoot(m0, theta, 1.0)
        by_m0, by_theta = jax.jacfwd(shoot, argnums=(0, 1))(m0, theta, 1.0)
        return tip, by_theta - by_m0 @ jnp.linalg.solve(by_m0[12:15], by_theta[12:15])

    return jax.jit(jax.vmap(solve))
