"""Self-contained HTML pages: their style and the elements that they consist of.

Pages have no scripts and no external links; figures are vector graphics within the page. Text is
escaped unless it is an :class:`Html`.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

GENERATOR = "fretscale"
STYLE = Path(__file__).with_name("page.css")


class Html(str):
    """Text that is already HTML."""

    __slots__ = ()


def html(text: object) -> Html:
    """Return a text as HTML; HTML is returned unchanged."""
    return text if isinstance(text, Html) else Html(escape(str(text)))


def element(tag: str, *inside: object, **attributes: str) -> Html:
    """Return an element around texts and elements; the argument ``cls`` sets its class."""
    named = {name.replace("cls", "class"): value for name, value in attributes.items()}
    given = "".join(f' {name}="{escape(value)}"' for name, value in named.items())
    return Html(f"<{tag}{given}>{''.join(map(html, inside))}</{tag}>")


def lines(parts: Iterable[Html]) -> Html:
    """Return elements one below the other."""
    return Html("\n".join(parts))


def section(title: str, *inside: object, key: str = "") -> Html:
    """Return a section with its heading; empty if it has no content."""
    if not any(inside):
        return Html("")
    name = key or re.sub(r"\W+", "-", title.lower()).strip("-")
    return element("section", element("h2", title), *inside, id=name)


def contents_of(parts: Sequence[Html]) -> Html:
    """Return links to the sections."""
    links = []
    for part in filter(None, parts):
        name = part.split('id="', 1)[1].split('"', 1)[0]
        title = part.split("<h2>", 1)[1].split("</h2>", 1)[0]
        links.append(element("a", Html(title), href=f"#{name}"))
    return element("nav", Html(" ".join(links)))


def folded(title: str, *inside: object) -> Html:
    """Return content that is collapsed on the screen and open in print."""
    return element("details", element("summary", title), *inside)


def items(texts: Iterable[object]) -> Html:
    """Return a list."""
    return element("ul", *(element("li", text) for text in texts))


def table(
    head: Sequence[object],
    rows: Iterable[Sequence[object]],
    numbers: Sequence[int] = (),
    stacks: bool = False,
) -> Html:
    """Return a table; the first cell of each row is a heading; align columns ``numbers`` right.

    A row of one cell spans all columns. Wide tables scroll separately; with ``stacks``, the cells
    of a row are placed below each other on narrow screens.
    """
    labels = [str(text) for text in head] if stacks else [""] * len(head)
    titles = element(
        "tr", *(_cell("th", text, n in numbers, scope="col") for n, text in enumerate(head))
    )
    body = lines(_row(row, labels, numbers) for row in rows)
    top = element("thead", titles) if any(head) else Html("")
    return element(
        "div", element("table", top, element("tbody", body)), cls="stacks" if stacks else "wide"
    )


def _row(row: Sequence[object], labels: Sequence[str], numbers: Sequence[int]) -> Html:
    if len(row) == 1:
        return element(
            "tr", element("th", row[0], colspan=str(len(labels)), scope="colgroup", cls="group")
        )
    first, *rest = row
    others = (
        _cell("td", text, n in numbers, **({"data-label": labels[n]} if labels[n] else {}))
        for n, text in enumerate(rest, 1)
    )
    return element("tr", _cell("th", first, 0 in numbers, scope="row"), *others)


def _cell(tag: str, text: object, number: bool, **attributes: str) -> Html:
    return element(tag, text, **attributes, **({"cls": "number"} if number else {}))


def unbroken(text: str) -> Html:
    """Return a text that is not broken into lines, such as a number with its unit."""
    return element("span", text, cls="short")


def code(path: str) -> Html:
    """Return a name of a case or a summary, which may be broken after its parts."""
    return element("code", Html(re.sub(r"([._])", r"\1<wbr>", escape(path))))


def note(*inside: object) -> Html:
    """Return an explanation in small type."""
    return element("p", *inside, cls="note")


def picture(svg: str, what: str, captioned: bool = True) -> Html:
    """Return a figure given as SVG; ``what`` is its caption unless the figure has a title itself.

    It is embedded as a separate image, because names within one SVG would conflict with others.
    """
    source = base64.b64encode(_trimmed(svg).encode("utf-8")).decode("ascii")
    image = f'<img alt="{escape(what)}" src="data:image/svg+xml;base64,{source}">'
    return element("figure", Html(image), element("figcaption", what) if captioned else Html(""))


def _trimmed(svg: str) -> str:
    """Return an SVG text without its metadata, which only other programs read."""
    return re.sub(r"\s*<metadata>.*?</metadata>", "", svg, count=1, flags=re.DOTALL)


def page(title: str, *inside: object) -> str:
    """Return a complete page."""
    style = STYLE.read_text("utf-8")
    head = lines(
        [
            Html('<meta charset="utf-8">'),
            Html('<meta name="viewport" content="width=device-width, initial-scale=1">'),
            Html(f'<meta name="generator" content="{GENERATOR}">'),
            element("title", title),
            Html(f"<style>\n{style}</style>"),
        ]
    )
    body = element("main", lines(filter(None, map(html, inside))))
    top = f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n'
    return f"{top}<body>\n{body}\n</body>\n</html>\n"
