"""What a file of another program says besides its mesh, as far as a case can say it too."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from sa_solver.errors import InputError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class SaidContact:
    """Two faces that touch, and friction between them if the file gives any."""

    faces: tuple[str, str]
    friction: float | None
    line: str


@dataclass(frozen=True)
class SaidSupport:
    """A group whose displacements are held along the axes of the file, such as ``xz``."""

    group: str
    axes: str
    line: str


@dataclass(frozen=True)
class SaidLoad:
    """A load on a group, or on the mass of all bodies, and its factors at the ends of the steps.

    ``kind`` is that of a case's load. ``value`` is a pressure [MPa], or a vector along the axes of
    the file: a force or, as a ``traction``, a force per area; a displacement, an acceleration; of a
    rotation it is the axis times the speed, ``through`` a point.
    """

    kind: str
    group: str
    value: float | Vector
    path: tuple[float, ...]
    line: str
    through: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """Materials by body, contacts, supports and loads of a file, and lines that are neither.

    ``materials`` have ``young`` and ``poisson``, and ``density`` and ``expansion`` where these are
    given, as the file has them, and the line of each. ``steps`` is how many the file goes through;
    ``ignored`` are lines with why a case does not have them.
    """

    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    contacts: tuple[SaidContact, ...] = ()
    supports: tuple[SaidSupport, ...] = ()
    loads: tuple[SaidLoad, ...] = ()
    steps: int = 0
    ignored: tuple[str, ...] = ()

    def converted(self, length: float, force: float) -> Scene:
        """Return it in N, mm and t, where it is in units of that ``length`` [mm] and ``force`` [N].

        Times are in s.
        """
        stress = force / length**2
        of_materials = {"young": stress, "density": force / length**4}
        of_loads = {
            "pressure": stress, "traction": stress, "force": force, "displacement": length,
            "acceleration": length,
        }  # fmt: skip
        materials = {
            body: {name: of_materials.get(name, 1.0) * value for name, value in known.items()}
            for body, known in self.materials.items()
        }
        loads = []
        for load in self.loads:
            factor = of_loads.get(load.kind, 1.0)
            value = load.value
            scaled = factor * value if isinstance(value, float) else _times(factor, value)
            loads.append(replace(load, value=scaled, through=_times(length, load.through)))
        return replace(self, materials=materials, loads=tuple(loads))


def _times(factor: float, vector: Vector) -> Vector:
    x, y, z = vector
    return factor * x, factor * y, factor * z


class NotTakenError(InputError):
    """Why a line of a file is ignored."""
