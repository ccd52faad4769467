"""The friction rig of a case: the two specimens of another case, reduced, and two masses."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fe_models.dynamics.friction_rig import friction_rig, ground_inertia
from fe_models.dynamics.ground_motion import Translation, along
from fe_models.dynamics.rig import RigError, unit_force
from fe_models.joints.reduction import ReducedModel
from workflow.analyses.rig.bodies.reduced_rig import AXES, reduced_specimens
from workflow.analyses.rig.structure import FrictionRig
from workflow.errors import UserError
from workflow.models.rig.rig_model import RigModel
from workflow.shell.terminal.reporter import Reporter

# Observed displacements of the model; the last one is the main one.
SEEN = {"m1": "m1 x", "m2": "m2 x"}


def friction_rig_model(rig: FrictionRig, reporter: Reporter) -> RigModel:
    """Return the rig with its specimens, pressed together by the joint's normal load.

    Raises UserError for a file that is not a specimens case, or for bodies that cannot be meshed.
    """
    with reporter.stage("reduction", "steps") as reported:
        key, file = "structure.specimens", rig.specimens
        case, bodies = reduced_specimens(key, file, reporter, reported, rig.target_distance)
    for finer in case.finer_than_nodes("no rig has more"):
        reporter.say(finer)
    try:
        specimens = bodies.reduction.models
        ratios = np.array(rig.damping_ratio)
        model = friction_rig(*specimens, rig.masses, rig.springs, ratios)
    except RigError as error:
        raise UserError(f"structure: {error}") from error
    face = bodies.face
    return RigModel(
        model,
        driven=unit_force(model, "m1 x"),
        seen=np.array([unit_force(model, name) for name in SEEN.values()]),
        labels=tuple(SEEN),
        directions=3,
        in_a_row=False,
        pressing=-unit_force(model, "m2 z"),
        stretch=unit_force(model, "upper target 1 x") - unit_force(model, "lower target 1 x"),
        places=face.coordinates,
        # The upper specimen is lowered until the pads first touch.
        gap=face.gap - face.gap.min(),
        area=face.nodal_areas,
        translations=_translations(rig, specimens, model.names),
    )


def _translations(
    rig: FrictionRig, specimens: tuple[ReducedModel, ReducedModel], names: tuple[str, ...]
) -> dict[str, Translation]:
    """Return the rigid translations of the rig with the ground, by axis.

    An axis is left out where a specimen is held to something other than the rig.
    """
    found = {}
    for axis in AXES:
        with suppress(RigError):
            inertia = ground_inertia(*specimens, rig.masses, axis)
            found[axis] = Translation(along(names, axis), inertia)
    return found
