"""Endings of mesh and CAD files: those that are read, and advice about the others."""

from __future__ import annotations

# CAD files, whose shapes are meshed here.
CAD = (".step", ".stp", ".brep")
# Nastran's bulk data; the content decides whether a ``.dat`` is one.
NASTRAN = (".bdf", ".nas", ".fem", ".dat")
EXODUS = (".e", ".exo", ".ex2", ".exii", ".g", ".gen")
# Formats of meshio with solid elements, only some of all those that it reads.
MESHIO = (".vtu", ".vtk", ".xdmf", ".med", ".mesh", ".meshb", ".vol", ".su2", ".avs")
READ = (".msh", ".inp", *NASTRAN, ".unv", *EXODUS, *MESHIO, *CAD)
# Formats of other programs that are not read.
OWN_FORMATS = {
    ".cdb": "Ansys", ".db": "Ansys", ".mechdb": "Ansys", ".rst": "Ansys", ".rth": "Ansys",
    ".agdb": "Ansys", ".wbpj": "Ansys", ".odb": "Abaqus", ".cae": "Abaqus", ".mph": "COMSOL",
    ".mphtxt": "COMSOL", ".op2": "Nastran", ".hm": "HyperMesh", ".k": "LS-DYNA",
    ".key": "LS-DYNA", ".hdf": "Salome", ".fcstd": "FreeCAD", ".frd": "CalculiX", ".cub": "Cubit",
    ".cub5": "Cubit", ".trelis": "Cubit", ".prt": "NX", ".sldprt": "SolidWorks",
    ".sldasm": "SolidWorks", ".ipt": "Inventor", ".iam": "Inventor", ".catpart": "CATIA",
    ".catproduct": "CATIA", ".x_t": "Parasolid", ".sat": "ACIS", ".iges": "CAD", ".igs": "CAD",
}  # fmt: skip
EXPORT = "export it as .inp, .bdf, .unv, .msh, .e, .vtu or .step"
# Files with shapes but no mesh, which can be exported as shapes instead of as a mesh.
SHAPES = frozenset({".agdb", ".prt", ".sldprt", ".sldasm", ".ipt", ".iam", ".catpart",
                    ".catproduct", ".x_t", ".sat", ".iges", ".igs", ".fcstd"})  # fmt: skip


def why_not_read(name: str) -> str:
    """Return why a file of this name is not read and what to do; empty if it is read."""
    ending = name[name.rfind(".") :].lower() if "." in name else ""
    if ending in READ:
        return ""
    if ending == ".geo":
        stem = name.replace("\\", "/").rpartition("/")[2][: -len(ending)]
        return (
            f"a script of gmsh, which may run other programs, is not run here; mesh it with gmsh "
            f"-3 {stem}.geo -o {stem}.msh, with a Physical Volume for each body and a Physical "
            "Surface for each face that is named"
        )
    if ending in OWN_FORMATS:
        what = "export it as .step" if ending in SHAPES else EXPORT
        return f"{OWN_FORMATS[ending]}'s {ending} is not read; {what}"
    return f"{f'files {ending}' if ending else 'files without an ending'} are not read; {EXPORT}"
