"""Tests of the codes of warnings and errors: registry, what is shown, and ``explain``."""

import ast
import json
import pickle
import re

import fretscale
import pytest

from sa_solver.errors import ContactProblemError
from tests.conftest import CASES
from tests.source_trees import PACKAGES, modules
from tests.workflow.command_line import command, invoke
from wear.steps.stepping import ContactFailure
from workflow.errors import CaseError, UserError
from workflow.messages import error_kinds
from workflow.messages.error_kinds import ErrorKind, error_kind
from workflow.messages.warning_kinds import Notice, WarningKind, kinds_in

KINDS = [*WarningKind, *ErrorKind]


def used(registry: str) -> set[str]:
    """Return the names of kinds that modules other than the registries use."""
    return {
        node.attr
        for name, module in modules("workflow").items()
        if not name.startswith("workflow.messages")
        for node in ast.walk(module)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == registry
    }


def test_codes_are_unique_and_of_their_registry():
    codes = [kind.code for kind in KINDS]
    assert len(set(codes)) == len(codes)
    assert all(re.fullmatch(r"FS-W\d{3}", kind.code) for kind in WarningKind)
    assert all(re.fullmatch(r"FS-E\d{3}", kind.code) for kind in ErrorKind)


def test_every_kind_of_warning_is_used():
    assert used("WarningKind") == {kind.name for kind in WarningKind}


def test_every_kind_of_error_is_that_of_a_class_or_used():
    named = {kind.name for kind in error_kinds.KINDS.values()}
    assert named | used("ErrorKind") == {kind.name for kind in ErrorKind}


def test_every_class_in_the_table_of_errors_exists():
    """Names are compared, because not all modules can be imported."""
    defined = {
        node.name
        for package in PACKAGES
        for module in modules(package).values()
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
    }
    assert error_kinds.KINDS.keys() <= defined


def test_a_general_error_has_the_kind_of_its_cause():
    def raised(cause):
        try:
            raise UserError("structure.file: no") from cause
        except UserError as error:
            return error_kind(error)

    assert raised(CaseError("no")) is ErrorKind.CASE_REFUSED
    assert raised(ValueError("no")) is raised(None) is ErrorKind.REFUSED


def test_an_error_of_a_worker_has_the_kind_of_its_cause():
    """Pickled, as between processes, an exception keeps its causes."""
    try:
        try:
            raise ContactFailure("increment 1") from ContactProblemError("friction")
        except ContactFailure as error:
            raise ContactFailure("pad: increment 1") from error
    except ContactFailure as error:
        received = pickle.loads(pickle.dumps(error))
    assert str(received) == "pad: increment 1"
    assert error_kind(received) is ErrorKind.NO_SOLUTION


@pytest.mark.parametrize(
    "case",
    [
        {"name": "sphere_normal", "load_path": {"legs": [{"P": "50 N"}, {"Qx": "31 N"}]}},
        {
            "name": "cylinder_wear",
            "contact__method": "full",
            "load_path": {"legs": [{"P": "50 N/mm", "Qx": "31 N/mm"}, {"Qx": "-31 N/mm"}]},
            "wear__cycles": 100,
        },
    ],
    ids=lambda case: case["name"],
)
def test_a_tangential_force_above_friction_is_refused_by_its_code(tmp_path, case):
    name = case.pop("name")
    grid = [16, 16] if name == "sphere_normal" else 32
    changed = {"contact__grid": grid, "friction__coefficient": 0.6, "expect": [], **case}
    with pytest.raises(fretscale.MethodFailed) as refused:
        fretscale.run(CASES / f"{name}.yaml", tmp_path / "out", quiet=True, **changed)
    assert error_kind(refused.value) is ErrorKind.NO_SOLUTION


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.code)
def test_explanations_are_whole_short_sentences(kind):
    assert not kind.title.endswith(".")
    for text in (kind.meaning, kind.remedy):
        assert text[0].isupper() or text.startswith(("contact.", "`"))
        assert text.endswith(".")
        assert max(len(sentence.split()) for sentence in re.split(r"[.:;]\s", text)) <= 35


def test_kinds_are_found_in_texts_in_order_and_once():
    border, few = WarningKind.CONTACT_AT_BORDER, WarningKind.FEW_CELLS
    texts = [str(Notice(kind, "a contact")) for kind in (few, border, few)]
    assert kinds_in([*texts, "of an old run", "of a new run [FS-W999]"]) == [few, border]


# --- what is shown ------------------------------------------------------------------------------


def test_a_warning_has_its_code_wherever_it_is_shown_and_the_report_explains_it(tmp_path):
    """A ball on so few cells is warned of by its code everywhere."""
    out, kind = tmp_path / "out", WarningKind.FEW_CELLS
    ended = command(
        *("run", CASES / "sphere_normal.yaml", "--out", out),
        overrides=["contact.grid=[12, 12]", "expect=[]"],
    )
    assert ended.exit_code == 0, ended.stderr
    warnings = json.loads((out / "summary.json").read_text("utf-8"))["warnings"]
    (text,) = (text for text in warnings if kinds_in([text]) == [kind])
    for shown in (ended.stderr, (out / "run.log").read_text("utf-8")):
        assert f"warning: {text}" in shown
    page = (out / "report.html").read_text("utf-8")
    assert all(part in page for part in (kind.code, kind.meaning, kind.remedy))


@pytest.mark.parametrize(
    ("arguments", "kind"),
    [
        (["run", "nowhere.yaml", "--out", "out"], ErrorKind.CASE_REFUSED),
        (["run", "wrong.yaml", "--out", "out"], ErrorKind.CASE_REFUSED),
        (["check", "mesh.yaml"], ErrorKind.CASE_REFUSED),
        (["describe", "empty.msh"], ErrorKind.MESH_REFUSED),
        (["new", "bodies", "wrong.yaml"], ErrorKind.FOLDER_TAKEN),
        (["report", "."], ErrorKind.RUN_CHANGED),
        (["no-such-command"], ErrorKind.REFUSED),
        (["materials", "--no-such-option"], ErrorKind.REFUSED),
        (["explain", "FS-W999"], ErrorKind.REFUSED),
    ],
    ids=lambda value: value.code if isinstance(value, ErrorKind) else " ".join(value),
)
def test_the_last_line_of_an_error_ends_with_its_code(arguments, kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("wrong.yaml", "mesh.yaml"):
        (tmp_path / name).write_text("title: no case\n", encoding="utf-8")
    (tmp_path / "empty.msh").touch()
    ended = invoke(*arguments)
    assert ended.exit_code == 2
    assert ended.stderr.splitlines()[-1].endswith(f"[{kind.code}]")


# --- explain ------------------------------------------------------------------------------------


@pytest.mark.parametrize("written", ["FS-W102", "fs-w102"])
def test_a_code_is_explained(written):
    ended, kind = invoke("explain", written), WarningKind.FEW_CELLS
    assert ended.exit_code == 0
    assert all(part in ended.stdout for part in (kind.code, kind.title, kind.meaning, kind.remedy))


def test_an_unknown_code_is_answered_with_the_nearest():
    ended = invoke("explain", "FS-W1O2")
    assert ended.exit_code == 2
    assert WarningKind.FEW_CELLS.code in ended.stderr


def test_all_codes_are_listed():
    ended = invoke("explain")
    assert ended.exit_code == 0
    lines = ended.stdout.splitlines()
    assert [line.split()[0] for line in lines] == [kind.code for kind in KINDS]
