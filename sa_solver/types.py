"""Types, frames and signs shared by every package.

Base units: mm, N, s, MPa, tonne (1 N mm = 1 mJ).

Signs
-----
Body 1 is the disk (or the lower, fixed body), body 2 the blade (or the upper, moving one).
An interface frame has its origin at the centre of the nominal contact face, ``z`` along the
outward normal of body 1 into body 2, ``x`` along the face in the direction in which body 2 would
slide under the load, and ``y = z × x``.

Tractions and resultants are those that body 1 exerts on body 2: pressure ``p >= 0``, shear
``q = (qx, qy)`` and, with the cell area ``S``,

    P = Σ p S          Qx, Qy = Σ q S
    Mx = Σ p y S       My = -Σ p x S       Mz = Σ (qy x - qx y) S

Rigid motions ``(δx, δy, δz, φx, φy, φz)`` are those of body 1 relative to body 2 far from the
contact, conjugate to the resultants, so that the gap is ``g = h + u_z - δz - φx y + φy x``. Slip is
the motion of body 2's surface relative to body 1's; friction opposes it, and the energy of an
increment is ``Ed = Σ µ p |Δs| S >= 0`` with the mean pressure of its ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from sa_solver import checks
from sa_solver.errors import InputError

T = TypeVar("T")
Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

ALIKE = 1e-12
"""Largest |β| of elastically similar bodies; it allows for moduli rounded in different units."""

SQUARE = 1e-6
"""Largest error of the products of a frame's axes (0 and 1): axes of six printed digits pass."""

Progress = Callable[[int, int], None]
"""Callback that receives the number of items done and the total number of items."""


def unseen(done: int, total: int) -> None:
    """Ignore the progress."""


@dataclass
class Tally:
    """Thread-safe counter that reports to ``progress`` each time one of ``total`` items is done.

    Call it once per item, from any thread. A lock makes ``progress`` receive the counts one at a
    time and in order.
    """

    progress: Progress
    total: int
    done: int = 0
    _lock: Lock = field(default_factory=Lock, init=False, repr=False, compare=False)

    def __call__(self) -> None:
        with self._lock:
            self.done += 1
            self.progress(self.done, self.total)


Tilt = Literal["free", "held"]
"""``free``: the bodies turn about x and y under the imposed moments. ``held``: they keep the tilt
that they have when unloaded and unworn, whatever moments this takes."""


@dataclass(frozen=True)
class Layer:
    """Elastic layer that is bonded to what lies below it, such as a coating.

    Parameters
    ----------
    thickness
        Thickness [mm].
    young
        Young's modulus [MPa].
    poisson
        Poisson's ratio, from 0 to 0.5.

    Raises
    ------
    InputError
        For a thickness or modulus that is infinite or not above 0, or a Poisson's ratio outside 0
        to 0.5.

    Examples
    --------
    A ball sinks deeper into steel under 50 µm of a soft coating:

    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Layer, Material, NormalContact
    >>> steel, coating = Material(210e3, 0.3), Layer(thickness=0.05, young=50e3, poisson=0.3)
    >>> coated = Material(210e3, 0.3, layers=[coating])
    >>> grid = Grid.covering((1.0, 1.0), (50, 50))
    >>> for body in (steel, coated):
    ...     contact = NormalContact(HalfSpace(grid, ElasticPair(steel, body)))
    ...     state = contact.solve((grid.x**2 + grid.y**2) / 20.0, P=50.0)
    ...     print(f"{1e3 * state.approach:.2f} um, {state.pressure.max():.0f} MPa")
    2.19 um, 1084 MPa
    2.48 um, 875 MPa
    """

    thickness: float
    young: float
    poisson: float

    def __post_init__(self) -> None:
        checks.number("thickness of a layer [mm]", self.thickness, above=0.0)
        checks.number("Young's modulus of a layer [MPa]", self.young, above=0.0)
        checks.number("Poisson's ratio of a layer", self.poisson, least=0.0, most=0.5)


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material of a body, with the layers on its surface.

    Parameters
    ----------
    young
        Young's modulus [MPa]: 210e3 for steel, not 210 or 210e9. An infinite modulus makes the
        body rigid.
    poisson
        Poisson's ratio, from 0 to 0.5.
    density
        Density [t/mm³].
    yield_stress
        Yield stress [MPa].
    expansion
        Coefficient of linear thermal expansion [1/K].
    layers
        Layers on the surface of the body, the outermost first. The other properties are those of
        the body below them. Half-spaces have layers; finite elements and wear refuse them.

    Raises
    ------
    InputError
        For a modulus or yield stress that is not above 0, a Poisson's ratio outside 0 to 0.5, a
        density below 0, or layers that are not of :class:`Layer`.

    Examples
    --------
    A steel, in MPa:

    >>> from sa_solver import Material
    >>> steel = Material(young=210e3, poisson=0.3)
    >>> print(f"G = {steel.shear_modulus:.0f} MPa, λ = {steel.lame:.0f} MPa")
    G = 80769 MPa, λ = 121154 MPa
    """

    young: float
    poisson: float
    density: float = 0.0
    yield_stress: float = np.inf
    expansion: float = 0.0
    layers: tuple[Layer, ...] = ()

    def __post_init__(self) -> None:
        checks.number("Young's modulus [MPa]", self.young, above=0.0, infinite=True)
        checks.number("Poisson's ratio", self.poisson, least=0.0, most=0.5)
        checks.number("density [t/mm³]", self.density, least=0.0)
        checks.number("yield stress [MPa]", self.yield_stress, above=0.0, infinite=True)
        checks.number("thermal expansion [1/K]", self.expansion)
        given: Any = self.layers
        if not isinstance(given, list | tuple) or not all(isinstance(n, Layer) for n in given):
            raise InputError(
                f"Material.layers is {checks.shown(given)}: give a list of Layer, outermost first"
            )
        checks.settle(self, layers=tuple(given))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / 2(1+ν) [MPa]."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def lame(self) -> float:
        """First Lamé constant λ [MPa]."""
        return self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


@dataclass(frozen=True)
class ElasticPair:
    """Elastic constants of two half-spaces in contact.

    ``body_1`` is the lower, fixed body and ``body_2`` the upper one. The relative displacement of
    their surfaces depends on four compliances [1/MPa]: ``normal`` Σ (1-ν)/G, ``shear`` Σ 1/G,
    ``poisson`` Σ ν/G and ``coupling`` ½ [(1-2ν2)/G2 - (1-2ν1)/G1], which is exactly 0 for identical
    materials. A body with an infinite Young's modulus is rigid; two rigid bodies raise InputError.

    Where a body has layers, these are the constants of the bodies below them, which decide far from
    the contact. The layers add :mod:`sa_solver.half_space.layers`.

    Examples
    --------
    Two bodies of the same material have the contact modulus E / 2 (1 - ν²), and no coupling:

    >>> from sa_solver import ElasticPair, Material
    >>> steel = Material(young=210e3, poisson=0.3)
    >>> pair = ElasticPair(steel, steel)
    >>> print(f"{pair.contact_modulus:.0f} MPa of {210e3 / 2 / (1 - 0.3**2):.0f}, {pair.similar}")
    115385 MPa of 115385, True
    >>> rubber = Material(young=5.0, poisson=0.5)
    >>> print(f"β of steel on rubber: {ElasticPair(steel, rubber).dundurs_beta:.1e}")
    β of steel on rubber: -8.3e-06
    """

    body_1: Material
    body_2: Material

    def __post_init__(self) -> None:
        if not self.normal > 0.0:
            raise InputError("two rigid bodies: give one of them a finite Young's modulus")

    @classmethod
    def from_contact_modulus(cls, contact_modulus: float, poisson: float = 0.3) -> ElasticPair:
        """Return a pair of identical bodies with the contact modulus E* [MPa] and ``poisson`` ν.

        The Young's modulus of each body is 2 (1 - ν²) E*. The pressure depends on E* alone; ν
        matters for shear and for the stress inside the bodies. Raises InputError for an E* that is
        infinite or not above 0.
        """
        checks.number("contact modulus [MPa]", contact_modulus, above=0.0)
        checks.number("Poisson's ratio", poisson, least=0.0, most=0.5)
        body = Material(2.0 * (1.0 - poisson**2) * contact_modulus, poisson)
        return cls(body, body)

    @property
    def bodies(self) -> tuple[Material, Material]:
        """Both bodies, body 1 first."""
        return self.body_1, self.body_2

    @property
    def normal(self) -> float:
        """Compliance Σ (1-ν)/G [1/MPa] of the normal displacement under pressure."""
        return sum((1.0 - m.poisson) / m.shear_modulus for m in self.bodies)

    @property
    def shear(self) -> float:
        """Compliance Σ 1/G [1/MPa] of the displacement under shear, along the shear."""
        return sum(1.0 / m.shear_modulus for m in self.bodies)

    @property
    def poisson(self) -> float:
        """Compliance Σ ν/G [1/MPa]: the effect of Poisson's ratio on the response to shear."""
        return sum(m.poisson / m.shear_modulus for m in self.bodies)

    @property
    def coupling(self) -> float:
        """Compliance ½ [(1-2ν2)/G2 - (1-2ν1)/G1] [1/MPa] that couples pressure and shear."""
        first, second = ((1.0 - 2.0 * m.poisson) / m.shear_modulus for m in self.bodies)
        return 0.5 * (second - first)

    @property
    def contact_modulus(self) -> float:
        """Contact modulus E* = 2 / Σ (1-ν)/G [MPa] (Johnson 1985, eq. 4.20)."""
        return 2.0 / self.normal

    @property
    def dundurs_beta(self) -> float:
        """Dundurs' β (1969), positive where body 2 has the larger ``(1-2ν)/G``."""
        return self.coupling / self.normal

    @property
    def layered(self) -> bool:
        """True if one of the bodies has layers."""
        return any(body.layers for body in self.bodies)

    @property
    def surface(self) -> ElasticPair:
        """Pair of the materials at the surface: the outermost layer, or the body itself."""
        return ElasticPair(*(_at_surface(body) for body in self.bodies))

    @property
    def similar(self) -> bool:
        """True if pressure and shear do not influence each other.

        Layered bodies are similar if they are the same.
        """
        if self.layered:
            first, second = ((m.young, m.poisson, m.layers) for m in self.bodies)
            return first == second
        return abs(self.dundurs_beta) <= ALIKE


def _at_surface(body: Material) -> Material:
    """Return the material at the surface of a ``body``."""
    if not body.layers:
        return body
    return Material(body.layers[0].young, body.layers[0].poisson)


@dataclass(frozen=True)
class Grid:
    """Uniform grid of rectangular cells, centred on the frame's origin.

    ``shape`` is ``(nx, ny)``, ``pitch`` is ``(dx, dy)`` in mm. Fields on the grid have that shape:
    the first index counts along x, the second along y. A ``line`` grid describes a line contact in
    plane strain: it has cells along x only, each a slice 1 mm long of a strip that is infinite
    along y, so that resultants are per mm.

    Examples
    --------
    Cell centres are symmetric about the origin of the interface:

    >>> from sa_solver import Grid
    >>> grid = Grid.covering((1.0, 0.5), (4, 2))
    >>> print(grid.pitch, grid.cell_area, grid.x.ravel())
    (0.25, 0.25) 0.0625 [-0.375 -0.125  0.125  0.375]
    >>> print(Grid.line_contact(1.0, 4))
    Grid(shape=(4, 1), pitch=(0.25, 1.0), line=True)
    """

    shape: tuple[int, int]
    pitch: tuple[float, float]
    line: bool = False

    def __post_init__(self) -> None:
        shape = tuple(checks.whole("a number of cells", n) for n in _pair("shape", self.shape))
        pitch = tuple(checks.array("pitches of a grid", self.pitch, (2,), finite=False).tolist())
        if min(shape) < 1 or not all(0.0 < length < np.inf for length in pitch):
            raise InputError(f"a grid of {shape} cells of {pitch} mm has no area: give more than 0")
        checks.settle(self, shape=shape, pitch=pitch)
        if self.line and (self.shape[1] != 1 or self.pitch[1] != 1.0):
            raise InputError("a line grid has one row of cells 1 mm long: use Grid.line_contact")

    @classmethod
    def line_contact(cls, width: float, count: int) -> Grid:
        """Return the grid of a line contact: ``count`` cells that together cover ``width`` [mm]."""
        width = checks.number("the width of a grid [mm]", width)
        return cls((count, 1), (width / max(count, 1), 1.0), line=True)

    @classmethod
    def covering(cls, size: tuple[float, float], shape: tuple[int, int]) -> Grid:
        """Return the grid of ``shape`` cells that exactly covers a rectangle of ``size`` [mm]."""
        (along_x, along_y), (nx, ny) = _pair("size", size), _pair("shape", shape)
        return cls((nx, ny), (along_x / max(nx, 1), along_y / max(ny, 1)))

    @classmethod
    def over(cls, size: tuple[float, float], shape: tuple[int, int], line: bool) -> Grid:
        """Return the grid over a face of ``size`` [mm], of one row of cells for a ``line``.

        A line contact uses the first of ``size`` and of ``shape`` only.
        """
        return cls.line_contact(size[0], shape[0]) if line else cls.covering(size, shape)

    @property
    def cell_area(self) -> float:
        """Area S of a cell [mm²]."""
        return self.pitch[0] * self.pitch[1]

    @property
    def size(self) -> tuple[float, float]:
        """Extent of the grid along x and y [mm]."""
        return self.shape[0] * self.pitch[0], self.shape[1] * self.pitch[1]

    @cached_property
    def x(self) -> Array:
        """Cell centres along x, shape ``(nx, 1)`` [mm]."""
        return _centres(self.shape[0], self.pitch[0])[:, None]

    @cached_property
    def y(self) -> Array:
        """Cell centres along y, shape ``(1, ny)`` [mm]."""
        return _centres(self.shape[1], self.pitch[1])[None, :]

    @property
    def centres(self) -> Array:
        """Coordinates x and y of all cell centres ``(2, nx, ny)`` [mm]."""
        return np.stack(np.broadcast_arrays(self.x, self.y))


def _pair(name: str, values: Sequence[T]) -> Sequence[T]:
    """Return ``values``, or raise InputError unless they are two: along x and along y."""
    given: Any = values
    if np.shape(given) != (2,):
        raise InputError(f"the {name} of a grid is {values!r}: give two, along x and along y")
    return values


def _centres(count: int, pitch: float) -> Array:
    """Return the centres ``(count,)`` [mm] of cells that are centred on zero."""
    return (np.arange(count, dtype=np.float64) - 0.5 * (count - 1)) * pitch


@dataclass(frozen=True)
class Frame:
    """Coordinate frame of an interface: its ``origin`` (3,) [mm] and ``axes`` (3, 3).

    The rows of ``axes`` are the unit vectors along x, y and z. InputError is raised unless they
    have length 1, are orthogonal and right-handed.

    Examples
    --------
    On a flank at 45°, a force along the global Z has a component along x and one along z:

    >>> import numpy as np
    >>> from sa_solver import Frame
    >>> half = np.sqrt(0.5)
    >>> axes = np.array([[half, 0.0, half], [0.0, 1.0, 0.0], [-half, 0.0, half]])
    >>> flank = Frame(origin=np.array([10.0, 0.0, 5.0]), axes=axes)
    >>> print(flank.components(np.array([0.0, 0.0, 100.0])).round(2))
    [70.71  0.   70.71]
    >>> print(flank.coordinates(np.array([11.0, 0.0, 6.0])).round(4))
    [1.4142 0.     0.    ]
    """

    origin: Array
    axes: Array

    def __post_init__(self) -> None:
        axes = checks.array("axes of a frame", self.axes, (3, 3))
        checks.settle(self, origin=checks.array("origins of a frame", self.origin, (3,)), axes=axes)
        if np.abs(axes @ axes.T - np.eye(3)).max() > SQUARE or np.linalg.det(axes) < 0.0:
            raise InputError(
                f"axes of a frame {axes.tolist()}: give rows of length 1, at right angles, that "
                "form a right-handed system"
            )

    def coordinates(self, points: Array) -> Array:
        """Return the local coordinates of global ``points`` ``(..., 3)`` [mm]."""
        return self.components(points - self.origin)

    def components(self, vectors: Array) -> Array:
        """Return the local components of global ``vectors`` ``(..., 3)``."""
        return np.asarray(vectors @ self.axes.T, dtype=np.float64)

    def to_global(self, components: Array) -> Array:
        """Return the global vectors of local ``components`` ``(..., 3)``."""
        return components @ self.axes


def resultants(forces: Array, x: Array, y: Array) -> Array:
    """Return the resultants of point forces on body 2, in the interface frame.

    Parameters
    ----------
    forces
        Forces ``(3, ...)`` along x, y and z [N]; the z component is the pressure force, positive
        where the bodies are pressed together.
    x, y
        Coordinates of the points [mm], which broadcast against ``forces[0]``.

    Returns
    -------
    Array
        ``(P, Qx, Qy, Mx, My, Mz)`` ``(6,)`` [N, N mm].
    """
    fx, fy, fz = forces
    moments = np.sum(fz * y), -np.sum(fz * x), np.sum(fy * x - fx * y)
    return np.array([np.sum(fz), np.sum(fx), np.sum(fy), *moments])


def resultant_change(now: Array, then: Array, sizes: Array) -> Array:
    """Return the relative change ``(faces, 6)`` from the resultants ``then`` to those of ``now``.

    Forces are relative to the P of ``then``, moments to that P times half the size of the face. A
    face without load in ``then`` is measured by the largest P of all faces; where no face was
    loaded the change is 0. ``sizes`` ``(faces, 2)`` are the extents along x and y [mm].
    """
    halves = 0.5 * sizes
    longest = halves.max(axis=1)
    # A line contact has no width along y, and no moment about x.
    half_x, half_y = np.where(halves > 0.0, halves, longest[:, None]).T
    loads = np.where(then[:, 0] > 0.0, then[:, 0], then[:, 0].max())
    one = np.ones_like(longest)
    scales = (loads * np.array([one, one, one, half_y, half_x, longest])).T
    change: Array = np.divide(now - then, scales, out=np.zeros_like(scales), where=scales > 0.0)
    return change
