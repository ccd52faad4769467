r"""Matrices of structures from other programs, and reduced models for other programs.

- ``external_matrices``, ``ExternalMatrices``: stiffness, mass, damping and loads from files, in
  base units
- ``Unknown``, ``GivenUnknowns``, ``FileUnits``: meaning and units of their rows
- ``read_matrix_file``, ``MatrixFile``: content of a single file
- ``on_retained``, ``on_all``: reduced model of the matrices, on some points or on all
- ``without_massless``, ``with_light_motions``, ``check_definite``: preparation of such a model for
  vibration
- ``lowest_frequencies``: natural frequencies of the matrices, rigid motions first
- ``write_matrices``: a reduced model as ``.npz``, ``.mat`` or Matrix Market
- ``MatrixError``: error of matrices that cannot be used

A mass of 2 kg on 1 N/µm in two files of Matrix Market, in m and N:

>>> import tempfile
>>> from pathlib import Path
>>> from fe_models.matrices import FileUnits, GivenUnknowns, Unknown, external_matrices
>>> folder = Path(tempfile.mkdtemp())
>>> for name, value in (("k", "1e6"), ("m", "2")):
...     text = f"%%MatrixMarket matrix array real general\n1 1\n{value}\n"
...     _ = (folder / f"{name}.mtx").write_text(text)
>>> sources = {"stiffness": (folder / "k.mtx", ""), "mass": (folder / "m.mtx", "")}
>>> given = GivenUnknowns((Unknown("mass", "x"),))
>>> own = external_matrices(sources, given=given, units=FileUnits(length=1000.0))
>>> print(own.stiffness.toarray(), own.mass.toarray())
[[1000.]] [[0.002]]
"""

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.matrices.export import write_matrices
    from fe_models.matrices.parts import read_matrix_file
    from fe_models.matrices.reduction import (
        check_definite,
        lowest_frequencies,
        on_all,
        on_retained,
        with_light_motions,
        without_massless,
    )
    from fe_models.matrices.structure import (
        ExternalMatrices,
        FileUnits,
        GivenUnknowns,
        external_matrices,
    )
    from fe_models.matrices.unknowns import MatrixError, MatrixFile, Unknown

__all__ = [
    "ExternalMatrices",
    "FileUnits",
    "GivenUnknowns",
    "MatrixError",
    "MatrixFile",
    "Unknown",
    "check_definite",
    "external_matrices",
    "lowest_frequencies",
    "on_all",
    "on_retained",
    "read_matrix_file",
    "with_light_motions",
    "without_massless",
    "write_matrices",
]

__getattr__, __dir__ = lazy_names(__name__)
