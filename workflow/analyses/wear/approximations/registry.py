"""All approximations of a wear case, and of the contacts that it is made of.

Charts, the choice of settings by ``fidelity: auto``, the error budget of a run and the advice in
its warnings read this list.
"""

from __future__ import annotations

from workflow.analyses.wear.approximations import ladders
from workflow.analyses.wear.approximations.approximation import Approximation, Remedy
from workflow.analyses.wear.fidelity import decisions
from workflow.models.budget import convergence

# Friction along a path of increments is of first order, and so is a residual in its tolerance.
APPROXIMATIONS = (
    Approximation(
        *("grid", "cells of the contact grid", ladders.grids),
        entries=("contact.grid",),
        order=convergence.GRID_ORDER,
        closed_form=True,
        decide=decisions.choose_grid,
        remedy=Remedy("grid", "contact.grid"),
    ),
    Approximation(
        *("tolerance", "tolerance of the contact solver", ladders.tolerances),
        entries=("contact.tolerance", "contact.grid"),
        order=1.0,
        decide=decisions.choose_tolerance,
        remedy=Remedy("solver", "contact.tolerance"),
    ),
    Approximation(
        "method", "slip of the structure or of the half-space", ladders.methods, ("contact.method",)
    ),
    Approximation(
        *("stepper", "how wear steps, and how far", ladders.steppers),
        entries=("wear.step.kind",),
        order=2.0,
        decide=decisions.choose_steps,
        remedy=Remedy("steps", "wear.step"),
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
        remedy=Remedy("coupling", "coupling.resultants"),
    ),
    Approximation(
        *("history", "increments of the load path", ladders.histories, ("contact.history",)),
        order=1.0,
        moves_states=True,
    ),
    Approximation(
        *("increments", "increments of a cycle", ladders.increments),
        entries=("load_path.increments",),
        order=convergence.INCREMENTS_ORDER,
        decide=decisions.choose_increments,
        remedy=Remedy("increments", "load_path.increments"),
    ),
    Approximation(
        *("link", "half-spaces, or corrected by the structure's nodes", ladders.links),
        entries=("contact.link",),
        order=convergence.MESH_ORDER,
        remedy=Remedy("link", "the mesh of the contact faces"),
    ),
    Approximation(
        *("mesh", "finite elements of the structure", ladders.meshes),
        entries=("mesh.flank_nodes", "mesh.pad_elements", "mesh.size"),
        order=convergence.MESH_ORDER,
        decide=decisions.choose_mesh,
        remedy=Remedy("mesh", "the mesh of the structure"),
    ),
    Approximation(
        *("slot", "nodes along the slot", ladders.slots),
        entries=("mesh.flank_nodes",),
        order=convergence.MESH_ORDER,
        remedy=Remedy("slot", "mesh.flank_nodes"),
    ),
    Approximation("order", "order of the finite elements", ladders.orders, ("mesh.order",)),
    Approximation(
        *("reference", "half-space, or finite elements alone", ladders.references),
        entries=("structure.kind",),
        order=1.0,
    ),
)

REMEDIES = {
    known.remedy.part: known.remedy.setting for known in APPROXIMATIONS if known.remedy is not None
}
"""Remedy for each part of the error budget, where the case gives no better one."""
