"""The rig that a case describes: a row of masses, a reduced body, or two specimens."""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from workflow.analyses.rig.friction_rig import friction_rig_model
from workflow.analyses.rig.joint_sections import ElasticJoint, FrictionContactJoint, Joint
from workflow.analyses.rig.reduced_rig import reduced_rig_model
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.rig.structure import FrictionRig, ReducedBody, Rig
from workflow.shell.reporter import Reporter


def rig_model(
    structure: Rig | ReducedBody | FrictionRig,
    joint: Joint | ElasticJoint,
    mass: int | None,
    reporter: Reporter,
) -> RigModel:
    """The rig with its joints, of masses in a row driven at the ``mass`` of this number.

    Raises UserError where its bodies cannot be what the case says.
    """
    if isinstance(structure, ReducedBody):
        directions = 3 if isinstance(joint, FrictionContactJoint) else 1
        return reduced_rig_model(structure, directions, reporter)
    if isinstance(structure, FrictionRig):
        return friction_rig_model(structure, reporter)
    return row_of_masses(structure, mass or 1)


def row_of_masses(rig: Rig, driven: int = 1) -> RigModel:
    """Masses m1, m2, ... in a row from the ground on, the last held to the ground by the joint."""
    names = [f"m{number}" for number in range(1, len(rig.masses) + 1)]
    links = [Link(name, before) for name, before in zip(names, [None, *names], strict=False)]
    model = lumped_rig(
        dict(zip(names, rig.masses, strict=True)),
        dict(zip(links, rig.springs, strict=True)),
        [[Link(names[-1])]],
        rig.damping_ratio,
    )
    driving = unit_force(model, f"m{driven}")
    return RigModel(model, driving, np.eye(len(names)), tuple(names))
