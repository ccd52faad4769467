"""Materials, contacts, supports and loads in files of other programs, as far as a case has them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from sa_solver.errors import InputError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class FileContact:
    """Two faces in contact, with friction if the file gives any."""

    faces: tuple[str, str]
    friction: float | None
    line: str


@dataclass(frozen=True)
class FileSupport:
    """Group whose displacements are held along axes of the file, such as ``xz``."""

    group: str
    axes: str
    line: str


@dataclass(frozen=True)
class FileLoad:
    """Load on a group, or on the mass of all bodies, with its factors at the ends of the steps.

    Attributes
    ----------
    kind
        Kind of the load in a case.
    group
        Name of the group; empty for loads on the mass.
    value
        A pressure [MPa], or a vector along the axes of the file: a force, a force per area
        (``traction``), a displacement, an acceleration, or for a rotation the axis times the speed.
    path
        Factors at the end of every step.
    line
        Line of the file.
    through
        Point on the axis of a rotation.
    """

    kind: str
    group: str
    value: float | Vector
    path: tuple[float, ...]
    line: str
    through: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """Materials by body, contacts, supports and loads of a file, and lines that are ignored.

    Attributes
    ----------
    materials
        ``young`` and ``poisson`` of each body, and ``density`` and ``expansion`` if they are given.
    contacts, supports, loads
        As given in the file.
    steps
        Number of steps in the file.
    ignored
        Lines that are ignored, each with the reason.
    """

    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    contacts: tuple[FileContact, ...] = ()
    supports: tuple[FileSupport, ...] = ()
    loads: tuple[FileLoad, ...] = ()
    steps: int = 0
    ignored: tuple[str, ...] = ()

    def converted(self, length: float, force: float) -> Scene:
        """Return the scene in N, mm, t and s, from units of ``length`` [mm] and ``force`` [N].

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
            scaled = factor * value if isinstance(value, float) else times(factor, value)
            loads.append(replace(load, value=scaled, through=times(length, load.through)))
        return replace(self, materials=materials, loads=tuple(loads))


def times(factor: float, vector: Vector) -> Vector:
    """Return a vector times a factor."""
    x, y, z = vector
    return factor * x, factor * y, factor * z


class NotTakenError(InputError):
    """Reason for which a line of a file is ignored."""
