"""Increments of a frictional contact: normal and tangential problems, from state to state.

For similar bodies the normal problem does not depend on shear and is solved first; its µp is the
limit of the tangential problem. For dissimilar bodies both are solved together. Where the load
needs more shear than friction can carry, the whole contact slides. The sliding motion then follows
from the energies in the load history (:mod:`sa_solver.tangential.gross_slip`).

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914; Gallego 2007,
eqs 6-8.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TypeVar, get_args

import numpy as np

from sa_solver import checks
from sa_solver.contact_state import ContactLoad, ContactStart, ContactState
from sa_solver.cycles.increments import dissipated, of_nearest
from sa_solver.dissimilar.contact import CoupledContact, CoupledContactState
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, checked_heights
from sa_solver.normal.state import NormalStart, NormalState
from sa_solver.rigid_modes import NORMAL, PLANAR
from sa_solver.tangential.ciavarella_jaeger import first_loading
from sa_solver.tangential.contact import (
    FrictionLimitError,
    TangentialContact,
    TangentialState,
    planar_modes,
)
from sa_solver.tangential.gross_slip import SlidingRule, gross_slip, slides, sliding_direction
from sa_solver.types import Array, Mask

FrictionFactor = Callable[[Array], Array]
"""Function from the pressure to the factors of the coefficient of friction, both ``(nx, ny)``."""

TURNING = (3, 4, 5)
"""Indices of Mx, My and Mz among the six resultants, and of their motions."""

_State = TypeVar("_State", TangentialState, CoupledContactState)


class FrictionError(InputError):
    """Friction coefficient that is not a number of 0 or more."""


class FrictionalContact:
    """Contact with friction on one grid, for similar and dissimilar bodies.

    Examples
    --------
    A cylinder that is pressed, sheared and released does not recover all of its slip:

    >>> import numpy as np
    >>> from sa_solver import ContactLoad, ElasticPair, FrictionalContact, Grid, HalfSpace, Material
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.line_contact(1.0, 128)
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), friction=0.5)
    >>> height = grid.x**2 / 100.0
    >>> state = contact.unloaded_state(height)
    >>> for Qx in (0.0, 60.0, 0.0):
    ...     state = contact.advance(state, height, ContactLoad(np.array([200.0, Qx, 0, 0, 0, 0])))
    ...     stuck, lost = 0.5 * state.sticking.sum() * grid.pitch[0], state.energy[0]
    ...     print(f"Qx {Qx:2.0f} N/mm: sticks over ±{stuck:.2f} mm, {1e3 * lost:.2f} µJ/mm lost")
    Qx  0 N/mm: sticks over ±0.34 mm, 0.00 µJ/mm lost
    Qx 60 N/mm: sticks over ±0.21 mm, 1.48 µJ/mm lost
    Qx  0 N/mm: sticks over ±0.28 mm, 0.29 µJ/mm lost
    """

    def __init__(
        self,
        half_space: HalfSpace,
        friction: float,
        tolerance: float = 1e-8,
        sliding: SlidingRule = "force",
        hardness: float | None = None,
        factor: FrictionFactor | None = None,
    ) -> None:
        """Prepare the solvers for ``half_space`` and Coulomb's coefficient ``friction`` µ.

        ``sliding`` selects how the direction of gross slip is found: see
        :mod:`sa_solver.tangential.gross_slip`. The ``hardness`` [MPa] bounds the pressure of
        similar bodies: see :mod:`sa_solver.normal.hardness`. Where friction depends on the place or
        the pressure, ``factor`` returns the factors of µ ``(nx, ny)`` for a pressure ``(nx, ny)``.

        Raises FrictionError unless µ is finite and >= 0, and InputError for a hardness or a factor
        of dissimilar bodies.
        """
        friction = checks.number("friction", friction, least=0.0, error=FrictionError)
        tolerance = checks.number("tolerance", tolerance, above=0.0)
        checks.choice("sliding", sliding, get_args(SlidingRule))
        self.half_space, self.grid = half_space, half_space.grid
        self.friction, self.tolerance, self._sliding = friction, tolerance, sliding
        self._modes = planar_modes(half_space)
        if hardness is not None:
            hardness = checks.number("hardness", hardness, above=0.0)
            if not half_space.pair.similar:
                raise InputError(
                    "the yield of dissimilar bodies is not computed: give no hardness, or bodies "
                    "of equal (1 - 2ν)/G"
                )
        if factor is not None and not half_space.pair.similar:
            raise InputError(
                "friction that depends on place or pressure is not computed for dissimilar bodies: "
                "give one coefficient, or bodies of equal (1 - 2ν)/G"
            )
        self.hardness, self.factor = hardness, factor

    def limit(self, pressure: Array) -> Array:
        """Return the largest shear µp ``(nx, ny)`` [MPa] under a ``pressure`` [MPa].

        Raises FrictionError for factors that are negative, not finite or of another shape.
        """
        limit = self.friction * pressure
        if self.factor is None:
            return limit
        factors = checks.array(
            "factors of friction", self.factor(pressure), self.grid.shape, error=FrictionError
        )
        if factors.min() < 0.0:
            raise FrictionError(f"a factor of friction is {factors.min():g}: give 0 or more")
        return np.asarray(limit * factors)

    def unloaded_state(self, height: Array, along: Array | None = None) -> ContactState:
        """Return the state of the unloaded bodies, with the gap ``height`` ``(nx, ny)`` [mm].

        Their surfaces may have moved ``along`` each other: see :class:`ContactLoad`.
        """
        height, field = checked_heights(height, self.grid), np.zeros((3, *self.grid.shape))
        if along is not None:
            along = checks.array("motions along", along, field[:2].shape)
        return ContactState(
            traction=field,
            displacement=field,
            slip=field[:2],
            gap=height,
            sticking=np.zeros(self.grid.shape, dtype=bool),
            resultants=np.zeros(6),
            rigid=np.zeros(6),
            energy=np.zeros(2),
            converged=True,
            cell_area=self.grid.cell_area,
            along=along,
            flattening=None if self.hardness is None else np.zeros(self.grid.shape),
        )

    def advance(
        self,
        before: ContactState,
        height: Array,
        load: ContactLoad,
        start: ContactStart | None = None,
    ) -> ContactState:
        """Return the state under ``load`` that follows the state ``before``.

        ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies, infinite or masked where a
        body has no surface. ``start`` is the initial guess, by default the state ``before``. For
        impossible data the solvers raise NormalContactError or TangentialContactError.
        """
        height = checked_heights(height, self.grid)
        if self.half_space.periodic:
            _check_periodic(load)
        guess = start or ContactStart()
        if not self.half_space.pair.similar:
            return self._advance_dissimilar(before, height, load, guess)
        if before.flattening is not None:
            height = height + before.flattening
        normal = self._press(before, height, load, guess.normal)
        if self.factor is not None and load.energy is not None:
            raise InputError(
                "sliding by energy needs one coefficient of friction: give no factor, or no energy"
            )
        limit = self.limit(normal.pressure)
        offset, area = self.offset(before, load), self.grid.cell_area
        sliding = slides(limit, load, self._modes, self.grid.cell_area)
        if sliding:
            tangential, creeps = self._slide_similar(before, limit, offset, load, guess)
            carried = self._carry_force(before, limit, offset, load) if creeps else None
            tangential, sliding = (tangential, True) if carried is None else (carried, False)
        elif self.two_normal_problems(before, load) and abs(load.values[1]) < limit.sum() * area:
            flattened = height if normal.flattening is None else height + normal.flattening
            tangential = first_loading(
                self.normal, flattened, normal, self.friction, load.values[1], self.tolerance
            )
        else:
            begin = ContactStart(shear=before.shear) if guess.shear is None else guess
            tangential = self._shear(before, limit, offset, load, begin)
        slip = self._slip(before, normal.pressure > 0.0, offset, tangential, tangential.motion)
        return self._state(before, load, normal, replace(tangential, slip=slip), sliding)

    def two_normal_problems(self, before: ContactState, load: ContactLoad) -> bool:
        """Return whether two normal problems give the shear: first loading of a line contact.

        They need one coefficient, and bodies that resist shear as pressure: layers do not.
        """
        along_x = load.values[1] != 0.0 and load.values[2] == 0.0
        by_force = not any(load.motion[k] for k in (0, 1, 2, 4))
        moved = load.along is not None or before.along is not None
        fresh = not before.shear.any() and load.strain == before.strain and not moved
        alike = self.grid.line and not self.half_space.pair.layered and self.factor is None
        return alike and self.friction > 0.0 and along_x and by_force and fresh

    def offset(self, before: ContactState, load: ContactLoad) -> Array:
        """Return the slip ``(2, nx, ny)`` [mm] of the increment but for new tractions and motions.

        It holds the elastic displacement of the state ``before``, with the opposite sign, and the
        imposed relative motion of the unloaded surfaces.
        """
        offset = -before.displacement[:2]
        offset[0] += (load.strain - before.strain) * self.grid.x
        if load.along is not None:
            offset += load.along
        if before.along is not None:
            offset -= before.along
        return offset

    # -- similar bodies -----------------------------------------------------------------------
    @cached_property
    def normal(self) -> NormalContact:
        """Solver of the normal problem of similar bodies."""
        return NormalContact(self.half_space)

    @cached_property
    def tangential(self) -> TangentialContact:
        """Solver of the tangential problem of similar bodies."""
        return TangentialContact(self.half_space)

    def _press(
        self, before: ContactState, height: Array, load: ContactLoad, start: NormalStart | None
    ) -> NormalState:
        P, Mx, My, approach, tilt_x, tilt_y = (
            float(load.values[k]) if load.motion[k] is moved else None
            for moved in (False, True)
            for k in NORMAL
        )
        if self.grid.line:
            Mx = tilt_x = None
        if self.half_space.periodic:
            Mx = My = tilt_x = tilt_y = None
        if start is None and before.pressure.any():
            start = before.pressed
        return self.normal.solve(
            height,
            P,
            Mx,
            My,
            approach=approach,
            tilt_x=tilt_x,
            tilt_y=tilt_y,
            tolerance=self.tolerance,
            start=start,
            hardness=self.hardness,
        )

    def _shear(
        self,
        before: ContactState,
        limit: Array,
        offset: Array,
        load: ContactLoad,
        start: ContactStart,
    ) -> TangentialState:
        names = ("Qx", "Qy", "Mz"), ("shift_x", "shift_y", "twist")
        imposed: dict[str, float] = {}
        for place, k in enumerate(PLANAR[k] for k in self._modes.free):
            value = load.values[k] - (before.rigid[k] if load.motion[k] else 0.0)
            imposed[names[load.motion[k]][place]] = float(value)
        return self.tangential.solve(
            limit,
            offset,
            **imposed,
            tolerance=self.tolerance,
            start=start.shear,
            slipping=start.slipping,
        )

    def _carry_force(
        self, before: ContactState, limit: Array, offset: Array, load: ContactLoad
    ) -> TangentialState | None:
        """Return the state under the imposed shear force, or None if friction cannot carry it.

        Bodies that creep towards sliding dissipate less than sliding bodies would. The state of the
        increment then follows from its force, not from its energy.
        """
        try:
            state = self._shear(before, limit, offset, load, ContactStart(shear=before.shear))
        except FrictionLimitError:
            return None
        return state if state.converged else None

    def _slide_similar(
        self,
        before: ContactState,
        limit: Array,
        offset: Array,
        load: ContactLoad,
        guess: ContactStart,
    ) -> tuple[TangentialState, bool]:
        """Return similar bodies in gross slip by the energy of ``load``, and whether they creep."""
        shear = limit * sliding_direction(load.values[1:3])[:, None, None]
        twist = {"twist": 0.0} if len(self._modes.free) == len(PLANAR) else {}
        begin = (shear, None) if guess.shear is None else (guess.shear, guess.slipping)

        def solve(shift: Array, tolerance: float, last: TangentialState | None) -> TangentialState:
            x, y = map(float, shift)
            start, slipping = begin if last is None else (last.shear, None)
            return self.tangential.solve(
                limit,
                offset,
                shift_x=x,
                shift_y=y,
                **twist,
                tolerance=tolerance,
                start=start,
                slipping=slipping,
            )

        def slip_of(state: TangentialState) -> Array:
            return self._slip(before, limit > 0.0, offset, state, state.motion)

        near = guess.motion_from(before)
        return self._slide_by_energy(
            solve, lambda state: limit, slip_of, before, shear, offset, load, near
        )

    def _slide_by_energy(
        self,
        solve: Callable[[Array, float, _State | None], _State],
        limit_of: Callable[[_State], Array],
        slip_of: Callable[[_State], Array],
        before: ContactState,
        shear: Array,
        offset: Array,
        load: ContactLoad,
        near: Array | None = None,
    ) -> tuple[_State, bool]:
        """Return the state in gross slip by the energy of ``load``, and whether it creeps.

        ``solve`` returns the state after a motion (Δδx, Δδy), to a tolerance, from the last state.
        ``limit_of`` returns its µp and ``slip_of`` its slip. ``shear`` ``(2, nx, ny)`` is an
        estimate of the shear in sliding, and ``near`` an initial guess of the motion, if known.
        """
        assert load.energy is not None
        last: deque[_State] = deque(maxlen=1)
        convolutions = 0

        def slide(shift: Array, tolerance: float) -> tuple[Array, Array]:
            nonlocal convolutions
            state = solve(shift, tolerance, last[0] if last else None)
            last.append(state)
            convolutions += state.convolutions
            force = state.shear.sum(axis=(1, 2)) * self.grid.cell_area
            return force, self._dissipated(before, limit_of(state), slip_of(state))

        stored = float(np.vdot(shear, self.half_space.shear(shear) + offset)) * self.grid.cell_area
        force = load.values[1:3]
        carried = 0.5 * self.friction * float(before.resultants[0] + load.values[0])
        slip = gross_slip(
            *(slide, carried, load.energy, force, self.tolerance, self._sliding, stored, near)
        )
        found = last[0]
        failure = slip.message if found.converged else ""
        converged, message = found.converged and not failure, failure or found.message
        state = replace(found, convolutions=convolutions, converged=converged, message=message)
        return state, slip.creeps

    def _state(
        self,
        before: ContactState,
        load: ContactLoad,
        normal: NormalState,
        tangential: TangentialState,
        sliding: bool,
    ) -> ContactState:

        limit, flattening = self.limit(normal.pressure), before.flattening
        if flattening is not None and normal.flattening is not None:
            flattening = flattening + normal.flattening
        rigid = np.array([normal.approach, 0.0, 0.0, normal.tilt_x, normal.tilt_y, 0.0])
        rigid[list(PLANAR)] = before.rigid[list(PLANAR)] + tangential.motion
        resultants = np.array([normal.P, 0.0, 0.0, normal.Mx, normal.My, 0.0])
        resultants[list(PLANAR)] = tangential.Qx, tangential.Qy, tangential.Mz
        if self.half_space.periodic:
            resultants[3:] = 0.0  # moments would depend on the middle that is chosen
        messages = [message for message in (normal.message, tangential.message) if message]
        return ContactState(
            traction=np.stack([*tangential.shear, normal.pressure]),
            displacement=np.stack([*tangential.displacement, normal.displacement]),
            slip=tangential.slip,
            gap=normal.gap,
            sticking=tangential.sticking,
            resultants=resultants,
            rigid=rigid,
            strain=load.strain,
            along=load.along,
            energy=self._dissipated(before, limit, tangential.slip),
            sliding=sliding,
            residual=max(normal.residuals.largest, tangential.residuals.largest),
            converged=normal.converged and tangential.converged,
            message="; ".join(messages),
            convolutions=normal.convolutions + tangential.convolutions,
            border_load=normal.border_load,
            cell_area=self.grid.cell_area,
            flattening=flattening,
            limit=None if self.factor is None else limit,
        )

    def _slip(
        self,
        before: ContactState,
        pressed: Mask,
        offset: Array,
        state: TangentialState | CoupledContactState,
        motion: Array,
    ) -> Array:
        """Return the slip ``(2, nx, ny)`` [mm] of an increment, also in cells that separate in it.

        ``pressed`` ``(nx, ny)`` are the cells in contact at its end; ``motion`` (3,) is (Δδx, Δδy,
        Δφz). Surfaces of cells that separate go on to move without friction. Their slip is
        therefore limited to that of the nearest cell in contact. Where all cells separate, the slip
        before separation is unknown and taken as 0.
        """
        slip = np.where(pressed, state.slip, 0.0)
        parting = (before.pressure > 0.0) & ~pressed
        if not (pressed.any() and parting.any()):
            return slip
        moved, modes = state.displacement[:2] + offset, self._modes
        modes.add_motion(moved, -motion[: len(modes.free)] * modes.lengths)
        nearest, size = of_nearest(np.hypot(*slip), pressed, self.grid.pitch), np.hypot(*moved)
        share = np.divide(nearest, size, out=np.ones_like(size), where=size > nearest)
        return np.where(parting, share * moved, slip)

    def _dissipated(self, before: ContactState, limit: Array, slip: Array) -> Array:
        """Return the energy (2,) [N mm] dissipated along x and y; ``limit`` is µp at the end."""
        mean = 0.5 * (self.limit(before.pressure) + limit)
        work = dissipated(mean.ravel(), slip.reshape(2, -1))
        return np.asarray(work.sum(axis=1) * self.grid.cell_area)

    # -- dissimilar bodies --------------------------------------------------------------------
    @cached_property
    def _coupled(self) -> CoupledContact:
        return CoupledContact(self.half_space, self.friction)

    def _advance_dissimilar(
        self, before: ContactState, height: Array, load: ContactLoad, guess: ContactStart
    ) -> ContactState:
        offset = self.offset(before, load)
        start = before.traction if guess.together is None else guess.together
        sliding = False
        if load.energy is not None:
            # Shear hardly changes the pressure, so the frictionless pressure gives the limit.
            unsheared = NormalStart(before.pressure, self.half_space.normal(before.pressure))
            limit = self.friction * self._press(before, height, load, unsheared).pressure
            sliding = slides(limit, load, self._modes, self.grid.cell_area)
        if sliding:
            near = guess.motion_from(before)
            state = self._slide_dissimilar(before, height, offset, load, limit, start, near)
        else:
            values = load.values.copy()
            for k in PLANAR:
                values[k] -= before.rigid[k] if load.motion[k] else 0.0
            state = self._coupled.solve(
                height, offset, values, load.motion, tolerance=self.tolerance, start=start
            )
        rigid = state.rigid.copy()
        rigid[list(PLANAR)] += before.rigid[list(PLANAR)]
        pressed = state.pressure > 0.0
        limit = self.friction * state.pressure
        slip = self._slip(before, pressed, offset, state, state.rigid[list(PLANAR)])
        return ContactState(
            traction=state.traction,
            displacement=state.displacement,
            slip=slip,
            gap=state.gap,
            sticking=state.sticking,
            resultants=state.resultants,
            rigid=rigid,
            strain=load.strain,
            along=load.along,
            energy=self._dissipated(before, limit, slip),
            sliding=sliding,
            residual=state.residuals.largest,
            converged=state.converged,
            message=state.message,
            convolutions=state.convolutions,
            border_load=state.border_load,
            cell_area=self.grid.cell_area,
        )

    def _slide_dissimilar(
        self,
        before: ContactState,
        height: Array,
        offset: Array,
        load: ContactLoad,
        limit: Array,
        start: Array,
        near: Array | None,
    ) -> CoupledContactState:
        """Return dissimilar bodies in gross slip by the energy of ``load``.

        The search begins from the tractions ``start`` and the motion ``near``, if known.
        """
        values = load.values.copy()
        values[5] = 0.0
        motion = (load.motion[0], True, True, load.motion[3], load.motion[4], not self.grid.line)
        shear = limit * sliding_direction(load.values[1:3])[:, None, None]

        def solve(
            shift: Array, tolerance: float, last: CoupledContactState | None
        ) -> CoupledContactState:
            values[1:3] = shift
            begin = start if last is None else last.traction
            return self._coupled.solve(
                height, offset, values, motion, tolerance=tolerance, start=begin
            )

        def limit_of(state: CoupledContactState) -> Array:
            return np.asarray(self.friction * state.pressure)

        def slip_of(state: CoupledContactState) -> Array:
            motion = state.rigid[list(PLANAR)]
            return self._slip(before, state.pressure > 0.0, offset, state, motion)

        return self._slide_by_energy(solve, limit_of, slip_of, before, shear, offset, load, near)[0]


def _check_periodic(load: ContactLoad) -> None:
    """Raise InputError for a load that a periodic contact cannot have."""
    if load.values[list(TURNING)].any():
        raise InputError("a periodic contact does not turn: leave out moments and rotations")
    if load.strain:
        raise InputError("a periodic contact has no bulk strain: every patch is like the next")
