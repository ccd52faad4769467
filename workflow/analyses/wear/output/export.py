"""``fretscale resultants``: the loads of a structure's contacts, written to files."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from fe_models.meshes.structure_mesh import Interface, MeshError
from fe_models.structure import InterfaceHistory
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.checks.warnings import warn_of_structure
from workflow.analyses.wear.choice import report_choice
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.recording import prepare_loads, reported_stage
from workflow.analyses.wear.run import meshed_faces
from workflow.analyses.wear.structures import resultants, structure_of
from workflow.analyses.wear.structures.resultants.case import ResultantsCase
from workflow.analyses.wear.structures.resultants.writing import (
    marched,
    write_resultants_csv,
    write_resultants_h5,
)
from workflow.case.text.writing import dump_case
from workflow.errors import UserError
from workflow.models.contact import gap_on
from workflow.models.loads import ContactFace
from workflow.models.structure import StructureLoads
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import write_text
from workflow.shell.terminal.reporter import Reporter

# Guide to writing such files with other codes.
RECIPE = Path(resultants.__file__).with_name("RECIPE.md")
TABLE, FIELDS, CASE, LOG = "resultants.csv", "resultants.h5", "resultants.yaml", "resultants.log"


def export_resultants(case: WearCase, name: str, out: Path, force: bool) -> list[str]:
    """Solve the structure of a case and write its loads; return lines that explain the files.

    ``name`` is that of the case in messages. Raises UserError, MethodFailed, OutOfMemory.
    """
    structure = structure_of(case)
    if not isinstance(case, FiniteElementCase):
        raise UserError(
            f"{name}: structure.kind: {structure.name} has no finite elements to take loads from; "
            "allowed: a dovetail or a mesh"
        )
    terms = case.every_terms
    if any(other != terms[0] for other in terms[1:]):
        raise UserError(
            f"{name}: structure.contacts: contacts with materials, friction, wear or grids of "
            "their own, which a case of resultants cannot have; allowed: the same for all"
        )
    structure.memory(case, 0, 0).check()
    case, choice = structure.choose(case)
    source = loads_of(case)
    assert isinstance(source, StructureLoads)
    with locked(out) as gone:
        folder = OutputFolder(out, "resultants")
        folder.replace(dict.fromkeys((TABLE, FIELDS, CASE), "loads of the contacts"), force)
        log = folder.reserve(LOG, "what was said, and when")
        with closing(Reporter(log)) as reporter:
            if gone:
                reporter.say(gone)
            report_choice(choice, reporter)
            try:
                _write(case, source, out, reporter)
            except MeshError as error:
                raise UserError(f"{name}: structure: {error}") from error
    return [
        f"{out / TABLE}: forces, moments and energies of every interface and increment",
        f"{out / FIELDS}: the same with slip, nodes, frames and unworn gaps",
        f"{out / CASE}: a case that wears under them, taken as constant: fretscale run "
        f"{out / CASE} --out DIR",
        f"Columns, signs, and how other codes write them: {RECIPE}",
    ]


def _write(case: WearCase, source: StructureLoads, out: Path, reporter: Reporter) -> None:
    faces = meshed_faces(case, source, reporter)
    prepare_loads(source, reporter)
    with reported_stage(reporter, source, "structural friction", "increments"):
        histories = {
            history.interface.name: _numbered(source, history) for history in source.unworn()
        }
    assert isinstance(case, FiniteElementCase)
    warn_of_structure(case, source, reporter)
    # All contacts have equal terms here: others were refused.
    cells = case.every_terms[0].grid
    heights = {face.face.name: gap_on(face, face.grid(cells)) for face in faces}
    loads = {name: history.loads for name, history in histories.items()}
    cycle = source.unworn_cycle
    reporter.say(f"loads: {marched(cycle)}")
    write_resultants_csv(out / TABLE, loads, source.line, cycle)
    write_resultants_h5(out / FIELDS, histories, heights, cycle)
    write_text(out / CASE, dump_case(_imported(case, faces, out)))


def _numbered(source: StructureLoads, history: InterfaceHistory) -> InterfaceHistory:
    """Return the history with the user's node numbers, where the mesh has them."""
    face = history.interface
    if not isinstance(face, Interface):
        return history
    numbers = [source.model.node_numbers(place) for place in face.bodies]
    if numbers[0] is None or numbers[1] is None:
        return history
    numbered = replace(face, nodes_1=numbers[0][face.nodes_1], nodes_2=numbers[1][face.nodes_2])
    return replace(history, interface=numbered)


def _imported(case: WearCase, faces: tuple[ContactFace, ...], out: Path) -> ResultantsCase:
    """Return the case with the loads of the files instead of its structure."""
    shared = ResultantsCase.model_fields.keys() & type(case).model_fields.keys()
    data = case.model_dump(
        include=shared - {"structure", "assumed", "measured", "expect"}, exclude_none=True
    )
    for section in ("materials", "wear"):
        for number, body in enumerate(case.bodies, start=1):
            data[section][f"body_{number}"] = data[section].pop(body)
            data[section][f"body_{number}"].pop("density", None)  # the loads include its effect
    data["structure"] = _structure(faces)
    imported = ResultantsCase.model_validate(data, context={"folder": str(out)})
    # A relative path keeps the files usable together when they are moved.
    beside = imported.structure.model_copy(update={"file": FIELDS})
    return imported.model_copy(update={"structure": beside})


def _structure(faces: tuple[ContactFace, ...]) -> dict[str, Any]:
    """Return the structure of the exported case: faces in their order, with exact sizes."""
    line = faces[0].face.line
    sizes = [face.size[0] if line else list(face.size) for face in faces]
    interfaces = [
        {"name": face.face.name} | ({} if size == sizes[0] else {"size": size})
        for face, size in zip(faces, sizes, strict=True)
    ]
    return {
        "kind": "resultants",
        "dimension": 2 if line else 3,
        "file": FIELDS,
        "size": sizes[0],
        "interfaces": interfaces,
    }
