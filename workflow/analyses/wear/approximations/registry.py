"""All approximations of a wear case, and of the contacts that it is made of.

Charts, the choice of settings by ``fidelity: auto``, the error budget of a run and the advice in
its warnings read this list.
"""

from __future__ import annotations

from workflow.analyses.wear.approximations import ladders
from workflow.analyses.wear.approximations.approximation import Approximation
from workflow.analyses.wear.budget.parts import ContactErrors
from workflow.analyses.wear.fidelity import decisions

# Orders of convergence: the square-root end of a pressure keeps a grid from second order, friction
# along a path of increments is of first order, and so is a residual in its tolerance. Signs: steps
# and increments make some places of a surface too deep and others too shallow, and nothing is known
# of the sign at worn edges.
APPROXIMATIONS = (
    Approximation(
        name="grid",
        what="cells of the contact grid",
        ladder=ladders.grids,
        entries=("contact.grid",),
        order=2.0,
        closed_form=True,
        decide=decisions.choose_grid,
        part="grid",
        errors=ContactErrors.grid,
        signed=("depth", "volume", "peak_pressure"),
    ),
    Approximation(
        name="tolerance",
        what="tolerance of the contact solver",
        ladder=ladders.tolerances,
        entries=("contact.tolerance",),
        order=1.0,
        decide=decisions.choose_tolerance,
        part="solver",
        errors=ContactErrors.solver,
    ),
    Approximation(
        name="method",
        what="slip of the structure or of the half-space",
        ladder=ladders.methods,
        entries=("contact.method",),
    ),
    Approximation(
        name="stepper",
        what="how wear steps, and how far",
        ladder=ladders.steppers,
        entries=("wear.step.kind",),
        order=2.0,
        decide=decisions.choose_steps,
        part="steps",
        errors=ContactErrors.steps,
    ),
    Approximation(
        name="dimension",
        what="two dimensions or three",
        ladder=ladders.dimensions,
        entries=("structure.dimension",),
        sections=True,
    ),
    Approximation(
        name="coupling",
        what="how often worn surfaces go back to the structure",
        ladder=ladders.couplings,
        entries=("coupling.drift",),
        decide=decisions.choose_drift,
        part="coupling",
        errors=ContactErrors.coupling,
        signed=("depth", "volume"),
    ),
    Approximation(
        name="history",
        what="increments of the load path",
        ladder=ladders.histories,
        entries=("contact.history",),
        order=1.0,
        moves_states=True,
    ),
    Approximation(
        name="increments",
        what="increments of a cycle",
        ladder=ladders.increments,
        entries=("load_path.increments",),
        order=2.0,
        decide=decisions.choose_increments,
        part="increments",
        errors=ContactErrors.increments,
        signed=("volume",),
    ),
    Approximation(
        name="link",
        what="half-spaces, or corrected by the structure's nodes",
        ladder=ladders.links,
        entries=("contact.link",),
        order=2.0,
        part="link",
        errors=ContactErrors.link,
        signed=("depth", "volume"),
        remedy="the mesh of the contact faces",
    ),
    Approximation(
        name="mesh",
        what="finite elements of the structure",
        ladder=ladders.meshes,
        entries=("mesh.flank_nodes", "mesh.pad_elements", "mesh.size"),
        order=2.0,
        decide=decisions.choose_mesh,
        part="mesh",
        errors=ContactErrors.mesh,
        signed=("depth", "volume", "peak_pressure"),
        remedy="the mesh of the structure",
    ),
    Approximation(
        name="order",
        what="order of the finite elements",
        ladder=ladders.orders,
        entries=("mesh.order",),
    ),
    Approximation(
        name="reference",
        what="half-space, or finite elements alone",
        ladder=ladders.references,
        entries=("structure.kind",),
        order=1.0,
    ),
)

PARTS = {
    approximation.part: approximation for approximation in APPROXIMATIONS if approximation.part
}
"""Approximations by their part of the error budget."""
