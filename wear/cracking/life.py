"""Parameters of fretting crack initiation from one closed cycle, mapped over points.

Ruiz's parameters combine friction work with the tension along the surface. Critical-plane
parameters are the largest value over all planes through a point:

    Findley                 max over planes of  τ_a + k σ_n,max
    Smith, Watson, Topper   max over planes of  σ_n,max ε_a      (σ_n,max > 0)

with the shear amplitude τ_a, the largest normal stress σ_n,max and the amplitude ε_a of the normal
strain. τ_a is the radius of the smallest circle around the path of the shear stress vector on the
plane. Unlike the ranges of components it does not depend on axes within the plane. Half the longest
chord, the common substitute, is up to 13 % smaller where the path is a triangle (Jung's theorem),
and the same where it is a line or an ellipse.

Stress histories ``(t, 6, ...)`` hold the states of one closed cycle, in any order, with the
components xx, yy, zz, xy, yz, zx, tension positive [MPa].

Source: Ruiz, Boddington & Chen 1984, Exp. Mech. 24, 208, doi:10.1007/BF02323167; Findley 1959, J.
Eng. Ind. 81, 301, doi:10.1115/1.4008327; Smith, Watson & Topper 1970, J. Mater. 5, 767; Socie 1987,
J. Eng. Mater. Technol. 109, 293 (on planes); Papadopoulos 1998, Fatigue Fract. Eng. Mater. Struct.
21, 269 (definitions of the shear amplitude).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.half_space.subsurface_influence import XX, XY, YY
from sa_solver.types import Array, Material
from wear.cracking.smallest_circle import smallest_circle

CHUNK = 4096
"""Number of points searched at once, so that their stress histories stay in the cache."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Rotation from one sample of a sphere to the next that distributes samples evenly (Fibonacci
lattice).
"""

DIRECTIONS = 6
"""Number of neighbours around a plane that a refinement tries."""

FIRST_STEP = 0.6
"""First step of a refinement, over the spacing of the samples."""

AWAY = np.radians(30.0)
"""Angle from the best plane beyond which another plane is a rival and not a neighbour."""


class StressHistoryError(InputError):
    """A stress history, or a parameter of fatigue, is invalid."""


@dataclass(frozen=True)
class Ruiz:
    """Ruiz's parameters over the contact.

    ``work`` ``(nx, ny)`` is the friction work of a cycle per area [N/mm], ``tension`` ``(nx, ny)``
    the largest tension along the surface over the cycle [MPa], 0 where there is none.
    """

    work: Array
    tension: Array

    @property
    def friction_parameter(self) -> Array:
        """Friction parameter F1 = τ δ [N/mm]; the work of a cycle is 4 τ δ."""
        return 0.25 * self.work

    @property
    def cracking_parameter(self) -> Array:
        """Cracking parameter F2 = κ = σ_T τ δ [N²/mm³]."""
        return self.tension * self.friction_parameter


def ruiz(stress: Array, work: Array) -> Ruiz:
    """Return Ruiz's parameters of a surface.

    The tension is the largest principal stress in the plane of the surface.

    Parameters
    ----------
    stress
        Stress history at the surface of one body, bulk stress included ``(t, 6, nx, ny)`` [MPa].
    work
        Friction work per area in a mean cycle ``(nx, ny)`` [N/mm].

    Examples
    --------
    A point under a tension of 200 MPa where friction dissipates 0.4 N/mm per cycle:

    >>> import numpy as np
    >>> from wear import ruiz
    >>> stress = np.zeros((2, 6, 1, 1))
    >>> stress[:, 0, 0, 0] = 200.0, -50.0
    >>> parameters = ruiz(stress, np.full((1, 1), 0.4))
    >>> print(parameters.friction_parameter[0, 0], parameters.cracking_parameter[0, 0])
    0.1 20.0
    """
    stress = _checked(stress)
    work = checks.array("work", work, stress.shape[2:])
    principal = tension_along(*(stress[:, component] for component in (XX, YY, XY)))
    return Ruiz(work, np.maximum(0.0, principal.max(axis=0)))


def tension_along(xx: Array, yy: Array, xy: Array) -> Array:
    """Return the largest principal stress in the plane of the surface."""
    principal: Array = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
    return principal


@dataclass(frozen=True)
class PlaneSearch:
    """Settings of the search for the critical plane.

    ``planes`` normals sample half the sphere evenly (Fibonacci lattice). Each of the
    ``refinements`` tries six neighbours of the best plane, first at 0.6 of the spacing and at half
    the step where no neighbour was better. The same is done around the best plane that is 30° or
    more away from the result of the first search. Use the defaults unless an error of 2 % matters.
    Parameters were too small by the following amounts on average, in the worst hundredth, and at
    most, on 1500 histories of 8 random states, compared with at least 3000 planes and 12
    refinements:

        planes, refinements    Findley, k = 0.3         Smith, Watson, Topper
        100, 0                 1.0 %, 2.9 %, 4.1 %      2.8 %, 7.5 %, 9.9 %
        100, 3                 0.1 %, 0.7 %, 1.9 %      0.2 %, 1.4 %, 2.3 %
        100, 6                 0.02 %, 0.3 %, 1.9 %     0.04 %, 0.3 %, 1.9 %
        200, 6                 0.01 %, 0.06 %, 0.7 %    0.02 %, 0.09 %, 1.4 %

    On 1500 random proportional histories about a random mean the largest errors were 1.4 % and
    0.5 % with 100, 6; at the surface of a sphere sheared in partial slip the largest error was
    0.4 % (Findley).
    """

    planes: int = 100
    refinements: int = 6

    def __post_init__(self) -> None:
        if self.planes < 1 or self.refinements < 0:
            raise StressHistoryError(
                f"a search has {self.planes} planes and {self.refinements} refinements: give at "
                "least 1 and 0"
            )

    @property
    def normals(self) -> Array:
        """Unit normals ``(planes, 3)``."""
        k = np.arange(self.planes, dtype=np.float64)
        z = (k + 0.5) / self.planes
        r = np.sqrt(1.0 - z**2)
        return np.stack([r * np.cos(GOLDEN_ANGLE * k), r * np.sin(GOLDEN_ANGLE * k), z], axis=1)

    @property
    def spacing(self) -> float:
        """Angle between neighbouring normals [rad]."""
        return float(np.sqrt(2.0 * np.pi / self.planes))


@dataclass(frozen=True)
class CriticalPlane:
    """The critical plane at every point.

    Parameters
    ----------
    value
        Value of the parameter ``(...)`` [MPa].
    normal
        Unit normal ``(3, ...)``.
    amplitude
        Amplitude on that plane ``(...)``: of shear stress [MPa] (Findley), or of normal strain
        (Smith, Watson and Topper).
    normal_stress
        Largest normal stress on that plane ``(...)`` [MPa].
    """

    value: Array
    normal: Array
    amplitude: Array
    normal_stress: Array


DEFAULT_SEARCH = PlaneSearch()

Tried = tuple[Array, Array, Array]
"""Value, amplitude and normal stress of a plane at each point, each ``(n,)``."""

PlaneParameter = Callable[[Array, Array, Array], Tried]
"""Function of stress ``(6, t, n)``, normals ``(3,)`` or ``(3, n)``, and the values to exceed
``(n,)``. Planes that cannot exceed them may have the value -inf.
"""


def findley(
    stress: Array, sensitivity: float, search: PlaneSearch = DEFAULT_SEARCH
) -> CriticalPlane:
    """Return Findley's parameter at every point.

    Parameters
    ----------
    stress
        Stress history ``(t, 6, ...)`` [MPa].
    sensitivity
        Sensitivity k to normal stress, 0 or more.
    search
        Settings of the search for the critical plane.

    Raises
    ------
    InputError
        If k is negative, or the stress history has another shape.

    Examples
    --------
    Alternating tension of 100 MPa gives σ (k + √(1 + k²)) / 2 on the critical plane:

    >>> import numpy as np
    >>> from wear import findley
    >>> stress = np.zeros((2, 6, 1))
    >>> stress[:, 0] = [[100.0], [-100.0]]
    >>> worst = findley(stress, sensitivity=0.3)
    >>> print(f"{worst.value[0]:.1f} MPa of {50.0 * (0.3 + np.sqrt(1.0 + 0.3**2)):.1f}")
    67.2 MPa of 67.2
    """
    if not 0.0 <= sensitivity < np.inf:
        raise StressHistoryError(f"the sensitivity k is {sensitivity:g}: it must be 0 or more")

    def parameter(stress: Array, normal: Array, to_beat: Array) -> Tried:
        first, second = (_resolved(stress, normal, tangent) for tangent in _tangents(normal))
        peak = _resolved(stress, normal, normal).max(axis=0)
        # A circle around the middle of both ranges is an upper bound of the smallest circle.
        bound = np.hypot(first - _middle(first), second - _middle(second)).max(axis=0)
        worth = np.flatnonzero(bound + sensitivity * peak > to_beat)
        amplitude, value = np.zeros_like(peak), np.full_like(peak, -np.inf)
        amplitude[worth] = smallest_circle(first[:, worth], second[:, worth])
        value[worth] = amplitude[worth] + sensitivity * peak[worth]
        return value, amplitude, peak

    return _search(stress, parameter, search)


def smith_watson_topper(
    stress: Array, material: Material, search: PlaneSearch = DEFAULT_SEARCH
) -> CriticalPlane:
    """Return the parameter of Smith, Watson and Topper at every point, with elastic strains.

    It is 0 where no plane is ever under tension.

    Parameters
    ----------
    stress
        Stress history ``(t, 6, ...)`` [MPa].
    material
        Elastic constants.
    search
        Settings of the search for the critical plane.

    Raises
    ------
    InputError
        If the stress history has another shape.

    Examples
    --------
    Alternating tension of 100 MPa gives σ² / E on the plane across it:

    >>> import numpy as np
    >>> from sa_solver import Material
    >>> from wear import smith_watson_topper
    >>> stress = np.zeros((2, 6, 1))
    >>> stress[:, 0] = [[100.0], [-100.0]]
    >>> worst = smith_watson_topper(stress, Material(young=115e3, poisson=0.29))
    >>> print(f"{worst.value[0]:.4f} MPa of {100.0**2 / 115e3:.4f}")
    0.0870 MPa of 0.0870
    """

    def parameter(stress: Array, normal: Array, to_beat: Array) -> Tried:
        along, trace = _resolved(stress, normal, normal), stress[:3].sum(axis=0)
        strain = ((1.0 + material.poisson) * along - material.poisson * trace) / material.young
        amplitude, peak = 0.5 * np.ptp(strain, axis=0), along.max(axis=0)
        return np.maximum(0.0, peak) * amplitude, amplitude, peak

    return _search(stress, parameter, search)


def _checked(stress: Array) -> Array:
    """Return the stress as a checked array."""
    shape = np.shape(stress)
    if len(shape) < 2 or shape[1] != 6 or shape[0] == 0:
        raise StressHistoryError(f"the stress history has the shape {shape}: give (t, 6, ...)")
    return checks.array("stresses", stress, shape, error=StressHistoryError, order="K")


def _search(stress: Array, parameter: PlaneParameter, search: PlaneSearch) -> CriticalPlane:
    """Return the plane with the largest value of ``parameter`` at every point."""
    stress = _checked(stress)
    shape = stress.shape[2:]
    points = np.moveaxis(stress.reshape(len(stress), 6, -1), 0, 1)
    best = np.empty((6, points.shape[2]))
    for start in range(0, points.shape[2], CHUNK):
        part = slice(start, start + CHUNK)
        best[:, part] = _search_part(np.ascontiguousarray(points[:, :, part]), parameter, search)
    value, amplitude, peak = (values.reshape(shape) for values in best[:3])
    return CriticalPlane(value, best[3:].reshape(3, *shape), amplitude, peak)


def _search_part(stress: Array, parameter: PlaneParameter, search: PlaneSearch) -> Array:
    """Return value, amplitude, normal stress and normal ``(6, n)`` at the points of ``(6, t, n)``.

    A sample next to the critical plane may have a smaller value than a sample next to another plane
    that is nearly as bad. The best plane away from the first one found is therefore refined too.
    """
    best = _climb(_Planes(stress, parameter), search, None)
    rival = _climb(_Planes(stress, parameter), search, best[3:])
    return np.where(rival[0] > best[0], rival, best)


def _climb(planes: _Planes, search: PlaneSearch, away_from: Array | None) -> Array:
    """Return the best sample after refinements.

    The step of a refinement is halved wherever no neighbour was better.
    """
    for normal in search.normals:
        planes.attempt(normal, away_from)
    step = np.full(planes.best.shape[1], FIRST_STEP * search.spacing)
    for _ in range(search.refinements):
        before, centre = planes.best[0].copy(), planes.best[3:].copy()
        first, second = _tangents(centre)
        for angle in 2.0 * np.pi / DIRECTIONS * np.arange(DIRECTIONS):
            aside = np.cos(angle) * first + np.sin(angle) * second
            planes.attempt(np.cos(step) * centre + np.sin(step) * aside)
        step[planes.best[0] == before] *= 0.5
    return planes.best


class _Planes:
    """The best planes so far at the points of ``stress`` ``(6, t, n)``.

    ``best`` ``(6, n)`` holds value, amplitude, normal stress and normal.
    """

    def __init__(self, stress: Array, parameter: PlaneParameter) -> None:
        self.best = np.zeros((6, stress.shape[2]))
        self.best[0], self.best[5] = -np.inf, 1.0
        self._stress, self._parameter = stress, parameter

    def attempt(self, normal: Array, away_from: Array | None = None) -> None:
        """Try a plane ``(3,)``, or one per point ``(3, n)``.

        Planes near ``away_from`` ``(3, n)`` are skipped.
        """
        to_beat = self.best[0]
        if away_from is not None:
            near = np.abs(np.tensordot(normal, away_from, 1)) > np.cos(AWAY)
            to_beat = np.where(near, np.inf, to_beat)
        tried = self._parameter(self._stress, normal, to_beat)
        better = tried[0] > to_beat
        for best, new in zip(self.best, (*tried, *normal), strict=True):
            np.copyto(best, new, where=better)


def _resolved(stress: Array, normal: Array, direction: Array) -> Array:
    """Return the component along ``direction`` of the stress vector on a plane ``(t, n)``.

    ``stress`` is ``(6, t, n)``; ``normal`` and ``direction`` are ``(3,)`` or, one per point, ``(3,
    n)``.
    """
    (a, b, c), (d, e, f) = normal, direction
    weights = np.stack([a * d, b * e, c * f, a * e + b * d, b * f + c * e, c * d + a * f])
    if weights.ndim == 1:
        return np.tensordot(weights, stress, 1)
    resolved: Array = np.einsum("cn,ctn->tn", weights, stress)
    return resolved


def _tangents(normal: Array) -> tuple[Array, Array]:
    """Return two unit vectors that form a frame with ``normal``, all ``(3, ...)``.

    Source: Duff et al. 2017, J. Comput. Graph. Tech. 6 (1), 1.
    """
    x, y, z = normal
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x**2 * a, sign * b, -sign * x])
    return first, np.stack([b, sign + y**2 * a, -y])


def _middle(path: Array) -> Array:
    """Return the middle between the extremes of a path ``(t, n)``."""
    middle: Array = 0.5 * (path.max(axis=0) + path.min(axis=0))
    return middle
