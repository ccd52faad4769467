"""Templates of the files of fits, for ``fretscale new``."""

from __future__ import annotations

from workflow.case.sections import Section
from workflow.case.text.template import EDITORS, template
from workflow.fit.profile_schema import ProfileFit
from workflow.fit.schema import JointFit, LoopFitSection, WearFit

FITS: dict[str, tuple[type[Section], str]] = {
    "fit_joint": (JointFit, "from measurements: how friction and stiffness of a joint follow wear"),
    "fit_loops": (LoopFitSection, "from measurements: a joint law, of recorded hysteresis loops"),
    "fit_wear": (WearFit, "from measurements: wear coefficients, of volumes against energy"),
    "fit_profiles": (ProfileFit, "from measurements: wear coefficients, of depths and profiles"),
}
HEADER = f"""\
{EDITORS}\
# `fretscale fit` finds what is `free` here; a value in place of that is held. A number without a
# unit is in the base unit, given in brackets. Entries behind a # are optional: those said to be
# `or` another kind take the place of the section above.
"""


def fit_template(kind: str) -> str:
    """Return a commented file of a fit, one of ``FITS``."""
    return template(FITS[kind][0], HEADER)
