"""``fretscale new``: a template of a case or another file, and the files that it names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from workflow.errors import FolderTaken, UserError
from workflow.fit.template import FITS, fit_template
from workflow.kinds import about, template
from workflow.sweep.template import ABOUT, SWEEP, sweep_template

# One closed cycle of a flank: pressed, loaded further while it slides, and unloaded while it
# slides back.
LOADS = """\
interface,P,Qx,Qy,Mx,My,Mz,Edx,Edy
flank,4000,0,0,0,0,0,0,0
flank,8000,-3200,0,0,0,0,60,0
flank,4000,1600,0,0,0,0,60,0
"""
# Mesh of few nodes for specimens, so that a first run takes minutes.
COARSE = "\nmesh: {pad_elements: 4, size: 2 mm}  # coarse; by default 10 and 1 mm\n"
# Files that a template names: name, kind of the short case (empty for none), and further text.
COMPANIONS: Mapping[str, tuple[str, str, str]] = {
    "resultants": ("loads.csv", "", LOADS),
    "vibration_wear": ("specimens_wear.yaml", "bodies_wear", ""),
    "friction_rig_wear": ("specimens_rig.yaml", "specimens", COARSE),
    "reduced_wear": ("specimens.yaml", "specimens", COARSE),
    SWEEP: ("my.yaml", "bodies", ""),
}


def offered() -> dict[str, str]:
    """Return every kind of file that has a template, with a line about it."""
    return {**about(), SWEEP: ABOUT, **{name: what for name, (_, what) in FITS.items()}}


def text_of(kind: str, short: bool = False) -> str:
    """Return the commented template of a kind, or a ``short`` case with required entries only.

    Raises UserError where there is no such kind, or no short one.
    """
    if kind not in offered():
        raise UserError(f"{kind}: no such kind of case; allowed: {', '.join(offered())}")
    if kind not in about() and short:
        raise UserError(f"--short: {kind} is short as it is; allowed: kinds of case")
    if kind in FITS:
        return fit_template(kind)
    return sweep_template() if kind == SWEEP else template(kind, short)


def write_new(kind: str, file: Path, short: bool = False) -> Path | None:
    """Write the template of a kind to ``file``, and an example of the file that it names.

    Returns the path of the example. Returns None where the template names no file, or where the
    file exists: it is then left unchanged. Raises UserError where ``file`` itself exists.
    """
    text = text_of(kind, short)
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise FolderTaken(f"{file}: exists; give another name or remove it") from None
    if kind not in COMPANIONS:
        return None
    name, of_kind, more = COMPANIONS[kind]
    example = file.parent / name
    if example.exists():
        return None
    example.write_text((text_of(of_kind, short=True) if of_kind else "") + more, encoding="utf-8")
    return example
