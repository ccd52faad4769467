"""Files of the matrices of another program, with their units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import model_validator

from workflow.analyses.rig.bodies.unknowns_file import given_unknowns
from workflow.case.fields import File, Text, split_dataset
from workflow.case.files.input_files import open_hdf5
from workflow.case.sections import Section, disagreement, entry
from workflow.case.units import UnitError, to_base

if TYPE_CHECKING:
    from fe_models.matrices import ExternalMatrices

# Files with their modification times and sizes.
Stamps = tuple[tuple[str, int, int], ...]
PARTS = "stiffness", "mass", "damping", "loads"
SEVERAL = ".npz", ".mat", ".h5", ".hdf5", ".pch", ".bdf", ".op4"
ENDINGS = (*SEVERAL, ".mtx")
HDF5 = ".h5", ".hdf5", ".mat"
HDF5_BEGINS = b"\x89HDF"


@dataclass(frozen=True)
class UnitName(Text):
    """A unit with the same dimension as ``base``."""

    base: str

    allowed = "a unit of this dimension, such as mm, N or kg"

    def parse(self, value: object) -> str:
        name = super().parse(value)
        try:
            to_base(f"1 {name}", self.base)
        except (UnitError, ArithmeticError) as error:
            raise self.refusal(value, str(error)) from error
        return name


class MatrixUnits(Section):
    """Units of matrices."""

    length: Annotated[str, UnitName("mm")] = entry(
        "unit of displacements; rotations are in rad, times in s", "mm"
    )
    force: Annotated[str, UnitName("N")] = entry("unit of stiffness times length", "N")
    mass: Annotated[str, UnitName("t")] | None = entry(
        "unit of mass; without it the one that fits: kg for N and m, t for N and mm",
        "t",
        default=None,
    )


class MatrixFiles(Section):
    """Files of matrices: one for all, or one for each."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("file",)

    file: Annotated[str, File(ENDINGS)] | None = entry(
        "file of all matrices without a file below, under usual names: stiffness or K, mass or "
        "M, damping or C, loads or F, Nastran's KAAX, MAAX, BAAX, PAX; .mtx: Abaqus' "
        "substructures",
        "matrices.h5",
        default=None,
    )
    stiffness: Annotated[str, File(ENDINGS)] | None = entry(
        "file of the stiffness; a matrix of several by its name: plant.mat:Kred",
        "k.mtx",
        default=None,
    )
    mass: Annotated[str, File(ENDINGS)] | None = entry("file of the mass", "m.mtx", default=None)
    damping: Annotated[str, File(ENDINGS)] | None = entry(
        "file of the viscous damping; damping_ratio is added to it", "c.mtx", default=None
    )
    loads: Annotated[str, File(ENDINGS)] | None = entry(
        "file of the loads: a column for each load, its forces per unit of load",
        "f.mtx",
        default=None,
    )
    unknowns: Annotated[str, File((".csv",))] | None = entry(
        "meaning of the rows, if files do not state it: columns point and direction (x, y, z, "
        "rx, ry, rz or modal), if known x, y, z; or names of nodes: columns node and point",
        "unknowns.csv",
        default=None,
    )
    units: MatrixUnits = entry("units of all files")

    @model_validator(mode="after")
    def _whole(self) -> MatrixFiles:
        if self.file is None and (self.stiffness is None or self.mass is None):
            raise disagreement(
                "missing; allowed: one file of all matrices, or stiffness and mass", "file"
            )
        return self

    @property
    def sources(self) -> dict[str, tuple[Path, str]]:
        """File and dataset name of each matrix that has a file of its own."""
        given = {part: getattr(self, part) for part in PARTS}
        split = {part: split_dataset(text) for part, text in given.items() if text is not None}
        return {part: (Path(file), name) for part, (file, name) in split.items()}

    @property
    def stamps(self) -> Stamps:
        """The files with modification times and sizes, by which unchanged files are recognised."""
        files = {path for path, _ in self.sources.values()}
        files |= {Path(split_dataset(f)[0]) for f in (self.file, self.unknowns) if f is not None}
        states = ((path, path.stat()) for path in sorted(files))
        return tuple((str(path), state.st_mtime_ns, state.st_size) for path, state in states)

    def read(self) -> ExternalMatrices:
        """Return the matrices; unchanged files are not read again.

        Raises ``MatrixError`` and InputFileError.
        """
        return _read(self, self.stamps)

    def key_of(self, part: str) -> str:
        """Return the entry of the case that a ``part`` comes from, or the first one given."""
        if part in PARTS:
            part = "file" if getattr(self, part) is None else part
        given = [name for name in ("file", *PARTS) if getattr(self, name) is not None]
        return part or given[0]


@lru_cache(4)
def _read(files: MatrixFiles, stamps: Stamps) -> ExternalMatrices:
    from fe_models.matrices import FileUnits, external_matrices

    for name, *_ in stamps:
        _check_links(name)
    file = None if files.file is None else Path(split_dataset(files.file)[0])
    length, force = to_base(f"1 {files.units.length}", "mm"), to_base(f"1 {files.units.force}", "N")
    mass = 0.0 if files.units.mass is None else to_base(f"1 {files.units.mass}", "t")
    units = FileUnits(length, force, mass)
    return external_matrices(files.sources, file, given_unknowns(files.unknowns), units)


def _check_links(file: str) -> None:
    """Refuse HDF5 files that link to other files."""
    if file.endswith(HDF5):
        with Path(file).open("rb") as opened:
            head = opened.read(1024)
        if HDF5_BEGINS in head:
            with open_hdf5(file):
                pass
