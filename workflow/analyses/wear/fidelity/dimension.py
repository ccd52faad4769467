"""Choice between two and three dimensions by a coarse probe of a dovetail's mid-slot."""

from __future__ import annotations

from math import ceil

from fe_models.meshes.structure_mesh import MeshError
from fe_models.meshes.transfer import FaceTransfer
from workflow.analyses.wear.checks.uniformity import sections
from workflow.analyses.wear.choice import Decision
from workflow.analyses.wear.fidelity.estimate import Numbers, scales
from workflow.analyses.wear.fidelity.probe import NOTCH
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed

ENTRY = "structure.dimension"
# Mesh of the probe: nodes across a flank, and rows along it per width of the flank. On the default
# joint, meshes from 6 x 16 to 20 x 34 nodes agree on the differences between two and three
# dimensions within 1 % of the values under the pull alone, and within 2 % under the moment, except
# for slip and energy of the lesser flank, which scatter by 4 %. Fewer rows blur the ends.
NODES_ACROSS = 8
ROWS_PER_WIDTH = 3
# Largest share of the accuracy that two dimensions may use: other approximations need the rest.
MOST_USED = 0.9


def choose_dimension(case: DovetailCase) -> Decision:
    """Choose plane strain if it gives the mid-slot values of three dimensions accurately.

    The values are P and Qx at peak load, the mean slip and the energy of a closed cycle, all per
    length and in mid-slot, of the unworn structure on coarse meshes with the same section. Wear is
    proportional to that energy.
    """
    if case.structure.skew != 0.0:
        return Decision(ENTRY, 3, "the sections of a skewed slot differ")
    try:
        values = {dimension: _mid_slot(case, dimension) for dimension in (2, 3)}
    except (MeshError, MethodFailed) as error:
        return Decision(ENTRY, 3, f"the coarse probe failed: {error}")
    differences = _differences(values[2], values[3], case.friction.coefficient)
    named = {
        (flank, name): v for flank, of_flank in differences.items() for name, v in of_flank.items()
    }
    flank, quantity = max(named, key=lambda place: named[place])
    largest = named[flank, quantity]
    probe = {"two": values[2], "three": values[3], "differences": differences}
    text = (
        "in a coarse probe of mid-slot, two dimensions differ from three by at most "
        f"{percent(largest)} ({quantity} on the {flank}); allowed: "
        f"{percent(MOST_USED * case.accuracy)}; the ends of the slot, which may wear more, are "
        "not included"
    )
    allowed = MOST_USED * case.accuracy
    dimension, used = (3, 0.0) if largest > allowed else (2, largest)
    return Decision(ENTRY, dimension, text, probe, allowed=allowed, error=used)


def _mid_slot(case: DovetailCase, dimension: int) -> Numbers:
    """Return the mid-slot values of every flank on a coarse mesh."""
    width, length = case.structure.face_width, case.structure.slot_length
    nodes = NODES_ACROSS, 1 + ceil(ROWS_PER_WIDTH * length / width)
    coarsest = {"flank_nodes": nodes, "size": width, "notch": NOTCH, "order": 1}
    mesh = case.mesh.model_copy(update=coarsest)
    structure = case.structure.model_copy(update={"dimension": dimension})
    coarse = case.model_copy(update={"structure": structure, "mesh": mesh})
    stage = structure_loads(coarse, dovetail_joint)
    middles = {}
    for contact, history in zip(stage.faces, stage.unworn(), strict=True):
        transfer = FaceTransfer.between(contact.face, contact.grid(contact.coarse))
        rows = sections(transfer, history, stage.peak, case.friction.at(0.0))
        middles[contact.face.name] = rows.middle
    return middles


def _differences(two: Numbers, three: Numbers, friction: float) -> Numbers:
    """Return relative differences of all quantities on all flanks; Qx is relative to µP."""
    differences: Numbers = {}
    for flank, relative_to in scales(three).items():
        relative_to["Qx"] = friction * relative_to["P"]
        differences[flank] = {
            name: abs(two[flank][name] - three[flank][name]) / scale if scale > 0.0 else 0.0
            for name, scale in relative_to.items()
        }
    return differences
