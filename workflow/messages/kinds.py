"""Base class of the kinds of messages, each with a stable code and an explanation."""

from __future__ import annotations

import re
from enum import Enum

PATTERN = re.compile(r"FS-[EW]\d{3}")


class MessageKind(Enum):
    """Kind of message: a code, a title, what it means and affects, and what to do.

    A code leads to the section of the documentation and to the text of ``fretscale explain``. The
    number of a kind that no longer exists is never used again, because old results contain it.
    """

    def __init__(self, code: str, title: str, meaning: str, remedy: str) -> None:
        self.code, self.title, self.meaning, self.remedy = code, title, meaning, remedy

    def marked(self, text: str) -> str:
        """Return a message of this kind as it is shown, with its code at the end."""
        return f"{text} [{self.code}]"
