"""What a period makes of small deviations from a periodic motion: the monodromy matrix.

The state is that of the structure and all that its joints remember. The structure is stepped
exactly under forces that change linearly from one time to the next, the joints by their own maps;
within a step the displacements u of the joints are those under which both agree,

    u = (what the structure does without the forces at the end) - G F,   F = (T + S D) u + ...

A last column is no deviation but what the given motion lacks: the structure's whole state under
the load and the forces that joints have in the motion, less the displacements of the motion. With
it a period says which motion is periodic, by Newton's method for the whole period at once.

Springs near to what the joints are in a step are taken as parts of the structure in it, and off the
joints' forces: where joints are these springs nothing is left of the error, which is of second
order in the steps, and of first order in those in which a joint changes what it does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sa_solver.types import Array

# Unknowns up to which loops are faster than calls of BLAS and LAPACK.
FEW = 8
# Of 1: what is left of a deviation that is forgotten.
FORGOTTEN = 1e-100


class StructureSteps(NamedTuple):
    """The structure's ``k`` numbers, in ``v`` kinds of steps under forces of ``m`` directions.

    ``forward`` ``(v, k, k)``, ``by_start`` and ``by_end`` ``(v, k, m)``, with the ``springs``
    ``(v, a, d, d)`` of joints in it; displacements of joints ``at_joints`` ``(m, k)`` by these
    numbers, and ``residual`` ``(m, m)`` by forces, at once.
    """

    forward: Array
    by_start: Array
    by_end: Array
    springs: Array
    at_joints: Array
    residual: Array


class JointSteps(NamedTuple):
    """The maps of ``t`` increments of ``a`` joints; ``kinds`` ``(t,)`` are those of the steps.

    The others as in :class:`fe_models.dynamics.periodic.joints.Deviations`.
    """

    kinds: np.ndarray
    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array


class GivenMotion(NamedTuple):
    """What joints do in the motion at ``t + 1`` times: displacements ``moved`` and ``force``
    ``(t + 1, a d)``; all 0 where nothing is asked of it."""

    moved: Array
    force: Array


@njit(cache=True, nogil=True)
def monodromy(
    structure: StructureSteps,
    joints: JointSteps,
    motion: GivenMotion,
    begin: Array,
    course: Array,
) -> Array:
    """Columns ``(k + a p, n + a p + 1)``: numbers of the structure first, then memory by joint.

    ``begin`` ``(k, n + a p + 1)`` is the structure at first: unit deviations in ``n`` columns, the
    last as the load begins. Displacements of joints are written into the ``course``
    ``(t + 1, a d, n + a p + 1)``, or none where that is empty.
    """
    own, size = begin.shape
    count, remembered, directions = joints.by_end.shape[1:]
    forces = count * directions
    state, memory = begin.copy(), np.zeros((count * remembered, size))
    for number in range(count * remembered):
        memory[number, size - 1 - count * remembered + number] = 1.0
    compliance = np.empty((len(structure.forward), forces, forces))
    for kind in range(len(compliance)):
        _copy(structure.residual, compliance[kind])
        _add_product(-1.0, structure.at_joints, structure.by_end[kind], compliance[kind])
    new_state, new_memory = np.empty_like(state), np.empty_like(memory)
    force, moved = np.empty((forces, size)), np.zeros((forces, size))
    slopes, matrix = np.empty((count, directions, directions)), np.empty((forces, forces))
    given = np.empty(forces)
    # Displacements at the beginning: those of the structure, less what forces do at once.
    force[:] = 0.0
    _add_blocks(1.0, joints.pull, memory, force)
    _add_last(1.0, motion.force[0], force)
    _add_product(1.0, structure.at_joints, state, moved)
    _add_product(-1.0, structure.residual, force, moved)
    _add_last(-1.0, motion.moved[0], moved)
    _add_last(-1.0, motion.force[0], force)
    for joint in range(count):
        _copy(joints.tangent[-1, joint], slopes[joint])
    _solve(_coupled(structure.residual, slopes, matrix), moved)
    _add_blocks(1.0, joints.tangent[-1], moved, force)
    if len(course):
        _copy(moved, course[0])
    for step in range(len(joints.kinds)):
        kind = joints.kinds[step]
        springs = structure.springs[kind]
        _add_blocks(-1.0, springs, moved, force)
        _beside_springs(motion, step, springs, given)
        _add_last(1.0, given, force)
        new_state[:] = 0.0
        _add_product(1.0, structure.forward[kind], state, new_state)
        _add_product(1.0, structure.by_start[kind], force, new_state)
        new_memory[:] = 0.0
        _add_blocks(1.0, joints.kept[step], memory, new_memory)
        _add_blocks(1.0, joints.by_start[step], moved, new_memory)
        force[:] = 0.0
        _add_blocks(1.0, joints.pull, new_memory, force)
        _beside_springs(motion, step + 1, springs, given)
        _add_last(1.0, given, force)
        moved[:] = 0.0
        _add_product(1.0, structure.at_joints, new_state, moved)
        _add_product(-1.0, compliance[kind], force, moved)
        _add_last(-1.0, motion.moved[step + 1], moved)
        _slopes(joints, step, springs, slopes)
        _solve(_coupled(compliance[kind], slopes, matrix), moved)
        _add_blocks(1.0, slopes, moved, force)
        _add_product(1.0, structure.by_end[kind], force, new_state)
        _add_blocks(1.0, joints.by_end[step], moved, new_memory)
        # Whole forces again: those of springs in the structure are the joints'.
        _add_last(-1.0, given, force)
        _add_blocks(1.0, springs, moved, force)
        if len(course):
            _copy(moved, course[step + 1])
        _forget(new_memory)
        state, new_state = new_state, state
        memory, new_memory = new_memory, memory
    whole = np.empty((own + count * remembered, size))
    _copy(state, whole)
    _copy(memory, whole[own:])
    return whole


@njit(cache=True, nogil=True)
def _copy(rows: np.ndarray, to: Array) -> None:
    """Write rows as others: by numbers, which takes far less time to compile than as a whole."""
    for row in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            to[row, c] = rows[row, c]


@njit(cache=True, nogil=True)
def _add_last(factor: float, values: Array, rows: Array) -> None:
    """Add to the last column."""
    last = rows.shape[1] - 1
    for row in range(len(values)):
        rows[row, last] += factor * values[row]


@njit(cache=True, nogil=True)
def _beside_springs(motion: GivenMotion, at: int, springs: Array, given: Array) -> None:
    """Write forces ``(a d,)`` of the motion at a time, less those of springs ``(a, d, d)``."""
    count, directions, _ = springs.shape
    for joint in range(count):
        first = joint * directions
        for i in range(directions):
            given[first + i] = motion.force[at, first + i]
            for k in range(directions):
                given[first + i] -= springs[joint, i, k] * motion.moved[at, first + k]


@njit(cache=True, nogil=True)
def _add_product(factor: float, matrix: Array, rows: Array, to: Array) -> None:
    """factor matrix @ rows, added."""
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
def _add_row(share: float, row: Array, to: Array) -> None:
    if share != 0.0:
        for c in range(len(row)):
            to[c] += share * row[c]


@njit(cache=True, nogil=True)
def _forget(memory: Array) -> None:
    """What has decayed below all rounding is nothing: numbers without all digits are slow."""
    for row in memory:
        for c in range(len(row)):
            if abs(row[c]) < FORGOTTEN:
                row[c] = 0.0


@njit(cache=True, nogil=True)
def _add_blocks(factor: float, blocks: Array, rows: Array, to: Array) -> None:
    """Add factor times the joints' ``blocks`` ``(a, p, q)``, on rows ``(a q, n)``: ``(a p, n)``."""
    count, height, width = blocks.shape
    for joint in range(count):
        for i in range(height):
            for k in range(width):
                row = rows[joint * width + k]
                _add_row(factor * blocks[joint, i, k], row, to[joint * height + i])


@njit(cache=True, nogil=True)
def _slopes(joints: JointSteps, step: int, springs: Array, slopes: Array) -> None:
    """T + S D less springs that the structure has, ``(a, d, d)``."""
    count, directions, remembered = joints.pull.shape
    for joint in range(count):
        for i in range(directions):
            for k in range(directions):
                slope = joints.tangent[step, joint, i, k] - springs[joint, i, k]
                for number in range(remembered):
                    pull = joints.pull[joint, i, number]
                    slope += pull * joints.by_end[step, joint, number, k]
                slopes[joint, i, k] = slope


@njit(cache=True, nogil=True)
def _coupled(compliance: Array, slopes: Array, matrix: Array) -> Array:
    """1 + G times block-diagonal slopes, in ``matrix``."""
    count, directions, _ = slopes.shape
    matrix[:] = 0.0
    for row in range(len(matrix)):
        matrix[row, row] = 1.0
        for joint in range(count):
            first = joint * directions
            for k in range(directions):
                for i in range(directions):
                    share = compliance[row, first + i] * slopes[joint, i, k]
                    matrix[row, first + k] += share
    return matrix


@njit(cache=True, nogil=True)
def _pivot(matrix: Array, column: int) -> int:
    """Row of the largest entry of a column, from the diagonal down."""
    largest = column
    for row in range(column + 1, len(matrix)):
        if abs(matrix[row, column]) > abs(matrix[largest, column]):
            largest = row
    return largest


@njit(cache=True, nogil=True)
def _solve(matrix: Array, rhs: Array) -> None:
    """Make of ``rhs`` matrix⁻¹ rhs; the matrix may be overwritten."""
    size = len(matrix)
    if size > FEW:
        _copy(np.linalg.solve(matrix, rhs), rhs)
        return
    for column in range(size):
        pivot = _pivot(matrix, column)
        inverse = 1.0 / matrix[pivot, column]
        _lift(matrix, pivot, column, inverse)
        _lift(rhs, pivot, column, inverse)
        for row in range(size):
            if row != column:
                share = -matrix[row, column]
                _add_row(share, matrix[column], matrix[row])
                _add_row(share, rhs[column], rhs[row])


@njit(cache=True, nogil=True)
def _lift(rows: Array, pivot: int, to: int, factor: float) -> None:
    """Exchange two rows, and multiply the one that has come up."""
    for c in range(rows.shape[1]):
        lifted = factor * rows[pivot, c]
        rows[pivot, c] = rows[to, c]
        rows[to, c] = lifted
