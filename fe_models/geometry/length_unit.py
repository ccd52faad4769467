"""The unit of length of a mesh file, and a mesh brought to millimetres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fe_models.geometry.scene import Scene, Vector

if TYPE_CHECKING:
    from fe_models.geometry.grouped import GroupedMesh

# Units of length by their size in mm, and forces in N that go with them in a consistent system.
SIZES = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
POUND_FORCE = 4.4482216152605
FORCES = dict.fromkeys(SIZES, 1.0) | dict.fromkeys(("in", "ft"), POUND_FORCE)


@dataclass(frozen=True)
class LengthUnit:
    """A unit of length: its ``name``, its ``size`` in mm, and why it is that one, in words.

    There is no ``source`` where nothing says it.

    Examples
    --------
    >>> from fe_models.geometry.length_unit import LengthUnit
    >>> print(LengthUnit())
    taken as mm, the file says no unit
    >>> print(LengthUnit("in", 25.4, "as joint.unv:2 says"))
    in in, as joint.unv:2 says, converted to mm
    """

    name: str = "mm"
    size: float = 1.0
    source: str = ""

    def __str__(self) -> str:
        if not self.source:
            return "taken as mm, the file says no unit"
        return f"in {self.name}, {self.source}" + ", converted to mm" * (self.size != 1.0)

    @property
    def force(self) -> float:
        """Size in N of the unit of force that forces of the file are taken to have."""
        return FORCES.get(self.name, 1.0)


def in_millimetres(mesh: GroupedMesh) -> GroupedMesh:
    """Return a mesh that has lengths in its ``unit`` in mm, and what it says in N, mm and t."""
    unit = mesh.unit
    if unit.size == 1.0:
        return mesh
    midsides = mesh.midsides
    if midsides is not None:
        midsides = replace(midsides, points=unit.size * midsides.points)
    return replace(
        mesh,
        points=unit.size * mesh.points,
        midsides=midsides,
        scene=_converted(mesh.scene, unit.size, unit.force),
    )


def _converted(scene: Scene, length: float, force: float) -> Scene:
    """What a file says in units of such ``length`` [mm] and ``force`` [N], and s, in N and mm."""
    stress = force / length**2
    of_materials = {"young": stress, "density": force / length**4}
    of_loads = {
        "pressure": stress, "traction": stress, "force": force, "displacement": length,
        "acceleration": length,
    }  # fmt: skip
    return replace(
        scene,
        materials={
            body: {name: of_materials.get(name, 1.0) * value for name, value in known.items()}
            for body, known in scene.materials.items()
        },
        loads=tuple(
            replace(
                load,
                value=of_loads.get(load.kind, 1.0) * load.value
                if isinstance(load.value, float)
                else _times(load.value, of_loads.get(load.kind, 1.0)),
                through=_times(load.through, length),
            )
            for load in scene.loads
        ),
    )


def _times(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return factor * x, factor * y, factor * z
