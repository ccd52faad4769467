"""Page of the gallery, generated from the shipped cases when the pages are built.

It shows each case with its title, description, command, run time estimated by `check`, and the
sources of its expected values.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ruamel.yaml import YAML

from workflow.case.sections import Case
from workflow.kinds import analysis_of, load_case

if TYPE_CHECKING:
    from sphinx.application import Sphinx

CASES = Path(__file__).parents[2] / "cases"
HEADINGS = {
    "Wear of a dovetail": ("dovetail", "dovetail_small", "dovetail_2d"),
    "Bolted joints": ("lap_joint",),
    "Two bodies that wear": ("cylinder_wear", "sphere_wear", "specimens_wear"),
    "Contacts": (
        *("sphere_normal", "sphere_fretting", "sphere_torsion"),
        *("line_bulk_stress", "line_dissimilar"),
    ),
    "Specimens of a friction rig": (
        *("specimens_flat", "specimens_curved", "specimens_rig", "specimens_coarse"),
    ),
    "Joints in time": (
        *("rig_bouc_wen", "bolted_joint_test2", "bolted_joint_test4", "rig_force_75N"),
        *("rig_hammer_7N", "rig_hammer_60N", "rig_computed_wear", "rig_reduced"),
    ),
    "Joints that shake": (
        *("rig_two_dof", "ring_of_blades", "rig_harmonic_balance"),
        *("rig_wear_vibration", "rig_wear_specimens"),
    ),
}
INTRODUCTION = """\
# Gallery

Every case that is shipped, with a figure of its run; those of measured wear are in
[](../validation.md). `fretscale verify CASE` compares it with what
it lists under `expect:`, in the units of the list, and shows of what kind every value is: `printed`
by a publication, in numbers or words (its `source` says where, and what is a mean of what is
printed), `closed_form` (a formula, a balance or a limit), `independent` (by another method), or
`earlier`, a
result of ours, which only guards against change: depths and volumes of the default dovetail are of
that kind, its forces of a closed form.

The method follows Gallego, Fulleringer, Deyber and Nélias, *Multiscale computation of fretting wear
at the blade/disk interface* (2007). The paper prints neither dimensions nor loads: those inputs are
ours, and each case lists them under `assumed:`. The specimens are those of a Master's thesis
(Politecnico di Torino and Imperial College) on the rig of Fantetti et al. (2019).

The pictures were taken from runs by `docs/draw_gallery.py`. Times are those that `fretscale
check` tells of one core."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writing of the page before Sphinx looks for sources."""
    app.connect("builder-inited", lambda app: write_page(Path(app.srcdir) / "gallery"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_page(folder: Path) -> None:
    """Write the page if it has changed."""
    page, text = folder / "index.md", "\n\n".join(_blocks(folder)) + "\n"
    if not page.exists() or page.read_text(encoding="utf-8") != text:
        page.write_text(text, encoding="utf-8")


def _blocks(folder: Path) -> Iterator[str]:
    scenes = YAML(typ="safe").load(folder / "scenes.yaml")
    yield INTRODUCTION
    for heading, names in HEADINGS.items():
        yield f"## {heading}"
        for name in names:
            yield from _case_blocks(name, scenes[name]["scene"], folder)


def _case_blocks(name: str, scene: str, folder: Path) -> Iterator[str]:
    case = load_case(CASES / f"{name}.yaml")
    yield f"### {name}"
    if (folder / f"{name}.png").exists():
        yield f"![{case.title}]({name}.png)"
    yield f"*{case.title}*: {scene}."
    time = analysis_of(case).run_time(case).text
    yield f"`fretscale run cases/{name}.yaml --out out/{name}`, {time}"
    if held := list(_held_against(case)):
        yield f"Held against: {'; '.join(held)}."


def _held_against(case: Case) -> Iterator[str]:
    """Yield the kinds of the expectations with their sources, each once; formulas become code."""
    for kind in ("printed", "closed_form", "independent", "earlier"):
        sources = dict.fromkeys(entry.source for entry in case.expect if entry.kind == kind)
        if sources:
            yield f"*{kind.replace('_', ' ')}* " + ", ".join(f"`{source}`" for source in sources)
