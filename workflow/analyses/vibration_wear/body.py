"""Reduced bodies as vibrating structures whose joints are contacts that wear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fe_models.dynamics.rig import unit_force
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from workflow.analyses.rig.building import rig_model
from workflow.analyses.rig.place_names import place_names_of
from workflow.analyses.vibration.model import model_on
from workflow.analyses.vibration_wear.case import ReducedWearCase
from workflow.models.rig.rig_model import JointNodes, RigModel
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter


def body_model(case: ReducedWearCase, reporter: Reporter) -> VibratingStructure:
    """Return the body before the first cycle.

    Raises UserError for an impossible structure, or for wrong points or areas.
    """
    unworn, joint = case.unworn, case.joint
    rig = rig_model(case.structure, unworn.joint, None, reporter)
    assert rig.nodes is not None
    area, gap = joint.of_points(rig.nodes.names)
    share = np.full(rig.joints, 1.0 / rig.joints)
    if joint.sharing == "area":
        share = area / area.sum()
    carried = share * joint.normal_load if joint.pressed is None else np.zeros(rig.joints)
    law = FrictionContact(
        stiffness=share * joint.stiffness,
        normal_stiffness=share * joint.normal_stiffness,
        friction=joint.friction,
        normal_load=carried,
        gap=gap,
    )
    along = rig.model.connection[rig.along :: rig.directions]
    rig = replace(
        rig,
        pressing=_pressing(case, rig, law),
        stretch=along.mean(axis=0),
        places=on_plane(rig.nodes),
        # Negative where a load has closed it.
        gap=np.broadcast_to(law.clearance, area.shape),
        area=area,
    )
    return model_on(unworn, rig, law).structure


def _pressing(case: ReducedWearCase, rig: RigModel, law: FrictionContact) -> Array:
    """Return forces ``(n,)`` of a normal load of 1 N, on the points it presses or the contacts.

    Forces on the contacts balance the load of each contact before it wears, without displacement.
    """
    pressed = case.joint.pressed
    if pressed is None:
        return rig.preload(law) / case.joint.normal_load
    shares = place_names_of(rig).shared(pressed, "joint.pressed")
    return np.sum([share * unit_force(rig.model, name) for name, share in shares], axis=0)


def on_plane(nodes: JointNodes) -> Array:
    """Return places ``(j, 2)`` along the axes across the normal, from their middle.

    Empty ``(0, 2)`` where the places are not known, or there are several normals.
    """
    if nodes.places is None or not nodes.same_normal:
        return np.empty((0, 2))
    across = np.flatnonzero(nodes.normals[0] == 0.0)
    places = nodes.places[:, across]
    return np.asarray(places - places.mean(axis=0))
