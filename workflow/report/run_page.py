"""Report of a finished run for readers who did not start it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import PurePath
from typing import Any

from workflow.case.sections import ASIDE, Case
from workflow.case.text.leaves import GIVEN, Leaf, in_words, leaves_of
from workflow.case.text.plain import counted
from workflow.case.text.readable import ALL_DIGITS, everyday_unit, percent, pretty, readable
from workflow.case.text.typeset import given, number, typeset, unparted
from workflow.kinds import analysis_of
from workflow.messages.warning_kinds import WarningKind, kinds_in
from workflow.report.numbers import error_budget, results
from workflow.report.page import (
    Html,
    code,
    contents_of,
    element,
    figure_key,
    folded,
    html,
    items,
    lines,
    link,
    note,
    page,
    picture,
    section,
    table,
    title_of,
    unbroken,
)
from workflow.shell.output.expectations import Verdict, verdict_of
from workflow.shell.output.quantities import SummaryQuantity
from workflow.shell.output.summary import QuantityError, counted_from_first

# Sections of a case that most readers look for.
LOOKED_FOR = (
    *("materials", "friction", "load_path", "wear", "joint", "evolution", "drive", "excitation"),
    *("energies", "ageing", "forces", "frequencies"),
)
NOT_LISTED = ("analysis", *ASIDE)
# Beginnings of the paths of results that are signs (1, 0 or -1).
SIGNS = "change.", "trend."
# Length below which a value is not broken into lines.
SHORT = 20
# Shorter stages are not listed [s].
AT_ONCE = 0.05
# Number of letters of a digest that are shown.
DIGEST = 12
# Number of figures to which the summary leads; the most important ones come first.
FIRST_FIGURES = 3


@dataclass(frozen=True)
class ReportData:
    """Finished run with the data for its report.

    ``case_text`` is the case as run and ``kind`` the name of its kind. ``input_files`` are digests
    of the files that it names, ``figures`` SVG texts by their names.
    """

    case: Case
    case_text: str
    kind: str
    summary: Mapping[str, Any]
    input_files: Mapping[str, str]
    figures: Mapping[str, str]


def run_page(run: ReportData) -> str:
    """Return the complete report."""
    quantities = analysis_of(run.case).quantities(run.case, run.summary)
    budget = error_budget(quantities, run.summary)
    leading = results([q for q in quantities if q.leading], run.summary)
    parts = [
        section("Analysis", _outline(run)),
        section("Results", results(quantities, run.summary)),
        section("Warnings", _warnings(run.summary["warnings"])),
        section("Expectations", _expectations(run)),
        section("Measured", _measured(run.summary)),
        section("Figures", *_figures(run)),
        section("Error budget", budget),
        section("Remarks", _remarks(run.summary)),
        section("The case", *_case(run)),
        section("Chosen settings", *_choice(run.summary)),
        section("Methods", *_computing(run)),
        section("Time", _seconds(run.summary["seconds"])),
        section("The case file", folded("case.yaml", element("pre", run.case_text))),
    ]
    top = section("Summary", *_top_of(run, leading, budget))
    return page(run.case.title, _header(run), top, contents_of(parts), *parts)


def _header(run: ReportData) -> Html:
    version = run.summary["versions"]["fretscale"]
    lead = f"Case of kind {run.kind}: {run.case.about}. Computed by fretscale {version}."
    return element("header", element("h1", run.case.title), element("p", lead, cls="lead"))


# --- summary ------------------------------------------------------------------------------------


def _top_of(run: ReportData, leading: Html, budget: Html) -> Iterator[Html]:
    """Yield what a reader without knowledge of the run needs first."""
    yield element("p", unparted(typeset(run.case.question)))
    if leading:
        yield element("h3", "Main results")
        yield leading
    kinds = [kind for kind in kinds_in(run.summary["warnings"]) if kind.is_on_results]
    yield element("h3", "Warnings")
    if kinds:
        yield items(_counted(kind, run.summary["warnings"]) for kind in kinds)
    else:
        yield element("p", "The run gave no warning about its results.")
    if places := list(_places(run, budget)):
        yield element("h3", "What to look at")
        yield items(places)


def _counted(kind: WarningKind, warnings: Sequence[str]) -> Html:
    """Return the title of a kind of warning, with a link to its explanation."""
    count = sum(kind.code in warning for warning in warnings)
    several = f" ({count} warnings)" if count > 1 else ""
    return element("span", link(kind.code, kind.code), f": {kind.title}{several}.")


def _places(run: ReportData, budget: Html) -> Iterator[Html]:
    """Yield links to figures and sections, each with what it shows."""
    for name in list(run.figures)[:FIRST_FIGURES]:
        yield element("span", "Figure: ", link(figure_key(name), title_of(run.figures[name])))
    if budget:
        text = " says which part of the computation each error comes from."
        yield element("span", link("error-budget", "Error budget"), text)
    if found := _verdicts(run):
        met = sum(isinstance(verdict, Verdict) and verdict.met for verdict in found)
        text = f": {met} of {len(found)} expectations met."
        yield element("span", link("expectations", "Expectations"), text)
    if rows := list(_compared(run.summary)):
        text = f": {counted(len(rows), 'curve')} compared with measured points."
        yield element("span", link("measured", "Measured"), text)


# --- sections -----------------------------------------------------------------------------------


def _outline(run: ReportData) -> Html:
    return table(["", ""], [[name, typeset(text)] for name, text in run.case.outline()])


def _warnings(warnings: Sequence[str]) -> Html:
    """Return a list of warnings and what their codes mean.

    A warning that applies to several places appears once.
    """
    places: dict[str, list[str]] = {}
    parts = [warning.partition(": ") for warning in warnings]
    alike = Counter(rest for _, _, rest in parts)
    for warning, (place, colon, rest) in zip(warnings, parts, strict=True):
        if not colon or (" " in place and alike[rest] == 1):
            place, rest = "", warning
        places.setdefault(typeset(rest), []).append(typeset(place))
    kinds = kinds_in(warnings)
    texts = (
        element("span", element("strong", "; ".join(those)), ": ", rest) if any(those) else rest
        for rest, those in ((_linked(text, kinds), at) for text, at in places.items())
    )
    return lines([items(texts), *_explained(kinds)]) if places else Html("")


def _linked(text: str, kinds: Sequence[WarningKind]) -> Html:
    """Return the text of a warning, whose codes lead to their explanations."""
    shown = html(text)
    for kind in kinds:
        shown = Html(shown.replace(kind.code, link(kind.code, kind.code)))
    return shown


def _explained(kinds: Sequence[WarningKind]) -> Iterator[Html]:
    """Yield a table of what the codes of the warnings mean, and what to do."""
    rows = [
        [element("span", kind.code, id=kind.code), f"{kind.title}. {kind.meaning}", kind.remedy]
        for kind in kinds
    ]
    if rows:  # warnings of older versions have no codes
        yield element("h3", "What the warnings mean")
        yield table(["code", "meaning", "what to do"], rows, stacks=True)


def _verdicts(run: ReportData) -> list[Verdict | str]:
    """Return the verdict on each expectation, or the reason why there is no number to compare."""
    found: list[Verdict | str] = []
    for entry in run.case.expect:
        try:
            found.append(verdict_of(entry, run.summary))
        except QuantityError as error:
            found.append(str(error))
    return found


def _expectations(run: ReportData) -> Html:
    found = _verdicts(run)
    if not found:
        return Html("")
    quantities = analysis_of(run.case).quantities(run.case, run.summary)
    names = {counted_from_first(run.summary, quantity.path): quantity for quantity in quantities}
    rows = []
    for entry, verdict in zip(run.case.expect, found, strict=True):
        quantity = names.get(counted_from_first(run.summary, entry.quantity))
        name = code(entry.quantity)
        if quantity is not None:
            name = element("span", f"{number(quantity.group)}: {quantity.name}")
        source = f"{entry.source} ({entry.kind.replace('_', ' ')})"
        rows.append([name, *_verdict_cells(verdict, quantity), source])
    head = ["", "expected", "computed", "off by", "allowed", "", "expected from"]
    signs = any(entry.quantity.startswith(SIGNS) for entry in run.case.expect)
    explained = (
        note("For a change or trend, 1 is a rise, −1 a fall, and 0 neither.") if signs else ""
    )
    return lines([table(head, rows, numbers=(1, 2, 3, 4), stacks=True), html(explained)])


def _verdict_cells(verdict: Verdict | str, quantity: SummaryQuantity | None) -> list[object]:
    if isinstance(verdict, str):
        return ["", "", "", "", element("span", verdict, cls="bad")]
    met = (
        element("span", "met", cls="good") if verdict.met else element("span", "missed", cls="bad")
    )
    tolerance = verdict.entry.tolerance
    expected = _as_expected(verdict.expected, verdict.unit, quantity, GIVEN)
    computed = _as_expected(verdict.computed, verdict.unit, quantity, tolerance)
    # A limit is not rounded. The error of an expected value 0 is absolute.
    scale, mark = (100.0, " %") if verdict.expected else (1.0, "")
    off = readable(scale * verdict.error, "1", 1.0)
    errors = f"{off}{mark}", f"{scale * tolerance:.{ALL_DIGITS}g}{mark}"
    return [*(unbroken(number(text)) for text in (expected, computed, *errors)), met]


def _as_expected(
    value: float, unit: str, quantity: SummaryQuantity | None, tolerance: float
) -> str:
    """Return a value in the unit of the expectation, or, for a bare number, of the quantity.

    Its digits are those that the tolerance decides on.
    """
    if unit or quantity is None:
        shown = readable(value, "1", tolerance, most=ALL_DIGITS).number
        return f"{shown} {pretty(unit)}".strip()
    return str(readable(value, quantity.unit, tolerance, quantity.everyday, ALL_DIGITS))


def _measured(summary: Mapping[str, Any]) -> Html:
    found = list(_compared(summary))
    rows = [_measured_cells(one) for one in found]
    if not rows:
        return Html("")
    head = ["", "points", "mean", "rms", "rms, relative", "chi² per point", "most at", "from"]
    explained = (
        "Computed minus measured, with straight lines between computed points. Relative is over "
        "the rms of what was measured. A chi² of 1 is the scatter that the deviations give."
    )
    if any(one["nearest_of_several_branches"] for one in found):
        explained += (
            " Of several branches of a curve the nearest one counts, so the difference may be "
            "too small."
        )
    return lines(
        [table(head, rows, numbers=(1, 2, 3, 4, 5, 6), stacks=True), html(note(explained))]
    )


def _compared(summary: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield the comparisons with measured points that were possible."""
    yield from (one for one in summary.get("measured", ()) if "rms_deviation" in one)


def _measured_cells(one: Mapping[str, Any]) -> list[object]:
    share, chi = one["relative_rms_deviation"], one.get("reduced_chi_square")
    outside, everyday = len(one["outside"]), everyday_unit(one["unit"], one["curve"])
    count = f"{one['points']}" + (f" (and {outside} outside)" if outside else "")
    return [
        number(one["curve"]),
        count,
        unbroken(number(str(readable(one["mean_deviation"], one["unit"], None, everyday)))),
        unbroken(number(str(readable(one["rms_deviation"], one["unit"], None, everyday)))),
        "–" if share is None else percent(share),
        "–" if chi is None else f"{chi:.3g}",
        unbroken(number(str(readable(one["largest"]["at"], one["at_unit"])))),
        one["source"],
    ]


def _figures(run: ReportData) -> Iterator[Html]:
    for name, svg in run.figures.items():
        yield picture(svg, name, name.replace("_", " ").capitalize())
    if not run.figures:
        yield note(
            "The run drew no figures (output.figures); ",
            element("code", "fretscale report DIR"),
            " draws them into this page.",
        )


def _remarks(summary: Mapping[str, Any]) -> Html:
    """Return the explanations that the analysis gives in sentences."""
    texts = [typeset(f"{text[:1].upper()}{text[1:]}.") for text in summary.get("explanation") or ()]
    return items(texts) if texts else Html("")


def _case(run: ReportData) -> Iterator[Html]:
    """Yield the entries of the case that differ from their defaults, in two parts."""
    leaves = [
        leaf for leaf in leaves_of(run.case) if leaf.is_shown and _top(leaf) not in NOT_LISTED
    ]
    first = [leaf for leaf in leaves if _top(leaf) in LOOKED_FOR]
    assumed = run.case.assumed
    if first:
        yield _entries(first, assumed)
    rest = [leaf for leaf in leaves if leaf not in first]
    if rest:
        yield folded("Structure, mesh, contact and methods", _entries(rest, assumed))
    yield note("Entries that are not listed have their default values; the case file has all.")
    if assumed:
        yield element("h3", "Assumed")
        yield element(
            "p",
            "Not printed by the source of this case, but chosen by the author of the case "
            "(marked * above): ",
            Html(", ".join(map(code, assumed))),
            ".",
        )


def _top(leaf: Leaf) -> str:
    return leaf.path.partition(".")[0]


def _entries(leaves: Sequence[Leaf], assumed: Sequence[str]) -> Html:
    rows: list[list[object]] = []
    for name, those in groupby(leaves, _top):
        listed = list(those)
        if len(listed) > 1 or "." in listed[0].path:
            rows.append([name.replace("_", " ")])
        for leaf in listed:
            below = leaf.path.partition(".")[2] or name
            star = "*" if any(f"{leaf.path}.".startswith(f"{path}.") for path in assumed) else ""
            name_of = element("span", code(below), star)
            rows.append([name_of, _unbroken(given(leaf.text)), leaf.what])
    return table(["", "", ""], rows, stacks=True)


def _unbroken(text: str) -> object:
    """Return a text, marked to stay in one line if it is short."""
    return element("span", text, cls="short") if len(text) < SHORT else text


def _choice(summary: Mapping[str, Any]) -> Iterator[Html]:
    choice = summary.get("choice")
    if not choice:
        return
    yield element(
        "p",
        f"Probes of {choice['seconds']:.3g} s chose the open settings for an accuracy of "
        f"{percent(choice['accuracy'])}: estimated error {percent(choice['estimated_error'])}, "
        f"{'within' if choice['met'] else 'not within'} every share of it.",
    )
    rows = (
        [
            code(decision["entry"]),
            given(_chosen(decision["value"])),
            *(_share(decision[key]) for key in ("error", "allowed")),
            typeset(decision["why"]),
        ]
        for decision in choice["decisions"]
    )
    head = ["", "chosen", "estimated error", "of", "why"]
    yield table(head, rows, numbers=(2, 3), stacks=True)


def _chosen(value: Any) -> str:
    return in_words(tuple(value) if isinstance(value, list) else value, None)


def _share(share: float | None) -> str:
    return "–" if share is None else percent(share)


def _computing(run: ReportData) -> Iterator[Html]:
    yield element("p", "To compute it again, save the case file below as case.yaml and run:")
    yield element("pre", "fretscale run case.yaml --out DIR")
    if run.input_files:
        yield element("p", "Files named in the case, which are not on this page:")
        yield items(
            element("span", element("code", PurePath(name).name), f" (SHA-256 {digest[:DIGEST]}…)")
            for name, digest in run.input_files.items()
        )
    versions = ", ".join(f"{name} {text}" for name, text in run.summary["versions"].items())
    yield element("p", f"Versions: {versions}.")


def _seconds(seconds: Mapping[str, float]) -> Html:
    rows = [[name, f"{value:,.1f} s"] for name, value in seconds.items() if value >= AT_ONCE]
    whole = [element("strong", "all"), element("strong", f"{sum(seconds.values()):,.1f} s")]
    return table(["stage", "time"], [*rows, whole], numbers=(1,))
