"""Self-contained HTML pages: their style and the elements that they consist of.

Pages have no scripts and no external links; figures are vector graphics within the page. Text is
escaped unless it is an :class:`Html`.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from html import escape, unescape
from pathlib import Path

GENERATOR = "fretscale"
STYLE = Path(__file__).with_name("page.css")


# Beginning of a section or a figure: its name, and its heading or what its image shows.
TITLED = re.compile(r'<(?:section|figure) id="([^"]+)"><(?:h2>([^<]*)|img alt="([^"]*)")')


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


def key_of(title: str) -> str:
    """Return the name of a section or figure, to which a link may lead."""
    return re.sub(r"\W+", "-", title.lower()).strip("-")


def section(title: str, *inside: object) -> Html:
    """Return a section with its heading; empty if it has no content."""
    if not any(inside):
        return Html("")
    return element("section", element("h2", title), *inside, id=key_of(title))


def link(key: str, text: object) -> Html:
    """Return a link to a part of the page."""
    return element("a", text, href=f"#{key}")


def contents_of(parts: Iterable[Html]) -> Html:
    """Return the table of contents: links to the sections, and below each to its figures."""
    entries = []
    for part in filter(None, parts):
        (key, title), *figures = (
            (key, Html(text or alt)) for key, text, alt in TITLED.findall(part)
        )
        below = items(link(*figure) for figure in figures) if figures else ""
        entries.append(element("span", link(key, title), below))
    return element("nav", element("h2", "Contents"), items(entries))


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


def picture(svg: str, name: str, caption: str = "") -> Html:
    """Return a figure given as SVG, to which its ``name`` leads, with a caption if there is one.

    It is embedded as a separate image, because names within one SVG would conflict with others.
    """
    source = base64.b64encode(_trimmed(svg).encode("utf-8")).decode("ascii")
    image = f'<img alt="{escape(title_of(svg))}" src="data:image/svg+xml;base64,{source}">'
    below = element("figcaption", caption) if caption else ""
    return element("figure", Html(image), below, id=figure_key(name))


def figure_key(name: str) -> str:
    """Return the name to which a link to a figure leads."""
    return f"figure-{key_of(name)}"


def title_of(svg: str) -> str:
    """Return the title of a figure given as SVG."""
    found = re.search(r"<title>(.*?)</title>", svg, re.DOTALL)
    return " ".join(unescape(found[1]).split()) if found else ""


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
