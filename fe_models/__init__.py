"""Structures: geometry and meshes, elasticity, reduction to the interfaces, structural friction.

A structure is meshed (:mod:`fe_models.geometry`), assembled as elastic bodies, condensed onto the
nodes of its interfaces, and marched through a load path with Coulomb friction at the interfaces.
Vibration with friction joints is in :mod:`fe_models.dynamics`. Most programs begin with these:

- ``Body``, ``Interface``, ``StructureMesh``: meshed bodies and the faces where they meet
- ``ElasticBody``: stiffness, mass, loads and stresses of one body
- ``Constraints``: the displacements of a body that supports hold
- ``SupportedBody``: a supported, loaded body, condensed onto its interface nodes
- ``Structure``: supported bodies with their interfaces, and the closed cycle of a load path
- ``JointStiffness``, ``FrictionalJoint``: the joint of condensed bodies, and friction in it
- ``reduce_body``, ``ReducedModel``: Guyan and Craig-Bampton reduction
- ``ReducedPair``, ``FrettingConditions``: two reduced specimens that fret
- ``MeshError``, ``SolverError``: a mesh that cannot be used, a system that cannot be solved

One node on springs of 100 N/mm is pressed with 10 N and then loaded along the face by 3 N and by
6 N, with µ = 0.4. The node sticks under 3 N; it slips under 6 N, because friction carries only 4 N.

>>> import numpy as np
>>> from fe_models import FrictionalJoint, JointStiffness
>>> normal_and_shear = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]])
>>> springs = JointStiffness(100.0 * np.eye(3), normal_and_shear, 0, 100.0, 100.0)
>>> joint = FrictionalJoint(springs.resolvent(), friction=0.4)
>>> for state in joint.march(np.array([[10.0, 3.0], [10.0, 6.0]]), gap=np.zeros(1)):
...     print(f"{state.force[0, 0]:.3f} N, slipped {abs(state.slip[0, 0]):.3f} mm")
3.000 N, slipped 0.000 mm
4.000 N, slipped 0.020 mm
"""

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.elasticity.body import ElasticBody
    from fe_models.joints.friction import FrictionalJoint
    from fe_models.joints.joint import JointStiffness
    from fe_models.joints.reduced_contact import FrettingConditions, ReducedPair
    from fe_models.joints.reduction import ReducedModel, reduce_body
    from fe_models.loads.constraints import Constraints
    from fe_models.meshes.structure_mesh import Body, Interface, MeshError, StructureMesh
    from fe_models.solvers.linear_solver import SolverError
    from fe_models.structure import Structure
    from fe_models.supported_body import SupportedBody

__all__ = [
    "Body",
    "Constraints",
    "ElasticBody",
    "FrettingConditions",
    "FrictionalJoint",
    "Interface",
    "JointStiffness",
    "MeshError",
    "ReducedModel",
    "ReducedPair",
    "SolverError",
    "Structure",
    "StructureMesh",
    "SupportedBody",
    "reduce_body",
]

__getattr__, __dir__ = lazy_names(__name__)
