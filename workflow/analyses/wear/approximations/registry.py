"""All approximations of a wear case, and of the contacts that it is made of.

Charts, the choice of settings by ``fidelity: auto``, the error budget of a run and the advice in
its warnings read this list.
"""

from __future__ import annotations

from workflow.analyses.wear.approximations import ladders
from workflow.analyses.wear.approximations.approximation import Approximation, BudgetPart
from workflow.analyses.wear.budget.parts import ContactErrors
from workflow.analyses.wear.fidelity import decisions

# Results whose error has a known sign. Steps and increments make some places of a surface too deep
# and others too shallow, and nothing is known of the sign at worn edges.
VOLUME = ("volume",)
WEAR = "depth", *VOLUME
WEAR_AND_PEAK = *WEAR, "peak_pressure"

# Friction along a path of increments is of first order, and so is a residual in its tolerance.
APPROXIMATIONS = (
    Approximation(
        *("grid", "cells of the contact grid", ladders.grids),
        entries=("contact.grid",),
        order=ladders.GRID_ORDER,
        closed_form=True,
        decide=decisions.choose_grid,
        part=BudgetPart("grid", ContactErrors.grid, "contact.grid", WEAR_AND_PEAK),
    ),
    Approximation(
        *("tolerance", "tolerance of the contact solver", ladders.tolerances),
        entries=("contact.tolerance",),
        order=1.0,
        decide=decisions.choose_tolerance,
        part=BudgetPart("solver", ContactErrors.solver, "contact.tolerance"),
    ),
    Approximation(
        "method", "slip of the structure or of the half-space", ladders.methods, ("contact.method",)
    ),
    Approximation(
        *("stepper", "how wear steps, and how far", ladders.steppers),
        entries=("wear.step.kind",),
        order=2.0,
        decide=decisions.choose_steps,
        part=BudgetPart("steps", ContactErrors.steps, "wear.step"),
    ),
    Approximation(
        *("dimension", "two dimensions or three", ladders.dimensions, ("structure.dimension",)),
        sections=True,
        decide=decisions.choose_dimension,
    ),
    Approximation(
        *("coupling", "how often worn surfaces go back to the structure", ladders.couplings),
        entries=("coupling.drift",),
        decide=decisions.choose_drift,
        part=BudgetPart("coupling", ContactErrors.coupling, "coupling.resultants", WEAR),
    ),
    Approximation(
        *("history", "increments of the load path", ladders.histories, ("contact.history",)),
        order=1.0,
        moves_states=True,
    ),
    Approximation(
        *("increments", "increments of a cycle", ladders.increments),
        entries=("load_path.increments",),
        order=ladders.INCREMENTS_ORDER,
        decide=decisions.choose_increments,
        part=BudgetPart("increments", ContactErrors.increments, "load_path.increments", VOLUME),
    ),
    Approximation(
        *("link", "half-spaces, or corrected by the structure's nodes", ladders.links),
        entries=("contact.link",),
        order=ladders.MESH_ORDER,
        part=BudgetPart("link", ContactErrors.link, "the mesh of the contact faces", WEAR),
    ),
    Approximation(
        *("mesh", "finite elements of the structure", ladders.meshes),
        entries=("mesh.flank_nodes", "mesh.pad_elements", "mesh.size"),
        order=ladders.MESH_ORDER,
        decide=decisions.choose_mesh,
        part=BudgetPart("mesh", ContactErrors.mesh, "the mesh of the structure", WEAR_AND_PEAK),
    ),
    Approximation("order", "order of the finite elements", ladders.orders, ("mesh.order",)),
    Approximation(
        *("reference", "half-space, or finite elements alone", ladders.references),
        entries=("structure.kind",),
        order=1.0,
    ),
)

PARTS = {known.part.name: known.part for known in APPROXIMATIONS if known.part is not None}
"""Parts of the error budget by name."""
