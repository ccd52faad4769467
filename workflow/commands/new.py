"""``fretscale new``: a case or another file to begin with, and the files that it names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from workflow.errors import UserError
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
# Files that a template names beside it, each by the kind whose template it is, or as text.
COMPANIONS: Mapping[str, Mapping[str, str]] = {
    "resultants": {"loads.csv": LOADS},
    "vibration_wear": {"specimens_wear.yaml": "bodies_wear"},
    "friction_rig_wear": {"specimens_rig.yaml": "specimens"},
    "reduced_wear": {"specimens.yaml": "specimens"},
    SWEEP: {"my.yaml": "bodies"},
}


def offered() -> dict[str, str]:
    """Return every kind of file that can be begun with, and what it is about."""
    return {**about(), SWEEP: ABOUT, **{name: what for name, (_, what) in FITS.items()}}


def text_of(kind: str, short: bool = False) -> str:
    """Return the commented template of a kind, or a ``short`` case of what must be given alone.

    Raises UserError where there is no such kind, or no short one.
    """
    if kind not in offered():
        raise UserError(f"{kind}: no such kind of case; allowed: {', '.join(offered())}")
    if kind not in about() and short:
        raise UserError(f"--short: {kind} is short as it is; allowed: kinds of case")
    if kind in FITS:
        return fit_template(kind)
    return sweep_template() if kind == SWEEP else template(kind, short)


def write_new(kind: str, file: Path, short: bool = False) -> list[Path]:
    """Write the template of a kind to ``file`` and what it names beside it; return the paths.

    Files beside it that exist are left as they are, and not returned. Raises UserError where
    ``file`` itself exists.
    """
    text = text_of(kind, short)
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise UserError(f"{file}: exists; give another name or remove it") from None
    written = [file]
    for name, content in COMPANIONS.get(kind, {}).items():
        companion = file.parent / name
        if not companion.exists():
            companion.write_text(
                content if "\n" in content else text_of(content, short=True), encoding="utf-8"
            )
            written.append(companion)
    return written
