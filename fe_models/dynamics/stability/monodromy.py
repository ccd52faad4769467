"""Monodromy matrix: the map of small deviations from a periodic motion over one period.

The state consists of the structure's state and of all state variables of its joints. The structure
takes exact steps under forces that change linearly from one time to the next, and the joints follow
their own linear maps. Within a step the displacements u of the joints satisfy both,

    u = (displacement without the forces at the end of the step) - G F,   F = (T + S D) u + ...

The last column is not a deviation but the closure error of the given motion: the state of the
structure under the load and under the joint forces of the motion, less the displacements of the
motion. With it, one period determines the periodic motion by Newton's method for all times at once.

In each step, springs that resemble the joints are made part of the structure and subtracted from
the joint forces. Where joints equal these springs no error remains. The remaining error is of
second order in the steps, and of first order in those in which a joint changes its state.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sa_solver.types import Array

# Number of unknowns up to which loops are faster than calls of BLAS and LAPACK.
FEW = 8
# Magnitude below which a state variable is set to 0, relative to a unit deviation.
NEGLIGIBLE = 1e-100


class StructureSteps(NamedTuple):
    """Maps of the structure over steps of ``v`` kinds, under forces of ``m`` directions.

    Parameters
    ----------
    forward
        Matrices ``(v, k, k)`` that map the ``k`` state variables over a step.
    by_start, by_end
        Effect of forces at the start and the end of a step ``(v, k, m)``.
    springs
        Springs ``(v, a, d, d)`` at the joints that are part of the structure.
    at_joints
        Displacements of joints ``(m, k)`` per state variable.
    residual
        Quasi-static displacements of joints ``(m, m)`` per force.
    """

    forward: Array
    by_start: Array
    by_end: Array
    springs: Array
    at_joints: Array
    residual: Array


class JointSteps(NamedTuple):
    """Maps of ``a`` joints over ``t`` steps.

    ``kinds`` ``(t,)`` are the kinds of steps of the structure. The others are as in
    :class:`fe_models.dynamics.periodic.joints.Deviations`.
    """

    kinds: np.ndarray
    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array


class GivenMotion(NamedTuple):
    """Displacements and forces ``(t + 1, a d)`` of the joints in the given motion, or 0.

    They are 0 if no closure error is needed.
    """

    displacement: Array
    force: Array


@njit(cache=True, nogil=True)
def monodromy(
    structure: StructureSteps,
    joints: JointSteps,
    motion: GivenMotion,
    start: Array,
    history: Array,
) -> Array:
    """Return the state after one period for every column, ``(k + a p, n + a p + 1)``.

    The rows are the state variables of the structure, then those of each joint.

    Parameters
    ----------
    structure
        Maps of the structure.
    joints
        Maps of the joints.
    motion
        The given motion of the joints.
    start
        Initial states of the structure ``(k, n + a p + 1)``: unit deviations in ``n`` columns, and
        in the last column the state with which the load begins.
    history
        Array ``(t + 1, a d, n + a p + 1)`` into which the displacements of the joints are written,
        or an empty one.
    """
    own, size = start.shape
    count, states, directions = joints.by_end.shape[1:]
    forces = count * directions
    state, memory = start.copy(), np.zeros((count * states, size))
    for number in range(count * states):
        memory[number, size - 1 - count * states + number] = 1.0
    compliance = np.empty((len(structure.forward), forces, forces))
    for kind in range(len(compliance)):
        _copy(structure.residual, compliance[kind])
        _add_product(-1.0, structure.at_joints, structure.by_end[kind], compliance[kind])
    new_state, new_memory = np.empty_like(state), np.empty_like(memory)
    force, moved = np.empty((forces, size)), np.zeros((forces, size))
    slopes, matrix = np.empty((count, directions, directions)), np.empty((forces, forces))
    given = np.empty(forces)
    # Initial displacements of the joints: those of the structure, less the quasi-static effect of
    # forces.
    force[:] = 0.0
    _add_blocks(1.0, joints.pull, memory, force)
    _add_to_last_column(1.0, motion.force[0], force)
    _add_product(1.0, structure.at_joints, state, moved)
    _add_product(-1.0, structure.residual, force, moved)
    _add_to_last_column(-1.0, motion.displacement[0], moved)
    _add_to_last_column(-1.0, motion.force[0], force)
    for joint in range(count):
        _copy(joints.tangent[-1, joint], slopes[joint])
    _solve(_coupled_matrix(structure.residual, slopes, matrix), moved)
    _add_blocks(1.0, joints.tangent[-1], moved, force)
    if len(history):
        _copy(moved, history[0])
    for step in range(len(joints.kinds)):
        kind = joints.kinds[step]
        springs = structure.springs[kind]
        _add_blocks(-1.0, springs, moved, force)
        _forces_less_springs(motion, step, springs, given)
        _add_to_last_column(1.0, given, force)
        new_state[:] = 0.0
        _add_product(1.0, structure.forward[kind], state, new_state)
        _add_product(1.0, structure.by_start[kind], force, new_state)
        new_memory[:] = 0.0
        _add_blocks(1.0, joints.kept[step], memory, new_memory)
        _add_blocks(1.0, joints.by_start[step], moved, new_memory)
        force[:] = 0.0
        _add_blocks(1.0, joints.pull, new_memory, force)
        _forces_less_springs(motion, step + 1, springs, given)
        _add_to_last_column(1.0, given, force)
        moved[:] = 0.0
        _add_product(1.0, structure.at_joints, new_state, moved)
        _add_product(-1.0, compliance[kind], force, moved)
        _add_to_last_column(-1.0, motion.displacement[step + 1], moved)
        _joint_slopes(joints, step, springs, slopes)
        _solve(_coupled_matrix(compliance[kind], slopes, matrix), moved)
        _add_blocks(1.0, slopes, moved, force)
        _add_product(1.0, structure.by_end[kind], force, new_state)
        _add_blocks(1.0, joints.by_end[step], moved, new_memory)
        # Restore the total forces: those of springs in the structure are forces of the joints.
        _add_to_last_column(-1.0, given, force)
        _add_blocks(1.0, springs, moved, force)
        if len(history):
            _copy(moved, history[step + 1])
        _flush_negligible(new_memory)
        state, new_state = new_state, state
        memory, new_memory = new_memory, memory
    whole = np.empty((own + count * states, size))
    _copy(state, whole)
    _copy(memory, whole[own:])
    return whole


@njit(cache=True, nogil=True)
def _copy(rows: np.ndarray, to: Array) -> None:
    """Copy rows element by element, which compiles far faster than an array assignment."""
    for row in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            to[row, c] = rows[row, c]


@njit(cache=True, nogil=True)
def _add_to_last_column(factor: float, values: Array, rows: Array) -> None:
    """Add factor times values to the last column."""
    last = rows.shape[1] - 1
    for row in range(len(values)):
        rows[row, last] += factor * values[row]


@njit(cache=True, nogil=True)
def _forces_less_springs(motion: GivenMotion, at: int, springs: Array, given: Array) -> None:
    """Write the forces ``(a d,)`` of the motion at a time, less those of springs ``(a, d, d)``."""
    count, directions, _ = springs.shape
    for joint in range(count):
        first = joint * directions
        for i in range(directions):
            given[first + i] = motion.force[at, first + i]
            for k in range(directions):
                given[first + i] -= springs[joint, i, k] * motion.displacement[at, first + k]


@njit(cache=True, nogil=True)
def _add_product(factor: float, matrix: Array, rows: Array, to: Array) -> None:
    """Add factor matrix @ rows."""
    if len(matrix) > FEW:
        product = np.dot(matrix, rows)
        for i in range(matrix.shape[0]):
            for c in range(rows.shape[1]):
                to[i, c] += factor * product[i, c]
        return
    for i in range(matrix.shape[0]):
        for k in range(matrix.shape[1]):
            share = factor * matrix[i, k]
            for c in range(rows.shape[1]):
                to[i, c] += share * rows[k, c]


@njit(cache=True, nogil=True)
def _add_row(factor: float, row: Array, to: Array) -> None:
    """Add factor times a row."""
    if factor != 0.0:
        for c in range(len(row)):
            to[c] += factor * row[c]


@njit(cache=True, nogil=True)
def _flush_negligible(memory: Array) -> None:
    """Set values below all rounding to 0, since arithmetic with denormal numbers is slow."""
    for row in memory:
        for c in range(len(row)):
            if abs(row[c]) < NEGLIGIBLE:
                row[c] = 0.0


@njit(cache=True, nogil=True)
def _add_blocks(factor: float, blocks: Array, rows: Array, to: Array) -> None:
    """Add to ``(a p, n)`` the joints' ``blocks`` ``(a, p, q)`` times ``rows`` ``(a q, n)``."""
    count, height, width = blocks.shape
    for joint in range(count):
        for i in range(height):
            for k in range(width):
                row = rows[joint * width + k]
                _add_row(factor * blocks[joint, i, k], row, to[joint * height + i])


@njit(cache=True, nogil=True)
def _joint_slopes(joints: JointSteps, step: int, springs: Array, slopes: Array) -> None:
    """Write T + S D less the springs that are part of the structure, ``(a, d, d)``."""
    count, directions, states = joints.pull.shape
    for joint in range(count):
        for i in range(directions):
            for k in range(directions):
                slope = joints.tangent[step, joint, i, k] - springs[joint, i, k]
                for number in range(states):
                    pull = joints.pull[joint, i, number]
                    slope += pull * joints.by_end[step, joint, number, k]
                slopes[joint, i, k] = slope


@njit(cache=True, nogil=True)
def _coupled_matrix(compliance: Array, slopes: Array, matrix: Array) -> Array:
    """Write 1 + G times block-diagonal slopes into ``matrix``, and return it."""
    count, directions, _ = slopes.shape
    matrix[:] = 0.0
    for row in range(len(matrix)):
        matrix[row, row] = 1.0
        for joint in range(count):
            first = joint * directions
            for k in range(directions):
                for i in range(directions):
                    factor = compliance[row, first + i] * slopes[joint, i, k]
                    matrix[row, first + k] += factor
    return matrix


@njit(cache=True, nogil=True)
def _pivot(matrix: Array, column: int) -> int:
    """Return the row of the largest entry of a column, from the diagonal down."""
    largest = column
    for row in range(column + 1, len(matrix)):
        if abs(matrix[row, column]) > abs(matrix[largest, column]):
            largest = row
    return largest


@njit(cache=True, nogil=True)
def _solve(matrix: Array, rhs: Array) -> None:
    """Overwrite ``rhs`` with matrix⁻¹ rhs; the matrix may be overwritten."""
    size = len(matrix)
    if size > FEW:
        _copy(np.linalg.solve(matrix, rhs), rhs)
        return
    for column in range(size):
        pivot = _pivot(matrix, column)
        inverse = 1.0 / matrix[pivot, column]
        _swap_and_scale(matrix, pivot, column, inverse)
        _swap_and_scale(rhs, pivot, column, inverse)
        for row in range(size):
            if row != column:
                factor = -matrix[row, column]
                _add_row(factor, matrix[column], matrix[row])
                _add_row(factor, rhs[column], rhs[row])


@njit(cache=True, nogil=True)
def _swap_and_scale(rows: Array, pivot: int, to: int, factor: float) -> None:
    """Swap two rows, and multiply the one that moves up by a factor."""
    for c in range(rows.shape[1]):
        scaled = factor * rows[pivot, c]
        rows[pivot, c] = rows[to, c]
        rows[to, c] = scaled
