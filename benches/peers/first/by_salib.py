"""SALib's README: Sobol' indices of the Ishigami function."""

import numpy as np
from SALib import ProblemSpec
from SALib.test_functions import Ishigami

problem = ProblemSpec(
    {
        "names": ["x1", "x2", "x3"],
        "bounds": [[-np.pi, np.pi]] * 3,
        "outputs": ["Y"],
    }
)
problem.sample_sobol(1024, seed=1).evaluate(Ishigami.evaluate).analyze_sobol(seed=1)
print(problem)
