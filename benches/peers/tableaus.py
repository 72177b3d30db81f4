"""Coefficients of the methods with fixed steps: A and b."""

import numpy as np
from scipy.integrate import DOP853

RK4 = (np.array([[0.0] * 4, [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1.0, 0]]), np.array([1, 2, 2, 1]) / 6)
TABLEAUS = {"rk4": RK4, "dop853": (np.array(DOP853.A), np.array(DOP853.B))}
