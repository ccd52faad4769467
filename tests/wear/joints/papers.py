"""Wear functions and joints of the two papers, in N mm and N/mm; the papers use J and kJ."""

from wear.joints.bouc_wen import BoucWen
from wear.joints.evolution import (
    ArrheniusEvolution,
    ExponentialEvolution,
    JointEvolution,
    LinearEvolution,
    LogarithmicEvolution,
)
from wear.joints.iwan import UniformIwan

J, KJ = 1e3, 1e6

# Fantetti 2019, table 4.2: test 1, between +-7 um.
RIG = BoucWen(stiffness=27.3e3, friction=0.11, normal_load=60.0, residual_stiffness=0.88e3)
RIG_EVOLUTION = JointEvolution(
    stiffness=ArrheniusEvolution(1.32, 150.0 * J),
    residual_stiffness=LinearEvolution(0.24 / KJ),
    friction=LogarithmicEvolution(0.26, 1.3e9 / J),
)
RIG_AMPLITUDE = 7e-3


def bolted(a1: float, a2: float, a3: float, b1: float, b2: float) -> JointEvolution:
    """Return Li 2020, table 3 with the coefficients of table A2."""
    slow, fast = -0.3 / KJ, -5.0 / KJ
    return JointEvolution(
        stiffness=ExponentialEvolution(a2, slow, b1, fast),
        friction=ExponentialEvolution(a3, slow, b2, fast),
        normal_load=ExponentialEvolution(a1, slow),
    )


# Law, evolution, amplitude.
BOLTED = {
    "test2": (UniformIwan(105e3, 0.30, 710.0), bolted(0.72, 1.71, 1.16, 0.4, 0.2), 18e-3),
    "test4": (UniformIwan(115e3, 0.34, 745.0), bolted(0.72, 1.31, 1.12, 0.8, 0.5), 11e-3),
}
