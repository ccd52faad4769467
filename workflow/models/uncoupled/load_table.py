"""Loads of two bodies as a table: a row per increment, a column per force or motion."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Self

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Material, Tilt
from workflow.models.checks.limits import MOST_INCREMENTS

FORCES = ("P", "Qx", "Qy", "Mx", "My", "Mz")
# Rigid motions conjugate to the forces, in the same order.
MOTIONS = ("approach", "shift_x", "shift_y", "tilt_x", "tilt_y", "twist")
BULK_STRESSES = ("bulk_stress_1", "bulk_stress_2")
# Forces and motions that only press the bodies together.
PRESSING = ("P", "Mx", "My", "approach", "tilt_x", "tilt_y")
# Motions along the face, and loads that shear a contact other than by moving all of it.
SHIFTS = ("shift_x", "shift_y")
SHEARING = {"Qx", "Qy", "Mz", "twist", *BULK_STRESSES}


@dataclass(frozen=True)
class LoadTable:
    """Forces and motions of two bodies at the end of each increment of a path.

    Forces act on body 2. Motions are of body 1 relative to body 2, far from the contact. Of a force
    and its motion, one may be given. Quantities without a column are forces of 0, or no bulk
    stress. Without wear, :func:`sa_solver.march_history` follows such a path:
    ``ContactLoadPath(table.imposed, table.is_motion)``.

    Parameters
    ----------
    columns : mapping of str to array (n,)
        Forces P, Qx, Qy [N] and moments Mx, My, Mz [N mm], or per mm in a line contact; or, instead
        of them, approach, shift_x, shift_y [mm], tilt_x, tilt_y, twist [rad]; and bulk_stress_1,
        bulk_stress_2 along x [MPa].

    Examples
    --------
    A ball under 50 N that is moved forward and backward by 20 µm, in two steps each way:

    >>> import fretscale
    >>> loads = fretscale.LoadTable.stroke(P=50.0, stroke=0.02, increments=2)
    >>> print(len(loads), loads["P"], loads["shift_x"])
    4 [50. 50. 50. 50.] [ 0.   -0.01  0.    0.01]

    A shear force that swings by ± 10 N:

    >>> swing = fretscale.LoadTable.legs({"P": (50.0, 50.0), "Qx": (10.0, -10.0)}, (2, 2))
    >>> print(swing["Qx"])
    [  0.  10.   0. -10.]
    """

    columns: Mapping[str, Array]

    def __post_init__(self) -> None:
        checks.instances(self, columns=Mapping)
        if unknown := sorted(self.columns.keys() - {*FORCES, *MOTIONS, *BULK_STRESSES}):
            known = ", ".join((*FORCES, *MOTIONS, *BULK_STRESSES))
            raise InputError(f"loads {', '.join(unknown)} are unknown: give {known}")
        columns = {
            name: checks.array(f"values of {name}", column, (None,))
            for name, column in self.columns.items()
        }
        lengths = sorted({len(column) for column in columns.values()})
        if len(lengths) > 1:
            raise InputError(f"columns of loads differ in length: {lengths}")
        if lengths == [0]:
            raise InputError("columns of loads are empty: give a value per increment")
        checks.settle(self, columns=columns)

    @classmethod
    def stroke(
        cls, P: float, stroke: float, increments: int = 4, direction: float = 0.0
    ) -> LoadTable:
        """Return a reciprocating motion at constant speed under a constant normal force.

        The bodies meet in the middle of the stroke: a contact in partial slip depends on where it
        first moved, and its loop would be off centre if the bodies met at one end.

        Parameters
        ----------
        P : float
            Normal force [N], or [N/mm] in a line contact.
        stroke : float
            Motion of body 2, peak to peak, far from the contact [mm].
        increments : int
            Number of equal steps of each way, forward and back.
        direction : float
            Direction of the stroke, from x to y [rad].
        """
        _require_increments(increments)
        checks.number("P", P)
        checks.number("stroke", stroke)
        checks.number("direction [rad]", direction)
        step = stroke / increments * np.array([np.cos(direction), np.sin(direction)])
        there = np.tile(step, (increments, 1))
        path = np.cumsum(np.concatenate([there, -there]), axis=0)
        x, y = (0.5 * increments * step - path).T
        return cls({"P": np.full(len(path), P), "shift_x": x, "shift_y": y})

    @classmethod
    def legs(
        cls,
        targets: Mapping[str, Sequence[float | None]],
        increments: Sequence[int],
        closed: bool = True,
    ) -> Self:
        """Return columns that change linearly from the end of each leg to that of the next one.

        Parameters
        ----------
        targets : mapping of str to sequence
            Values of each column at the ends of the legs. Where one is None the value stays;
            columns without any target are left out.
        increments : sequence of int
            Number of increments of each leg.
        closed : bool
            Whether the first leg begins where the last one ends, as in a cycle; else at 0.
        """
        if not isinstance(targets, Mapping) or not isinstance(increments, list | tuple):
            raise InputError("legs: give targets by the names of columns, and a list of increments")
        if not isinstance(closed, bool):
            raise InputError(f"closed is {checks.shown(closed)}: give True or False")
        _require_increments(*increments)
        if any(len(ends) != len(increments) for ends in targets.values()):
            raise InputError(f"{len(increments)} legs: give as many targets of every column")
        columns = {}
        for name, ends in targets.items():
            given = [checks.number(f"a target of {name}", end) for end in ends if end is not None]
            if not given:
                continue
            start = given[-1] if closed else 0.0
            reached = accumulate(
                ends, lambda value, end: value if end is None else end, initial=start
            )
            steps = zip(pairwise(reached), increments, strict=True)
            parts = [np.linspace(*leg, count + 1)[1:] for leg, count in steps]
            columns[name] = np.concatenate(parts)
        return cls(columns)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def is_motion(self) -> tuple[bool, ...]:
        """True if the motion is imposed instead of the force, by degree of freedom."""
        return tuple(motion in self.columns for motion in MOTIONS)

    @property
    def imposed(self) -> Array:
        """Force or motion imposed, ``(n, 6)`` in the order of ``FORCES``."""
        pairs = zip(FORCES, MOTIONS, strict=True)
        return np.stack([self[motion] + self[force] for force, motion in pairs], axis=1)

    def __getitem__(self, name: str) -> Array:
        """Return a column ``(n,)``, zeros if there is none of this name."""
        return self.columns.get(name, np.zeros(len(self)))

    @property
    def unfit_for_sliding(self) -> str:
        """Reason why not every cell slides by the whole motion; empty if it does."""
        if forces := sorted(self.columns.keys() & SHEARING):
            return f"has {', '.join(forces)}"
        return "" if self.columns.keys() & set(SHIFTS) else "moves nothing along the face"

    def bulk_strain(self, bodies: tuple[Material, Material]) -> Array:
        """Return the strain of body 2 less that of body 1 along x by bulk stress, ``(n,)``.

        The strain of each is σ (1 - ν²) / E: stress along x, no strain along y.
        """
        first, second = (
            self[name] * (1.0 - body.poisson**2) / body.young
            for name, body in zip(BULK_STRESSES, bodies, strict=True)
        )
        return second - first

    def held(self, tilt: Tilt) -> LoadTable:
        """Return the loads with motions of 0 for the twist and a held ``tilt`` without moments."""
        held = ["twist"] if "Mz" not in self.columns else []
        if tilt == "held":
            pairs = {"Mx": "tilt_x", "My": "tilt_y"}.items()
            held += [motion for moment, motion in pairs if moment not in self.columns]
        return LoadTable({name: np.zeros(len(self)) for name in held} | dict(self.columns))

    def in_parts(self, parts: int) -> LoadTable:
        """Return a closed cycle with each increment split into equal ``parts``."""
        if parts == 1:
            return self
        shares = np.arange(1, parts + 1) / parts

        def split(column: Array) -> Array:
            before = np.roll(column, 1)[:, None]
            return np.asarray(before + shares * (column[:, None] - before)).ravel()

        return LoadTable({name: split(column) for name, column in self.columns.items()})


def _require_increments(*counts: int) -> None:
    """Raise InputError unless every count of increments is a whole number of 1 or more."""
    for count in counts:
        checks.whole("the number of increments of a leg", count, least=1, most=MOST_INCREMENTS)


def conflict(named: Container[str]) -> tuple[str, str] | None:
    """Return entry and message of a conflict among the columns ``named``, None without one."""
    for force, motion in zip(FORCES, MOTIONS, strict=True):
        if force in named and motion in named:
            return motion, f"given together with {force}; allowed: one of them on the whole path"
    if "P" not in named and "approach" not in named:
        return "P", "neither P nor approach is given; allowed: one of them on the whole path"
    return None
