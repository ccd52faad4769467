"""Factors of an excitation: the amplitude of a force, or the level of several parts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ExcitationSize:
    """Factor of the excitation, with its ``name``, ``unit`` and ``description``."""

    name: str
    unit: str
    description: str

    @property
    def receptance(self) -> tuple[str, str]:
        """Unit of an amplitude divided by the factor, as computed and as shown in figures."""
        return ("mm/N", "µm/N") if self.unit == "N" else ("mm", "µm")

    def as_text(self, number: float) -> str:
        """Return the factor with its unit or name, as text."""
        return f"{number:g} N" if self.unit == "N" else f"{self.name} {number:g}"

    def under(self, number: float) -> str:
        """Return the text "under" or "at" this factor, for what happens there."""
        return f"{'under' if self.unit == 'N' else 'at'} {self.as_text(number)}"


FORCE = ExcitationSize("force", "N", "amplitude of the force")
LEVEL = ExcitationSize("level", "1", "level by which the excitation is multiplied")
