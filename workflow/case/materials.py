"""Materials that a case may name instead of giving their numbers, each with its source."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass


@dataclass(frozen=True)
class KnownMaterial:
    """Young's modulus [GPa], Poisson's ratio, density [kg/m^3] and yield stress [MPa] at 20 °C.

    ``yield_stress`` is None where none is known, ``state`` is the condition that the values hold
    for, ``also`` are other names of the material.
    """

    young: float
    poisson: float
    density: float
    yield_stress: float | None
    state: str
    source: str
    also: tuple[str, ...] = ()

    def in_base_units(self) -> dict[str, float | None]:
        """Return the values as entries of a case, in MPa, 1, t/mm^3 and MPa."""
        return {
            "young": 1e3 * self.young,
            "poisson": self.poisson,
            "density": float(f"{self.density}e-12"),
            "yield_stress": self.yield_stress,
        }


_SHIGLEY = "Budynas and Nisbett, Shigley's Mechanical Engineering Design, table A-5"
_STAINLESS = (
    "EN 10088-1 (Young's modulus, density), EN 1993-1-4 (Poisson's ratio), ASTM A240 (least yield "
    "stress)"
)
_ALUMINIUM = (
    "Aluminum Association, Aluminum Standards and Data (typical); Poisson's ratio MIL-HDBK-5"
)

MATERIALS = {
    "Ti-6Al-4V": KnownMaterial(
        *(113.8, 0.342, 4430, 880, "annealed"),
        "ASM International, Materials Properties Handbook: Titanium Alloys (1994)",
        ("Ti64", "TA6V", "Grade 5", "3.7165"),
    ),
    "Inconel 718": KnownMaterial(
        *(200.0, 0.29, 8190, 1034, "solution treated and aged, least yield stress"),
        "Special Metals SMC-045 (elasticity, density), AMS 5663 (yield stress)",
        ("IN718", "Alloy 718", "2.4668"),
    ),
    "100Cr6": KnownMaterial(
        *(210.0, 0.3, 7830, None, "hardened; give the yield stress yourself"),
        "Lucefin, technical card 100Cr6 to EN ISO 683-17 (elasticity); balls of AISI 52100, "
        "0.283 lb/in^3 (density)",
        ("52100", "AISI 52100", "SUJ2", "1.3505"),
    ),
    "42CrMo4": KnownMaterial(
        *(207.0, 0.292, 7800, 750, "quenched and tempered, 16 to 40 mm, least yield stress"),
        f"{_SHIGLEY} (carbon steel), EN 10083-3 (yield stress)",
        ("4140", "AISI 4140", "42CD4", "1.7225"),
    ),
    "AISI 1045": KnownMaterial(
        *(207.0, 0.292, 7800, 310, "hot rolled"),
        f"{_SHIGLEY} and table A-20 (yield stress)",
        ("C45", "1045", "XC48", "1.0503"),
    ),
    "304L": KnownMaterial(
        *(200.0, 0.3, 7900, 170, "annealed"),
        _STAINLESS,
        ("AISI 304L", "X2CrNi18-9", "1.4307"),
    ),
    "316L": KnownMaterial(
        *(200.0, 0.3, 8000, 170, "annealed"),
        _STAINLESS,
        ("AISI 316L", "X2CrNiMo17-12-2", "1.4404"),
    ),
    "7075-T6": KnownMaterial(
        *(71.7, 0.33, 2810, 503, "solution treated and aged"),
        _ALUMINIUM,
        ("7075", "AA 7075", "Al 7075"),
    ),
    "2024-T351": KnownMaterial(
        *(73.1, 0.33, 2780, 324, "solution treated, stretched, naturally aged"),
        _ALUMINIUM,
        ("2024", "AA 2024", "Al 2024"),
    ),
    "Al2O3": KnownMaterial(
        *(416.0, 0.231, 3984, None, "sintered, dense: balls against which metals are worn"),
        "Munro 1997, J. Am. Ceram. Soc. 80, 1919, doi 10.1111/j.1151-2916.1997.tb03074.x",
        ("alumina", "corundum"),
    ),
}


def near(name: str) -> str | None:
    """Return the known material whose name, or alternative name, is closest to ``name``."""
    names = {
        _plain(called): key for key, known in MATERIALS.items() for called in (key, *known.also)
    }
    match = difflib.get_close_matches(_plain(name), names, n=1)
    return names[match[0]] if match else None


def _plain(name: str) -> str:
    """Return the name in lower case with letters and digits only."""
    return re.sub(r"[^a-z0-9]", "", name.lower())
