"""Every entry that a template of a case or a sweep has as a comment is valid without its sign."""

import json
import re
from typing import get_args

import pytest

from tests.workflow.case_leaves import (
    ALWAYS,
    APART,
    APART_MATRICES,
    BOLTED,
    CAD,
    CONTACT,
    EXCITED,
    INTERFACE,
    OWN_ON_BODY,
    REDUCED,
    RING,
    SECTOR,
)
from tests.workflow.sweep.test_bands import told_by_fit
from workflow.case.sections import KINDS_ARE_NAMED_BY, sections_of
from workflow.errors import CaseError
from workflow.kinds import kinds, parse_case, template
from workflow.sweep.schema import load_sweep
from workflow.sweep.template import sweep_template

OPENED = re.compile(r"^( *)# (?:- )?([\w.]+):.*")
# What a comment asks for beside itself, in words: by its key, or by what it brings.
NEEDS = {
    "wear.step.fraction": ["wear.step.kind=explicit"],
    "wear.reference_amplitude": ["wear.law=energy_amplitude"],
    "structure.contacts.wear.reference_amplitude": [
        "structure.contacts.0.wear.law=energy_amplitude"
    ],
    " - kind: pretension": ["load_path.cycle_from=2", "load_path.peak_leg=2"],
    "structure.other_bodies": [f"structure.contacts={BOLTED}"],
    "load_path": ["contact.method=full"],
    "structure.body": ["structure.file=specimens.yaml"],
    "structure.interfaces.nodes": [f"structure.interfaces.0.frame={INTERFACE['frame']}"],
    "\n#   law: friction_contact": [f"structure={REDUCED}"],
    # Of a body another entry takes the case's joint.
    "\n      # joint:  # law and parameters of these": [f"structure={OWN_ON_BODY}"],
    "\n      # joint:  # or: Contact at points": [f"structure={OWN_ON_BODY}"],
    "  kind: friction_rig": [f"joint={CONTACT | {'normal_load': 60}}"],
    "  # size: 2 mm  # size of the elements, for CAD": CAD,
    "structure.cyclic": [SECTOR],
    **{f"structure.matrices.{part}": [APART] for part in APART_MATRICES},
    # Points whose spacing lets a scan cover the whole face of the template.
    " surfaces:  # measured surfaces of every face, added to the gap, or": [
        "structure.surfaces.body_1.pitch=[0.1, 0.2]"
    ],
    " intrados:  # flank at": ["structure.surfaces.intrados.disk.pitch=[0.1, 0.2]"],
    **{
        f"structure.{key}": [f"structure.{place}.pitch=[0.1, 0.2]"]
        for key, place in (
            ("surfaces.body_2", "surfaces.body_2"),
            ("surfaces.intrados.blade", "surfaces.intrados.blade"),
            ("surfaces.extrados", "surfaces.extrados.disk"),
            ("surfaces.extrados.blade", "surfaces.extrados.blade"),
            ("interfaces.surfaces", "interfaces.0.surfaces.body_1"),
            ("interfaces.surfaces.body_2", "interfaces.0.surfaces.body_2"),
        )
    },
    "structure.retained": ["structure.modes=20"],
    "structure.modes": ["structure.retained=[pad, ring, tip]"],
    "  # instead of forces and mass, with wear.level": ["wear.force=", "wear.level=1"],
    "ring": RING,
    "  # instead of forces, with wear.level": [
        "structure.driven=",
        "wear.force=",
        "wear.level=1",
        "excitation.forces.0.points=pad",
    ],
    "wear.level": ["forces=", f"excitation={EXCITED['excitation'][ALWAYS]}"],
}


class Template:
    """Lines of a template, with the places where a comment may be opened."""

    def __init__(self, text):
        self.lines = text.splitlines()

    def places(self):
        """Return line numbers at which a comment that may be opened begins."""
        first = next(i for i, line in enumerate(self.lines) if "title:" in line)
        return [i for i in range(first, len(self.lines)) if OPENED.match(self.lines[i])]

    def key(self, start):
        """Return the dotted keys of the sections around a line and of the line itself."""
        depth, keys = self.depth(start), [OPENED.match(self.lines[start])[2]]
        for line in reversed(self.lines[:start]):
            match = re.match(r"( *(?:- )?)([\w.]+):", line)
            if match and len(match[1]) < depth:
                keys.insert(0, match[2])
                depth = len(line) - len(line.lstrip())
        return ".".join(keys)

    def depth(self, start):
        return len(OPENED.match(self.lines[start])[1])

    def end(self, start, sign=""):
        """Return the line after the section or entry that begins at a line."""
        below = " " * (len(self.lines[start]) - len(self.lines[start].lstrip())) + sign + "  "
        end = start + 1
        while end < len(self.lines) and self.lines[end].startswith(below):
            end += 1
        return end

    def opened(self, start):
        """Return the text with the entry that begins at a line, without what it replaces."""
        indent, key = OPENED.match(self.lines[start]).groups()
        end = self.end(start, "# ")
        block = [re.sub(f"^{indent}# ", indent, line) for line in self.lines[start:end]]
        comment = block[0].partition("  # ")[2]
        instead = re.search(r"instead of ([\w.]+)(?: and (\w+))?", comment)
        gone = [key] if comment.startswith("or: ") else []
        gone += [name for name in (instead.groups() if instead else ()) if name]
        lines = [*self.lines[:start], *block, *self.lines[end:]]
        for name in gone:
            lines = without(lines, start, indent, name)
        return "\n".join(lines) + "\n"


def without(lines, start, indent, name):
    """Return the lines without the entry of that name next to the one opened at a line."""
    for ahead in (range(start - 1, -1, -1), range(start + 1, len(lines))):
        for i in ahead:
            if lines[i].startswith(f"{indent}{name}:"):
                return lines[:i] + lines[Template("\n".join(lines)).end(i) :]
            if lines[i].startswith(f"{indent[:-2]}- {name}:"):  # the first of an item of a list
                opened = f"{indent[:-2]}- {lines[start].lstrip()}"
                return [*lines[:i], opened, *lines[i + 1 : start], *lines[start + 1 :]]
            if lines[i] and not lines[i].startswith(indent):
                break
    return lines


def _brings(block, words):
    """Return whether a block contains these words, at the beginning or after the end of a line."""
    return words.startswith((" ", "\n")) and words in f"\n{block}"


def ways(text, tried, overrides=(), within=""):
    """Yield key, text and overrides for each comment that may be opened, and those within it."""
    here = Template(text)
    for start in here.places():
        key = here.key(start)
        block = "\n".join(here.lines[start : here.end(start, "# ")])
        if not key.startswith(within) or (key, block) in tried:
            continue
        tried.add((key, block))
        asked = [NEEDS[w] for w in NEEDS if w == key or _brings(block, w)]
        needed = [override for overrides_of_it in asked for override in overrides_of_it]
        opened = here.opened(start)
        yield key, opened, [*overrides, *needed]
        yield from ways(opened, tried, [*overrides, *needed], f"{key}.")


@pytest.mark.slow
def test_every_comment_of_a_template_may_be_opened(folders):
    """Kinds of load, law and shape, and entries, are tested once over all templates."""
    tried, wrong = set(), []
    for kind in kinds():
        name = str(folders[kind] / "case.yaml")
        for key, text, overrides in ways(template(kind), tried):
            try:
                parse_case(re.sub(r"(?m)^ *#.*\n", "", text), name, overrides)  # read sooner
            except CaseError as error:
                wrong.append(f"{kind}: {key}: {error}")
    assert not wrong, "\n".join(wrong)
    assert len(tried) > 100


@pytest.mark.parametrize("kind", kinds())
def test_template_shows_every_kind_of_section(kind):
    """Each kind appears at least once, by the word that names it."""
    text = template(kind)

    def shown(model):
        for field in model.model_fields.values():
            sections = list(sections_of(field.annotation))
            for section in sections:
                named = [key for key in KINDS_ARE_NAMED_BY if key in section.model_fields]
                if len(sections) > 1 and named:
                    (word,) = get_args(section.model_fields[named[-1]].annotation)
                    assert re.search(rf"\b{named[-1]}: {word}\b", text), word
                shown(section)

    shown(kinds()[kind])


def test_every_comment_of_a_sweep_may_be_opened(tmp_path, dovetail_text):
    (tmp_path / "my.yaml").write_text(dovetail_text, encoding="utf-8")
    (tmp_path / "wear").mkdir()
    reported = told_by_fit(entries=["wear.disk.coefficient"])
    (tmp_path / "wear" / "summary.json").write_text(json.dumps(reported), encoding="utf-8")
    sweep = tmp_path / "sweep.yaml"
    grid, sample = sweep_template(), sweep_template().replace("design: grid", "design: sample")
    sample = sample.replace("# samples: 50", "samples: 50")
    sweep.write_text(grid, encoding="utf-8")
    assert len(load_sweep(sweep).file.variations()) == 1
    seen = set()
    for _, text, _ in ways(sample, seen):
        sweep.write_text(text, encoding="utf-8")
        load_sweep(sweep)
    assert len(seen) == 7
