"""Joint laws: the force of a contact that is one spring of a vibrating structure.

Laws, all with the interface of :mod:`wear.joints.law`
    - ``JointLaw``: that interface, force and tangent from a displacement and a state.
    - ``Jenkins``: a spring in series with a Coulomb slider.
    - ``BoucWen``: a smooth transition from sticking to sliding.
    - ``UniformIwan``, ``FourParameterIwan``: sliders in parallel, by Masing's rule.
    - ``FrictionContact``: a contact point in three dimensions, which may separate.
    - ``PolynomialSpring``, ``ElasticStop``: nonlinear springs without friction.
    - ``MixedLaw``, ``JointGroup``: joints of several laws in one structure.
    - ``JointError``: raised for parameters that a joint cannot have.

Marches
    - ``march_joints``: through any sequence of displacements.
    - ``PeriodicMarch``: over a period until the forces repeat, with their derivative.
    - ``ParallelSliders``: sliders in parallel as one joint of such a march.

Wear of joints
    - ``JointEvolution``: which parameter follows which function of the dissipated energy.
    - ``LogarithmicEvolution``, ``ArrheniusEvolution``, ``LinearEvolution``,
      ``ExponentialEvolution``, ``TabulatedEvolution``: those functions.
    - ``long_test``: energy against cycles of a long test, by jumps.
    - ``steady_stroke``: the energy of its cycles at a prescribed stroke.

Measurements
    - ``measure_loops``: friction, stiffness and energy of recorded hysteresis loops.

A slider is pulled beyond its limit of 50 N and pushed back:

>>> import numpy as np
>>> from wear.joints import Jenkins, march_joints
>>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
>>> path = np.array([0.01, -0.01]).reshape(2, 1, 1)
>>> history = march_joints(law, law.rest(1), np.zeros((1, 1)), path)
>>> print(history.force.ravel(), history.dissipated.ravel())
[ 50. -50.] [0.25 0.5 ]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from wear.joints.ageing import long_test, steady_stroke
    from wear.joints.bouc_wen import BoucWen
    from wear.joints.elastic import ElasticStop, PolynomialSpring
    from wear.joints.evolution import (
        ArrheniusEvolution,
        ExponentialEvolution,
        JointEvolution,
        LinearEvolution,
        LogarithmicEvolution,
        TabulatedEvolution,
    )
    from wear.joints.friction_contact import FrictionContact
    from wear.joints.iwan import FourParameterIwan, UniformIwan
    from wear.joints.jenkins import Jenkins
    from wear.joints.law import JointLaw, march_joints
    from wear.joints.measured.measured_loops import measure_loops
    from wear.joints.mixed import JointGroup, MixedLaw
    from wear.joints.parameters import JointError
    from wear.joints.periodic.march import PeriodicMarch
    from wear.joints.periodic.parallel import ParallelSliders

__all__ = [
    "ArrheniusEvolution",
    "BoucWen",
    "ElasticStop",
    "ExponentialEvolution",
    "FourParameterIwan",
    "FrictionContact",
    "Jenkins",
    "JointError",
    "JointEvolution",
    "JointGroup",
    "JointLaw",
    "LinearEvolution",
    "LogarithmicEvolution",
    "MixedLaw",
    "ParallelSliders",
    "PeriodicMarch",
    "PolynomialSpring",
    "TabulatedEvolution",
    "UniformIwan",
    "long_test",
    "march_joints",
    "measure_loops",
    "steady_stroke",
]

__getattr__, __dir__ = lazy_names(__name__)
