"""CasADi: both segments are CVODES integrators in one symbolic shooting function; Newton's matrix and the Jacobian are
CasADi's own derivatives of it, by CVODES' forward sensitivities."""

import casadi as ca
import numpy as np

import rod


def slopes(y, n, own):
    """Those of rod.py on CasADi's symbols."""
    R, m = ca.reshape(y[3:12], 3, 3).T, y[12:15]
    stiffness = ca.vertcat(own[3], own[3], own[4])
    u = own[:3] + ca.mtimes(R.T, m) / stiffness
    turned = ca.mtimes(R, ca.skew(u))
    return ca.vertcat(R[:, 2], ca.reshape(turned.T, 9, 1), ca.cross(n, R[:, 2]))


def across(y, scene, n, currents):
    R = ca.reshape(y[3:12], 3, 3).T
    arm = scene.rigid * R[:, 2]
    mu = ca.mtimes(R, ca.mtimes(ca.DM(scene.turns_area), currents))
    return ca.vertcat(y[:3] + arm, y[3:12], y[12:15] - ca.cross(mu, ca.DM(scene.field)) - ca.cross(arm, n))


def solver(scene, tolerance):
    """A function of theta that returns tip and Jacobian from rest."""
    y, length, n, own = (ca.SX.sym(name, size) for name, size in (("y", rod.STATE), ("length", 1), ("n", 3), ("own", 5)))
    system = {"x": y, "p": ca.vertcat(length, n, own), "ode": length * slopes(y, n, own)}
    options = {"abstol": tolerance, "reltol": tolerance, "linear_multistep_method": "adams",
               "nonlinear_solver_iteration": "functional"}
    segment = ca.integrator("segment", "cvodes", system, 0.0, 1.0, options)

    m0, theta, load = ca.MX.sym("m0", 3), ca.MX.sym("theta", 17), ca.MX.sym("load")
    currents, n = load * theta[:3], load * theta[3:6]
    at = ca.vertcat(ca.DM.zeros(3), ca.DM(np.eye(3).ravel()), m0)
    at = segment(x0=at, p=ca.vertcat(theta[rod.INSERTION], n, theta[rod.OWN[0]]))["xf"]
    at = across(at, scene, n, currents)
    tip = segment(x0=at, p=ca.vertcat(scene.distal, n, theta[rod.OWN[1]]))["xf"]
    newton = ca.Function("newton", [m0, theta, load], [tip[12:15], ca.jacobian(tip[12:15], m0)])
    answer = ca.Function("answer", [m0, theta, load], [tip, ca.jacobian(tip, m0), ca.jacobian(tip, theta)])

    def solve(theta):
        def step(m0, load):
            residual, matrix = newton(m0, theta, load)
            return -np.linalg.solve(np.array(matrix), np.array(residual).ravel())

        m0 = rod.from_rest(step, np.zeros(3), tolerance)
        tip, by_m0, by_theta = (np.array(x) for x in answer(m0, theta, 1.0))
        return tip.ravel(), by_theta - by_m0 @ np.linalg.solve(by_m0[12:15], by_theta[12:15])

    return solve
