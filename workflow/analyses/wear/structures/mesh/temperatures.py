"""Temperatures of the bodies of a user's mesh, as sections of a case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import model_validator

from sa_solver.types import Array, Indices
from workflow.analyses.wear.case.sections import NonlinearitySection
from workflow.analyses.wear.structures.mesh.load import KINDS, MeshLoad, Name
from workflow.case.fields import File, Quantity
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import read_table_file
from workflow.case.sections import disagreement, entry

if TYPE_CHECKING:
    from fe_models.elasticity import thermal as fe

# Solids expand by less; the limit catches 12 written for 12e-6.
Expansion = Annotated[float, Quantity("1/K", at_least=-1e-3, at_most=1e-3)]
TemperatureValue = Annotated[float, Quantity("K", at_least=-1e4, at_most=1e4)]
# Columns of a temperature file.
NODE, TEMPERATURE = "node", "temperature"


class _Temperature(MeshLoad):
    """Base of all temperature loads."""

    body: Name | None = entry("body that has it; without it all bodies", "blade", default=None)


class TemperatureLoad(_Temperature):
    """Uniform change of temperature of a body, or of all bodies."""

    kind: Literal["temperature"] = entry(KINDS, "temperature")
    change: TemperatureValue = entry("change from the stress-free temperature [K]", "100 K")

    def described(self) -> fe.TemperatureChange:
        """Return the load as the structure takes it."""
        from fe_models.elasticity.thermal import TemperatureChange

        return TemperatureChange(self.change, self.body)


class NodalTemperatureLoad(_Temperature):
    """Temperatures of the nodes of a body, or of all bodies, by their numbers in the mesh file."""

    kind: Literal["nodal_temperature"] = entry(KINDS, "nodal_temperature")
    file: Annotated[str, File((".csv",))] = entry(
        "file with columns node, temperature: one for every corner node of an element [K, or °C "
        "with reference in °C]",
        "temperatures.csv",
    )
    reference: TemperatureValue = entry(
        "stress-free temperature, in the unit of the file [K]", 20.0
    )

    @model_validator(mode="after")
    def _is_read(self) -> NodalTemperatureLoad:
        try:
            self._table()
        except InputFileError as error:
            raise disagreement(str(error), "file") from error
        return self

    @property
    def contents(self) -> bytes:
        return Path(self.file).read_bytes()

    @property
    def places(self) -> Iterator[str]:
        yield from super().places
        _, values = self._table()
        low, high = values.min(), values.max()
        yield f"of {Path(self.file).name} ({len(values)} nodes, {low:g} to {high:g})"

    def described(self) -> fe.NodalTemperature:
        """Return the load as the structure takes it."""
        from fe_models.elasticity.thermal import NodalTemperature

        numbers, values = self._table()
        return NodalTemperature(numbers, values - self.reference, self.body)

    def _table(self) -> tuple[Indices, Array]:
        """Return node numbers and temperatures of the file ``(n,)``. Raises InputFileError."""
        table = read_table_file(self.file)
        table.check({NODE: "1", TEMPERATURE: "K"})
        table.require((NODE, TEMPERATURE), f"{NODE}, {TEMPERATURE}")
        return table.once(NODE), table.column(TEMPERATURE, Quantity("K"))


def check_temperatures(
    loads: Sequence[MeshLoad],
    materials: Mapping[str, tuple[str, float | None]],
    nonlinearity: NonlinearitySection,
    size: float | None,
) -> None:
    """Refuse temperatures of bodies without expansion, and of nonlinear structures.

    Nodal temperatures are also refused for CAD that is meshed with a ``size``, because its nodes
    get their numbers in this run. ``materials`` are names and expansions of bodies by case entry.
    """
    heating = [load for load in loads if isinstance(load, _Temperature)]
    for key, (name, expansion) in materials.items():
        if expansion is None and any(load.body in (None, name) for load in heating):
            raise disagreement(
                f"missing, but a temperature of {name} changes; allowed: linear thermal expansion "
                "[1/K], such as 12e-6 1/K",
                f"{key}.expansion",
                key,
            )
    for index, load in enumerate(loads):
        if size is not None and isinstance(load, NodalTemperatureLoad):
            raise disagreement(
                "a CAD file is meshed here, so its node numbers cannot be in a file of "
                "temperatures; allowed: kind: temperature, or a mesh file",
                f"structure.loads.{index}.kind",
            )
    if heating and nonlinearity.asked:
        raise disagreement(
            "temperatures change, and only linear structures have thermal strains; allowed: "
            "stiffness: linear without a check",
            "nonlinearity",
        )
