"""Reference of warnings and errors, generated from their registry when the pages are built.

There is a page for every area, with a section and an anchor for every code: ``#fs-w102``. Nothing
is written by hand: a new kind of message appears on its page with the next build.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from workflow.messages.error_kinds import ErrorKind
from workflow.messages.kinds import MessageKind
from workflow.messages.warning_kinds import WarningKind

if TYPE_CHECKING:
    from sphinx.application import Sphinx

# Pages with the beginning of their codes and their titles.
PAGES = {
    "input": ("FS-W0", "Warnings about the input"),
    "contacts": ("FS-W1", "Warnings about contacts"),
    "structures": ("FS-W2", "Warnings about structures"),
    "wear": ("FS-W3", "Warnings about wear"),
    "vibration": ("FS-W4", "Warnings about vibration and time"),
    "measurements": ("FS-W5", "Warnings about fits and measurements"),
    "files": ("FS-W9", "Warnings about files and processes"),
    "errors": ("FS-E", "Errors"),
}


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writing of the pages before Sphinx looks for sources."""
    app.connect(
        "builder-inited", lambda app: write_pages(Path(app.srcdir) / "reference" / "messages")
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages(folder: Path) -> None:
    """Write a page for every area; unchanged pages keep their modification time."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PAGES:
        page, text = folder / f"{name}.md", message_page(name)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def message_page(name: str) -> str:
    """Return the page of one area, in MyST."""
    beginning, title = PAGES[name]
    kinds: list[MessageKind] = [*WarningKind, *ErrorKind]
    sections = [section(kind) for kind in kinds if kind.code.startswith(beginning)]
    return "\n\n".join([f"# {title}", *sections]) + "\n"


def section(kind: MessageKind) -> str:
    """Return the section of one kind of message, below its anchor."""
    head = f"({kind.code.lower()})=\n## {kind.code}: {kind.title}"
    return f"{head}\n\n{kind.meaning}\n\n**Remedy:** {kind.remedy}"
