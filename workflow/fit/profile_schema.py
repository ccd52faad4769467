"""Schema of the file of a fit to worn depths and profiles, through runs of cases."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool

from workflow.case.fields import AnyValue, File, Quantity
from workflow.case.sections import Section, Title, entry
from workflow.fit.measurement import KIND, Heading, Measurement

Deviation = Annotated[float, Quantity("mm", above=0.0, range_text="above 0 um")]


class ProfileHeadings(Section):
    """Headings of the columns of a file, where they differ from the names here."""

    x: Heading | None = entry("place along the contact", "position", default=None)
    depth: Heading | None = entry("depth worn off both bodies", "wear", default=None)
    depth_1: Heading | None = entry("depth worn off body 1", "flat", default=None)
    depth_2: Heading | None = entry("depth worn off body 2", "ball", default=None)


class ProfileDeviations(Section):
    """Standard deviations of depths; if not given, they are estimated from the residuals."""

    depth: Deviation | None = entry(
        "deviation of the depth of both bodies [mm]", "0.2 um", default=None
    )
    depth_1: Deviation | None = entry(
        "deviation of the depth of body 1 [mm]", "0.2 um", default=None
    )
    depth_2: Deviation | None = entry(
        "deviation of the depth of body 2 [mm]", "0.2 um", default=None
    )


class ProfileMeasurement(Measurement):
    """Profile across a scar: x, and depth, or depth_1 and depth_2 of the bodies.

    Depth is positive where material is worn off.
    """

    case: Annotated[str, File((".yaml", ".yml"))] = entry(
        "the test as a wear case; its x is that of the profile", "test.yaml"
    )
    interface: Annotated[str, Field(min_length=1)] | None = entry(
        "contact of the case, if it has several", "interface", default=None
    )
    aligned: StrictBool = entry(
        "x and depth are those of the case: no shift, height and tilt are fitted",
        False,
        default=False,
    )
    columns: ProfileHeadings = entry("other headings", default=ProfileHeadings())
    deviations: ProfileDeviations = entry(
        "one standard deviation; or columns such as depth_deviation", default=ProfileDeviations()
    )


class ProfileFit(Section):
    """Wear coefficients from depths and profiles, through runs of the tests as cases."""

    title: Title = entry("one line", "Wear coefficient of three scars")
    fit: Literal["wear_profiles"] = entry(KIND, "wear_profiles")
    measurements: tuple[ProfileMeasurement, ...] = entry("a table for each profile", min_length=1)
    offset: Literal["none", "threshold"] = entry(
        "none; threshold: energy before anything wears, for tests that dissipated more and less",
        "none",
        default="none",
    )
    finer: dict[str, AnyValue] = entry(
        "entries of the cases, by dotted path, for a repetition of the last runs with finer "
        "steps and grid, which gives their error",
        {"wear.tolerance": "0.2 %"},
        min_length=1,
    )
