"""JAX in its best form: blocks of samples, every number of the state an array over the samples of a block, columns as
variational equations by hand (w, dp, dm of each), stages in a loop, so that XLA makes few large fused loops. From rest as
rod.cpp: half the steps under parts of the load, the Jacobian by the implicit function theorem."""

import jax
import jax.numpy as jnp
import numpy as np

import rod
from tableaus import TABLEAUS

jax.config.update("jax_enable_x64", True)

BLOCK = 64
MOMENT, ALL = 3, 20


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(R, v):
    return [R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2] for i in range(3)]


def times_transposed(R, v):
    return [R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2] for i in range(3)]


def unit(column, count):
    """1 for one column, 0 for the others."""
    return (jnp.arange(count) == column).astype(float)[:, None]


def slopes(x, n, own, first):
    """Of a rod (15 numbers) and its columns (9 numbers each)."""
    y, c = x
    count = c.shape[1]
    R, m = y[3:12], y[12:15]
    inverse = [1 / own[3], 1 / own[3], 1 / own[4]]
    body = times_transposed(R, m)
    u = [own[i] + body[i] * inverse[i] for i in range(3)]
    rows = [R[3 * i : 3 * i + 3] for i in range(3)]
    turned = [v for a in rows for v in (a[1] * u[2] - a[2] * u[1], a[2] * u[0] - a[0] * u[2], a[0] * u[1] - a[1] * u[0])]
    t = [R[2], R[5], R[8]]
    w, dm = c[0:3], c[6:9]
    du = [d * i for d, i in zip(times_transposed(R, [a - b for a, b in zip(dm, cross(w, m))]), inverse)]
    dp = cross(w, t)
    d_moment = cross(n, dp)
    if count == ALL:
        own_column = lambda k: unit(MOMENT + first + k, count)
        for i in range(3):
            du[i] = du[i] + own_column(i) - own_column(3 if i < 2 else 4) * (body[i] * inverse[i] ** 2)
        dn = [unit(MOMENT + 3 + i, count) for i in range(3)]
        d_moment = [a + b for a, b in zip(d_moment, cross(dn, t))]
    return jnp.stack([*t, *turned, *cross(n, t)]), jnp.stack([*times(R, du), *dp, *d_moment])


def step(x, h, f, method):
    """One explicit step; all stages in a loop."""
    A, b = (jnp.array(v) for v in TABLEAUS[method])
    moved = lambda weights, ks: jax.tree.map(lambda v, k: v + h * jnp.tensordot(weights, k, 1), x, ks)
    empty = jax.tree.map(lambda v: jnp.zeros((len(b), *v.shape)), x)
    put = lambda i, ks: jax.tree.map(lambda k, v: k.at[i].set(v), ks, f(moved(A[i], ks)))
    return moved(b, jax.lax.fori_loop(0, len(b), put, empty))


def across(x, scene, n, currents, load):
    """Over the coil, with its dipole and the lever arm of the force."""
    y, c = x
    count = c.shape[1]
    R, w = y[3:12], c[0:3]
    turns_area, field = [float(v) for v in scene.turns_area.ravel()], [float(v) for v in scene.field]
    arm = [scene.rigid * R[k] for k in (2, 5, 8)]
    dipole = times(R, times(turns_area, [load * v for v in currents]))
    torque = [a + b for a, b in zip(cross(dipole, field), cross(arm, n))]
    d_dipole, d_arm = cross(w, dipole), cross(w, arm)
    if count == ALL:
        for k in range(3):
            by_current = times(R, [load * turns_area[3 * i + k] for i in range(3)])
            d_dipole = [a + unit(MOMENT + k, count) * b for a, b in zip(d_dipole, by_current)]
    d_torque = [a + b for a, b in zip(cross(d_dipole, field), cross(d_arm, n))]
    if count == ALL:
        dn = [unit(MOMENT + 3 + i, count) for i in range(3)]
        d_torque = [a + b for a, b in zip(d_torque, cross(arm, dn))]
    y = jnp.concatenate([y[:3] + jnp.stack(arm), R, y[12:15] - jnp.stack(torque)])
    return y, jnp.concatenate([w, c[3:6] + jnp.stack(d_arm), c[6:9] - jnp.stack(d_torque)])


def solved(W, r):
    """W^-1 r, W by columns, each number an array."""
    a, b, c = W
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    determinant = a[0] * bc[0] + a[1] * bc[1] + a[2] * bc[2]
    return [(v[0] * r[0] + v[1] * r[1] + v[2] * r[2]) / determinant for v in (bc, ca, ab)]


def solver(scene, method, steps):
    """A function over all samples: tips and Jacobians from rest."""
    flexible = scene.rest[3] + scene.distal
    counts = [max(1, round(steps * length / flexible)) for length in (scene.rest[3], scene.distal)]

    def shoot(m0, theta, load, counts, columns):
        n = [load * v for v in theta[3:6]]
        size = m0.shape[1]
        y = jnp.concatenate([jnp.zeros((3, size)), jnp.eye(3).ravel()[:, None] * jnp.ones(size), m0])
        c = jnp.zeros((9, columns, size)).at[jnp.arange(6, 9), jnp.arange(3)].set(1.0)
        x = (y, c)
        for index, (length, count) in enumerate(zip((theta[rod.INSERTION], scene.distal), counts)):
            own = theta[rod.OWN[index]]
            f = lambda x, own=own, first=rod.OWN[index].start: slopes(x, n, own, first)
            x, _ = jax.lax.scan(lambda x, _, h=length / count, f=f: (step(x, h, f, method), None), x, None, length=count)
            if index == 0:
                if columns == ALL:
                    # A longer segment ends later.
                    y, c = x
                    dy, _ = f(x)
                    body = times_transposed(y[3:12], y[12:15])
                    u = [own[i] + body[i] / own[3 if i < 2 else 4] for i in range(3)]
                    later = jnp.stack([*times(y[3:12], u), *dy[:3], *dy[12:15]])
                    x = (y, c + unit(MOMENT + rod.INSERTION, columns) * later[:, None])
                x = across(x, scene, n, theta[:3], load)
        return x

    def newton(m0, theta, load, counts):
        y, c = shoot(m0, theta, load, counts, MOMENT)
        return m0 - jnp.stack(solved([c[6:9, k] for k in range(3)], y[12:15]))

    def solve(thetas):
        theta = thetas.T
        half = [max(1, count // 2) for count in counts]

        def under(states, load):
            m0, before = states
            guess = 2 * m0 - before
            return (newton(newton(guess, theta, load, half), theta, load, half), m0), None

        zero = jnp.zeros((3, theta.shape[1]))
        (m0, _), _ = jax.lax.scan(under, (zero, zero), jnp.array(rod.LOADS))
        m0, _ = jax.lax.scan(lambda m0, _: (newton(m0, theta, 1.0, counts), None), m0, None, length=2)
        y, c = shoot(m0, theta, 1.0, counts, ALL)
        d = solved([c[6:9, k][:, None] for k in range(3)], c[6:9, 3:])
        total = c[:6, 3:] - sum(c[:6, k][:, None] * d[k] for k in range(3))
        w, R = total[:3], y[3:12]
        # dR = hat(w) R
        dR = [v for i in range(3) for v in [w[(i + 1) % 3] * R[3 * ((i + 2) % 3) + k] - w[(i + 2) % 3] * R[3 * ((i + 1) % 3) + k] for k in range(3)]]
        return y.T, jnp.transpose(jnp.concatenate([total[3:6], jnp.stack(dR)]), (2, 0, 1))

    block = jax.jit(solve)

    def in_blocks(thetas):
        found = [block(thetas[at : at + BLOCK]) for at in range(0, len(thetas), BLOCK)]
        return [np.concatenate([np.asarray(x[k]) for x in found]) for k in range(2)]

    return in_blocks
