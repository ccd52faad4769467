"""Pages are written in short, plain sentences."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
# Generated pages are there only after a build: references, and the gallery. Those of messages are
# made and read in test_message_reference.
REFERENCE = DOCS / "reference"
GENERATED = {DOCS / "_build", DOCS / "gallery"}
GENERATED |= {REFERENCE / "cases", REFERENCE / "libraries", REFERENCE / "messages"}
PAGES = sorted(path for path in DOCS.rglob("*.md") if GENERATED.isdisjoint(path.parents))
# Words of a sentence, and of a page that explains, above which a reader loses the thread.
LONGEST_SENTENCE, LONGEST_PAGE = 35, 2000
# Starts whose meaning depends on an earlier sentence, or comes later in the same one.
UNCLEAR = re.compile(r"(That|Those|What|Whether|Of) ")
BLOCK = re.compile(
    r"^---$.*?^---$|^(```|~~~).*?^\1|^\$\$.*?^\$\$|^<[^>]+>", re.MULTILINE | re.DOTALL
)
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
NOT_PROSE = re.compile(r"^\s*(\||#|%|\(|\{|:|!\[)")


def sentences(path):
    """Return the sentences of a page, without code, formulas, tables and headings."""
    text = BLOCK.sub("\n\n", path.read_text(encoding="utf-8"))
    prose = []
    for part in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text):
        if part.strip() and not NOT_PROSE.match(part):
            clean = re.sub(r"\s+", " ", LINK.sub(r"\1", part)).strip(" -*")
            prose += re.split(r"(?<=[\w)`%*][.?!:;])\s+", clean)
    return [sentence.strip("*_ ") for sentence in prose if re.search("[a-z]{2}", sentence)]


def unclear(path):
    """Return the sentences of a page that are too long or start unclearly."""
    question = re.compile(r"\?[\"*]*$")
    return [
        sentence
        for sentence in sentences(path)
        if len(sentence.split()) > LONGEST_SENTENCE
        or (UNCLEAR.match(sentence) and not question.search(sentence))
    ]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(DOCS).as_posix())
def test_sentences_are_short_and_begin_with_their_subject(path):
    assert unclear(path) == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(DOCS).as_posix())
def test_files_of_tests_that_a_page_names_are_there(path):
    named = re.findall(r"`(tests/[\w/.]+)", path.read_text(encoding="utf-8"))
    assert [name for name in named if not (DOCS.parent / name).exists()] == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(DOCS).as_posix())
def test_pages_are_short(path):
    assert sum(len(sentence.split()) for sentence in sentences(path)) <= LONGEST_PAGE
