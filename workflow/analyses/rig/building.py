"""The rig that a case describes: a row of masses, a reduced body, or two specimens."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from fe_models.dynamics.damping import damped
from fe_models.dynamics.ground_motion import Translation
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from workflow.analyses.rig.bodies.friction_rig import friction_rig_model
from workflow.analyses.rig.bodies.reduced_rig import known_rig_model, reduced_rig_model
from workflow.analyses.rig.bodies.ring import RingOfSectors
from workflow.analyses.rig.damping import Damping
from workflow.analyses.rig.joint_sections import ElasticJoint, Joint
from workflow.analyses.rig.place_names import PlaceNames, in_a_row, place_names_of
from workflow.analyses.rig.structure import FrictionRig, JointedBody, RowOfMasses, joints_of
from workflow.models.rig.rig_model import JointEntry, RigModel
from workflow.shell.terminal.reporter import Reporter


def rig_model(
    structure: RowOfMasses | JointedBody | FrictionRig,
    joint: Joint | ElasticJoint | None,
    mass: int | None,
    reporter: Reporter,
    ring: RingOfSectors | None = None,
    engine_order: int = 1,
) -> RigModel:
    """Return the rig with its joints.

    In a row of masses, the excitation acts on number ``mass``. ``joint`` is the law of the entries
    of joints that have no law of their own. A sector of a ``ring`` is driven by an
    ``engine_order``.

    Raises UserError where the bodies cannot be built as the case describes them.
    """
    if isinstance(structure, JointedBody):
        built = reduced_rig_model(structure, joint, reporter, ring, engine_order)
        return _damped(built, structure.damping)
    if isinstance(structure, FrictionRig):
        return _damped(friction_rig_model(structure, reporter), structure.damping)
    return row_of_masses(structure, mass or 1, joint is not None)


def known_rig(
    structure: RowOfMasses | JointedBody | FrictionRig,
    joint: Joint | ElasticJoint | None,
    mass: int | None,
    ring: RingOfSectors | None = None,
    engine_order: int = 1,
) -> RigModel | None:
    """Return the rig as far as it is known before a run, to check the places that a case names.

    Returns None for a structure whose bodies are meshed and reduced only by the run. Raises
    EntryError where the case names a place that does not exist.
    """
    if isinstance(structure, JointedBody):
        built = known_rig_model(structure, joint, ring, engine_order)
        return None if built is None else _damped(built, structure.damping)
    if isinstance(structure, FrictionRig):
        return None
    return row_of_masses(structure, mass or 1, joint is not None)


def row_of_masses(rig: RowOfMasses, driven: int = 1, shared: bool = True) -> RigModel:
    """Return masses m1, m2, ... in a row, counted from the ground, with joints.

    If a law of the case is ``shared`` but no entry uses it, a joint with this law is added between
    the last mass and the ground.
    """
    joined = joints_of(rig, shared)
    names = [f"m{number}" for number in range(1, len(rig.masses) + 1)]
    links = [Link(name, before) for name, before in zip(names, [None, *names], strict=False)]
    places = in_a_row(names)
    joints = [
        [link]
        for number, joint in enumerate(joined)
        for link in places.links(joint, f"structure.joints.{number}")
    ]
    model = lumped_rig(
        dict(zip(names, rig.masses, strict=True)),
        dict(zip(links, rig.springs, strict=True)),
        joints,
        np.array(rig.damping_ratio),
    )
    driving = unit_force(model, f"m{driven}")
    along = Translation(np.ones(len(names)), model.mass.sum(axis=1))
    built = RigModel(
        *(model, driving, np.eye(len(names)), tuple(names)),
        entries=tuple(JointEntry(1, own=joint.joint is not None) for joint in joined),
        translations={"x": along},
    )
    return _damped(built, rig.damping)


def _damped(rig: RigModel, damping: Damping | None) -> RigModel:
    """Return the rig with the damping that is given in addition to its modal damping.

    Raises EntryError for dashpots at places that do not exist.
    """
    if damping is None:
        return rig
    dashpots: defaultdict[Link, float] = defaultdict(float)
    sector = rig.sector
    names = place_names_of(rig) if sector is None else PlaceNames(sector.model.names)
    for number, dashpot in enumerate(damping.dashpots):
        links = names.links(dashpot, f"structure.damping.dashpots.{number}")
        for link in links:
            dashpots[link] += dashpot.coefficient / len(links)
    factors = (0.0, 0.0) if damping.rayleigh is None else damping.rayleigh.factors
    more = *factors, damping.loss_factor, dashpots
    if sector is None:
        return replace(rig, model=damped(rig.model, *more))
    sector = replace(sector, model=damped(sector.model, *more))
    return replace(rig, model=sector.at(0), sector=sector)
