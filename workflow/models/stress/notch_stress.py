"""Largest stress on the free surface of bodies from local models, where these converge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.stress import CycleStress, StressField
from fe_models.meshes.structure_mesh import MeshError
from fe_models.notch_stress import face_tractions
from fe_models.solvers.linear_solver import SolverError
from fe_models.structure import CycleSolution
from workflow.models.structure import StructureLoads

# Estimated error up to which a local model is preferred to the stress at the vertices, whose
# estimate leaves out the straight sides of elements and can be ten times too small below it.
SMALL = 0.02


def with_local_models(
    source: StructureLoads,
    cycles: Mapping[str, CycleSolution],
    stresses: dict[str, CycleStress],
) -> dict[str, CycleStress]:
    """Return the stresses of the states with notches from local models.

    Local models replace the stress at the vertices of a body if their estimated errors are small,
    or smaller than those at the vertices, in all states. Worn depth is not part of local models: it
    acts by the contact forces. Structures with a nonlinear stiffness keep all of theirs, and so do
    those whose bodies of second order cannot be meshed or solved.
    """
    if source.model.nonlinearity.stiffness != "linear":
        return stresses
    force = np.stack([cycle.fields()["force"][source.peak] for cycle in cycles.values()])
    amplitudes = np.tile(source.peak_amplitudes, (len(cycles), 1))
    try:
        found = source.model.notch_models(face_tractions(source.structure, force), amplitudes)
    except (MeshError, SolverError):
        return stresses
    if found is None:
        return stresses
    fields = [list(stress.fields) for stress in stresses.values()]
    for body, models in enumerate(found):
        pairs = [(of_state[body], model) for of_state, model in zip(fields, models, strict=True)]
        if all(_better(model, field) for field, model in pairs):
            for of_state, (field, model) in zip(fields, pairs, strict=True):
                assert model is not None
                of_state[body] = field.with_notch(model)
    return {
        state: replace(stress, fields=tuple(of_state))
        for (state, stress), of_state in zip(stresses.items(), fields, strict=True)
    }


def _better(model: LocalModel | None, field: StressField) -> bool:
    """Return whether a local model is better than the stress at the vertices."""
    if model is None or field.notch is None:
        return False
    return model.error < max(field.notch.error, SMALL)
