"""Each frequent question leads from the first page to a page that runs and states an error."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
TASKS = ("contact", "mesh", "loads", "vibration", "fit")
LINK = re.compile(r"\]\(([^)#:\s]+\.md)(?:#[^)]*)?\)")
CELL = re.compile(r"^```\{code-cell\}$.*?^```$", re.MULTILINE | re.DOTALL)


def pages_within(steps):
    """Return the pages that at most so many links lead to from the first one."""
    found = reached = {DOCS / "index.md"}
    for _ in range(steps):
        reached = {
            (page.parent / link).resolve()
            for page in reached
            if page.is_file()
            for link in LINK.findall(page.read_text(encoding="utf-8"))
        } - found
        found = found | reached
    return found


@pytest.mark.parametrize("name", TASKS)
def test_a_question_leads_to_a_page(name):
    page = DOCS / "tutorials" / f"{name}.md"
    choice = (DOCS / "which-kind.md").read_text(encoding="utf-8")
    questions = choice.split("## Five frequent questions")[1].split("\n## ")[0]
    assert page in pages_within(3)
    assert LINK.findall(questions).count(f"tutorials/{name}.md") == 1


@pytest.mark.parametrize("name", TASKS)
def test_a_page_of_a_task_runs_and_prints_an_error(name):
    text = (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    cells = CELL.findall(text)
    assert "**The question.**" in text
    assert any("fretscale" in cell and "%%bash" in cell for cell in cells)
    assert any("print(" in cell and "error" in cell for cell in cells)


@pytest.mark.parametrize("name", TASKS)
def test_a_page_of_a_task_ends_with_what_to_look_at(name):
    text = (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    title, advice = text.split("\n## ")[-1].split("\n", 1)
    assert title == "What to look at"
    assert re.search(r"`[\w/.]*\.png`", advice)
    assert re.search(r"\(#fs-w\d{3}\)", advice)
    assert "error" in advice


@pytest.mark.parametrize(("name", "entry"), [("mesh", "pretension"), ("vibration", "wear: {force")])
def test_a_page_of_a_task_runs_a_case_with_this_entry(name, entry):
    text = (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    cells = CELL.findall(text)
    files = [
        re.search(r"%%writefile (\S+)", cell)[1]
        for cell in cells
        if "%%writefile" in cell and entry in cell
    ]
    assert files
    assert any(f"fretscale run {files[0]}" in cell for cell in cells)
