"""Steady rolling of two bodies with friction: creep forces, and where the contact sticks and slips.

The grid moves with the contact along x, so that the surfaces pass through it against x. In each
step they pass by one cell, and their relative motion is that of the creepages and the spin. What
each pair of surface points remembers is the slip since it entered the contact. The contact becomes
steady once all points that were in contact at the beginning have left it.

Sources: Kalker 1990, Three-Dimensional Elastic Bodies in Rolling Contact,
doi:10.1007/978-94-015-7889-9; Carter 1926, doi:10.1098/rspa.1926.0100 (cylinders).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sa_solver import checks
from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactStart, ContactState
from sa_solver.errors import ConvergenceError, InputError
from sa_solver.rigid_modes import PLANAR
from sa_solver.types import Array

MOST_LENGTHS = 20
"""Lengths of the contact that it rolls at most. From rest 3 or 4 make it steady to 1e-3."""


class RollingError(ConvergenceError):
    """Rolling that does not become steady, or a contact problem that did not converge."""


@dataclass(frozen=True)
class RollingState:
    """Contact that rolls steadily along x.

    Attributes
    ----------
    contact
        State of the contact. Its slip is that of rolling by one cell.
    creepage
        Relative motion of the bodies along x and y over the rolled distance (2,) [1].
    spin
        Relative rotation about z over the rolled distance [rad/mm].
    rolled
        Distance rolled from rest [mm].
    change
        Largest change of shear over the last length of the contact, relative to the largest µp.
    """

    contact: ContactState
    creepage: Array
    spin: float
    rolled: float
    change: float

    @property
    def dissipation(self) -> float:
        """Energy dissipated per rolled distance [N], on line grids per mm [N/mm].

        It is the work of the forces over the creepages, since a steady contact stores no energy.
        """
        return float(self.contact.resultants[list(PLANAR)] @ [*self.creepage, self.spin])


def steady_rolling(
    contact: FrictionalContact,
    height: Array,
    P: float,
    *,
    creepage_x: float | None = None,
    creepage_y: float | None = None,
    spin: float | None = None,
    Qx: float | None = None,
    Qy: float | None = None,
    Mz: float | None = None,
    tolerance: float = 1e-3,
) -> RollingState:
    """Roll two bodies along x until their contact is steady.

    Along each direction either the creepage or the force is imposed, and the other follows. Where
    neither is given the creepage is 0. Forces act along positive creepages, as they act along
    shifts in :class:`ContactLoad`.

    Parameters
    ----------
    contact
        Contact with friction. Its cells cause an error of first order: with 40 cells over the
        length of the contact about 1 % of the force.
    height
        Gap of the unloaded bodies ``(nx, ny)`` [mm], which moves with the contact.
    P
        Load [N], on line grids per length [N/mm].
    creepage_x, creepage_y
        Relative motions of the bodies over the rolled distance [1].
    spin
        Relative rotation about the middle of the grid over the rolled distance [rad/mm].
    Qx, Qy, Mz
        Forces [N] and moment [N mm] in place of a creepage or the spin.
    tolerance
        Change of shear over one length of the contact at which it is steady, relative to the
        largest µp.

    Raises
    ------
    InputError
        If both of a pair are given, a spin on a line grid, a contact with a hardness or a factor
        of friction, or if it reaches the border of the grid.
    RollingError
        If a contact problem does not converge, or the contact is not steady after 20 of its
        lengths. The exceptions of :meth:`FrictionalContact.advance` may be raised as well.

    Examples
    --------
    A steel cylinder that rolls with traction, compared with Carter:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, Material
    >>> from sa_solver import steady_rolling
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.line_contact(1.0, 64)
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), friction=0.3)
    >>> hertz = HertzCylinder(200.0, 50.0, contact.half_space.pair.contact_modulus)
    >>> rolling = steady_rolling(contact, hertz.gap(grid.x), P=200.0, Qx=30.0)
    >>> carter = 0.3 * hertz.half_width / 50.0 * (1.0 - np.sqrt(1.0 - 30.0 / 60.0))
    >>> print(f"creepage {rolling.creepage[0]:.2e}, Carter {carter:.2e}")
    creepage 5.83e-04, Carter 5.84e-04
    """
    checks.number("P", P, above=0.0)
    tolerance = checks.number("tolerance", tolerance, above=0.0)
    if contact.hardness is not None or contact.factor is not None:
        raise InputError(
            "surfaces that roll have no hardness and one coefficient of friction: give no factor"
        )
    rates = {"creepage_x": creepage_x, "creepage_y": creepage_y, "spin": spin}
    pitch = contact.grid.pitch[0]
    step = _one_cell(P, pitch, rates, {"Qx": Qx, "Qy": Qy, "Mz": Mz})
    if contact.grid.line and (step.values[5] or not step.motion[5]):
        raise InputError("a line contact has no spin: leave out spin and Mz, or take a grid")
    state = _checked(contact.advance(contact.unloaded_state(height), height, ContactLoad(P=P)))
    length = int(np.count_nonzero(state.pressure.any(axis=1)))
    limit = contact.friction * float(state.pressure.max()) or 1.0
    shears, change = deque([state.shear], maxlen=length + 1), np.inf
    for rolled in range(1, MOST_LENGTHS * length + 1):
        before = state
        load = ContactLoad(step.values + np.where(step.motion, before.rigid, 0.0), step.motion)
        start = ContactStart(before.pressed, before.shear, before.slipping, None, before.traction)
        state = _checked(contact.advance(_rolled(before), height, load, start))
        shears.append(state.shear)
        if rolled > length:
            change = float(np.abs(shears[-1] - shears[0]).max()) / limit
        if change <= tolerance:
            moved = (state.rigid - before.rigid)[list(PLANAR)] / pitch
            return RollingState(state, moved[:2], float(moved[2]), rolled * pitch, change)
    raise RollingError(
        f"the contact is not steady after it has rolled {MOST_LENGTHS} of its lengths: shear "
        f"still changes by {change:.1e} of the largest µp over a length; loosen the tolerance, or "
        "tighten that of the contact"
    )


def _one_cell(
    P: float, pitch: float, rates: dict[str, float | None], forces: dict[str, float | None]
) -> ContactLoad:
    """Return the load of rolling by one cell, with motions since the cell before."""
    entries: dict[str, Any] = {}
    for shift, (rate_name, rate), (force_name, force) in zip(
        ("shift_x", "shift_y", "twist"), rates.items(), forces.items(), strict=True
    ):
        if rate is not None and force is not None:
            raise InputError(
                f"both {rate_name} and {force_name} are given: the other follows from one"
            )
        if force is None:
            entries[shift] = pitch * checks.number(rate_name, rate or 0.0)
        else:
            entries[force_name] = checks.number(force_name, force)
    return ContactLoad(P=P, **entries)


def _checked(state: ContactState) -> ContactState:
    if not state.converged:
        raise RollingError(state.message)
    if state.border_load > 0.0:
        raise InputError(f"a contact that rolls must not reach the border: {state.message}")
    return state


def _rolled(state: ContactState) -> ContactState:
    """Return a state whose tractions and displacements lie on the grid moved by one cell along x.

    The next increment starts from nothing else. The surfaces that enter are free of tractions.
    Their displacement is taken as that of their neighbours: it does not matter before they come
    into contact.
    """

    def moved(field: Array) -> Array:
        return np.concatenate([field[..., 1:, :], field[..., -1:, :]], axis=-2)

    return replace(state, traction=moved(state.traction), displacement=moved(state.displacement))
