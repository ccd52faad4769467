"""The reference of case entries has every entry; the gallery has every case."""

import importlib
import re
import sys
from pathlib import Path

import pytest
from pydantic import TypeAdapter
from ruamel.yaml import YAML

from workflow.kinds import kinds

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS / "_ext"))
case_reference, gallery_page = map(importlib.import_module, ("case_reference", "gallery_page"))
LARGEST_PICTURE, LARGEST_GALLERY = 60_000, 1_500_000


def paths_of(schema, node, path=""):
    """Return paths of all leaves below a node of a JSON schema, lists as [], by its references."""
    if "$ref" in node:
        node = schema["$defs"][node["$ref"].rpartition("/")[2]]
    for part in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from paths_of(schema, part, path)
    items = node.get("items", {})
    if "$ref" in items or "oneOf" in items or "anyOf" in items:
        yield from paths_of(schema, items, f"{path}[]")
    for name, child in node.get("properties", {}).items():
        below = list(paths_of(schema, child, f"{path}.{name}" if path else name))
        yield from below or [f"{path}.{name}" if path else name]


@pytest.mark.parametrize("kind", list(kinds()))
def test_every_entry_is_on_the_page_of_its_kind(kind):
    """The pages are made from the models; here their JSON schema is walked instead."""
    model = kinds()[kind]
    schema = TypeAdapter(model).json_schema()
    wanted = set(paths_of(schema, schema))
    assert len(wanted) > 15
    page = case_reference.case_page(kind, model)
    reported = set(re.findall(r"^`([^`]+)`\n: ", page, re.MULTILINE))
    assert reported == wanted


@pytest.mark.parametrize("kind", list(kinds()))
def test_every_entry_has_a_meaning_and_what_is_allowed(kind):
    page = case_reference.case_page(kind, kinds()[kind])
    for entry in re.findall(r"^`[^`]+`\n: .*\n\n  .*", page, re.MULTILINE):
        _, meaning, rules = re.match(r"`([^`]+)`\n: (.*)\n\n  (.*)", entry).groups()
        assert len(meaning) > 3, entry
        assert "Allowed: " in rules, entry
        assert re.search(r"Must be given|Optional|Default: `", rules), entry


def test_every_kind_is_in_the_contents():
    text = (DOCS / "reference" / "index.md").read_text("utf-8")
    assert set(re.findall(r"^cases/(\w+)$", text, re.MULTILINE)) == set(kinds())


def test_every_case_has_its_place_in_the_gallery():
    cases = {path.stem for path in gallery_page.CASES.glob("*.yaml")}
    scenes = YAML(typ="safe").load(DOCS / "gallery" / "scenes.yaml")
    shown = [name for names in gallery_page.HEADINGS.values() for name in names]
    assert cases == set(scenes) == set(shown)
    assert len(shown) == len(set(shown))
    pictures = {path.stem: path.stat().st_size for path in (DOCS / "gallery").glob("*.png")}
    assert set(pictures) <= cases
    assert max(pictures.values()) <= LARGEST_PICTURE
    assert sum(pictures.values()) <= LARGEST_GALLERY


def test_the_readme_names_every_kind_and_only_files_that_are_there():
    text = (DOCS.parent / "README.md").read_text("utf-8")
    named = set(
        re.findall(r"`([a-z_]+)`", text.split("## Kinds of case")[1].split("\nAnd with")[0])
    )
    assert set(kinds()) <= named
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert (DOCS.parent / target).exists(), target
