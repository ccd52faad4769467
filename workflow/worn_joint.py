"""A joint whose friction and stiffness follow the wear of its contact, computed first."""

from __future__ import annotations

from pathlib import Path

from workflow.case import Case, CaseError, JointCase, RigCase, WearCase, load_case
from workflow.errors import UserError
from workflow.folder import OutputFolder
from workflow.reporter import Reporter


def with_computed_wear(
    case: JointCase | RigCase, folder: OutputFolder, reporter: Reporter
) -> JointCase | RigCase:
    """The case with the table of loops that its wear case leaves; as it is if it names none.

    The wear case runs into ``wear`` in the folder. Raises UserError if it cannot be read, is not
    one of a single contact, or asks for no loops.
    """
    file = case.evolution.file
    if file is None or not file.endswith(".yaml"):
        return case
    wear = _wear_case(file)
    with reporter.stage("wear of the contact"):
        # Imported here: it is what runs this case.
        from workflow.run import run_case

        run_case(wear, folder.wear, force=True)
    tables = sorted(folder.wear.glob("loops_*.csv"))
    if len(tables) != 1:
        names = ", ".join(path.stem.removeprefix("loops_") for path in tables)
        raise UserError(
            f"evolution.file: {file} wears the contacts {names}; allowed: a case of one contact, "
            f"or one of the tables in {folder.wear}"
        )
    evolution = case.evolution.model_copy(update={"file": str(tables[0])})
    return case.model_copy(update={"evolution": evolution})


def _wear_case(file: str) -> Case:
    try:
        wear = load_case(Path(file))
    except CaseError as error:
        raise UserError(f"evolution.file: {error}") from error
    if not isinstance(wear, WearCase) or not wear.loops.wanted:
        raise UserError(
            f"evolution.file: {file} leaves no table of loops; allowed: a wear case with "
            "loops.amplitude or loops.force"
        )
    return wear
