"""The reference of messages has a section for each code, and pages link to codes that exist."""

import importlib
import re
import sys
from pathlib import Path

import pytest

from tests.docs.test_language import LONGEST_PAGE, sentences, unclear
from workflow.messages.error_kinds import ErrorKind
from workflow.messages.warning_kinds import WarningKind

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS / "_ext"))
message_reference = importlib.import_module("message_reference")
CODES = [kind.code for kind in (*WarningKind, *ErrorKind)]


def test_every_code_has_one_anchor_with_its_section():
    pages = "\n".join(map(message_reference.message_page, message_reference.PAGES))
    sections = re.findall(r"^\((.*)\)=\n## (.*?): ", pages, re.MULTILINE)
    assert sorted(code for _, code in sections) == sorted(CODES)
    assert all(anchor == code.lower() for anchor, code in sections)


def test_every_page_is_in_the_contents():
    text = (DOCS / "reference" / "index.md").read_text("utf-8")
    assert set(re.findall(r"^messages/(\w+)$", text, re.MULTILINE)) == set(message_reference.PAGES)


def test_pages_name_codes_that_exist():
    pages = [path for path in DOCS.rglob("*.md") if "_build" not in path.parts]
    named = {code for path in pages for code in re.findall(r"FS-[WE]\d+", path.read_text("utf-8"))}
    assert named
    assert named <= set(CODES)


@pytest.mark.parametrize("name", message_reference.PAGES)
def test_pages_are_short_and_plain(name, tmp_path):
    page = tmp_path / f"{name}.md"
    page.write_text(message_reference.message_page(name), encoding="utf-8")
    assert unclear(page) == []
    assert sum(len(sentence.split()) for sentence in sentences(page)) <= LONGEST_PAGE
