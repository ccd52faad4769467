"""Mutants of the shipped cases and of the templates.

A mutant is determined by its number: the same number makes the same mutant again.
"""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML

from tests.conftest import CASES
from workflow.kinds import kinds, template

Path = tuple[str | int, ...]

# Values of every kind that a case may meet at any place. Texts that begin with "=" stand without
# quotes, as YAML reads them.
VALUES: tuple[Any, ...] = (
    *(None, True, False, "", " ", [], {}, [[]], [{}], {"a": 1}, [None], [1, [2, [3]]]),
    *(0, 1, -1, 2, 3, 7, 10**5, -(10**9), 10**20, 10**400, 0.0, -0.0, 0.5, -2.5, 1e-300, 1e300),
    *("=.nan", "=.inf", "=-.inf", "=1e999", "=1e-400", "=0x1F", "=0o17", "=1_000", "=+5", "=.5"),
    *("=2020-01-01", "=2020-01-01 12:30:00", "=12:30:45", "=yes", "=~", "=!!str 5", "=!odd 5"),
    *("=!!binary aGk=", "=!!set {a, b}", "=!!float abc", "=!!int 1.5", "=!!timestamp x"),
    *("=<<", "=*a", "=&a 5", "=? a", "=- b", "=%", "=@x", "=`x`", "=|\n  text", "=>-\n  text"),
    *("={", "=]", "=- -"),
    *("1 mm", "-1 mm", "0 mm", "1e300 mm", "1e-300 mm", "1e999 mm", "-1e999 N", "5 N", "3 GPa"),
    *("20 Hz", "45 deg", "2 %", "-3 %", "300 %", "1e4 um^3/J", "9 furlong", "5 degC", "3 dB"),
    *("1 m**m", "1 mm^-1", "1 mm^1e9", "1 mm^99999999", "1 m^m", "1 /mm", "1 mm/", "1 mm//s"),
    *("1 mm mm", "1 (mm", "1 mm)", "1 1", "1 %%", "1 nan", "1 inf", "nan mm", "inf mm", "1,5 mm"),
    *("1 mm ", "  1   mm", "1 µm", "1 μm", "1 Å", "1 °", "１ mm", "٣ mm", "1 mm²", "1 delta_degC"),
    *("1 __import__('os')", "1 mm if 1", "1 lambda", "1 mm # no", "1e5", "1e", "e5", "--1 mm"),
    *("text", "TEXT", "a.b", "a..b", ".", "..", "/", "\\", "'", '"', "{", "}", "%s", "{0}", "{x}"),
    *("a\nb", "a\tb", "a\rb", "a\x00b", "a\x1bb", "a\u200bb", "\u202eabc", "\ud7ff", "\U0001f600"),
    *("x" * 5000, "1" * 5000 + " mm", "1 " + "m" * 5000, "9" * 400, "a." * 3000 + "a"),
    *("wear", "contact", "time", "vibration", "auto", "full", "normal", "rigid", "dovetail"),
    *("mesh", "rig", "joint", "bodies", "sphere", "heights", "reduced", "energy", "archard"),
    *("none.yaml", "none.csv", "none.h5:x", ".", "/", "/dev/null", "x" * 300 + ".csv"),
    *("dovetail.yaml", "sphere_wear.yaml", "specimens_rig.yaml", "specimens_wear.yaml"),
    *("loads.csv", "joint.msh"),
    *([1, 2], [2, 1], [1, 1], [0, 0], [-1, 1], [1.0, 2.0, 3.0], ["1 mm", "2 mm"], ["a"], [True]),
    *([1e300, 1e300], [1e-300, 1e-300], [4096, 4096], [8, 8], list(range(200)), ["1 N"] * 150),
    *(list(range(3000)), {f"k{n}": n for n in range(300)}, [{"a": n} for n in range(200)]),
)  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """Case with a random change, which ``reported`` describes to find the cause of a failure."""

    number: int
    text: bytes
    reported: str


def sources() -> dict[str, str]:
    """Return the texts that mutants are made from: all shipped cases and all templates."""
    shipped = {path.name: path.read_text(encoding="utf-8") for path in sorted(CASES.glob("*.yaml"))}
    return shipped | {f"template {kind}": template(kind) for kind in kinds()}


class Mutants:
    """Generator of mutants of texts by their numbers."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self._texts = texts
        yaml = YAML(typ="safe", pure=True)
        self._trees = {name: yaml.load(text) for name, text in self._texts.items()}

    def __getitem__(self, number: int) -> Mutant:
        chance = random.Random(number)
        name = chance.choice(list(self._texts))
        tree, reported = copy.deepcopy(self._trees[name]), []
        for _ in range(chance.choice((1, 1, 1, 2, 3))):
            reported.append(self._change(chance, tree))
        text = written(tree).encode("utf-8", "surrogatepass")
        return Mutant(number, text, f"{name}: {', '.join(reported)}")

    def _change(self, chance: random.Random, tree: Any) -> str:
        """Change a tree of plain data; return a short description."""
        path = chance.choice(list(places(tree)))
        holder, key = _at(tree, path[:-1]), path[-1]
        how = chance.choices(
            ("value", "delete", "swap", "splice", "rename", "add", "scale", "wrap", "repeat"),
            (8, 3, 2, 3, 3, 2, 4, 1, 1),
        )[0]
        if how == "value":
            holder[key] = copy.deepcopy(chance.choice(VALUES))
        elif how == "delete":
            del holder[key]
        elif how == "swap":
            other = chance.choice(list(places(tree)))
            with_it = _at(tree, other[:-1])
            one, two = copy.deepcopy(holder[key]), copy.deepcopy(with_it[other[-1]])
            holder[key], with_it[other[-1]] = two, one
        elif how == "splice":
            donor = self._trees[chance.choice(list(self._trees))]
            same = [p for p in places(donor) if p[-1] == key]
            taken = chance.choice(same if same and chance.random() < 0.7 else list(places(donor)))
            holder[key] = copy.deepcopy(_at(donor, taken))
        elif how == "rename" and isinstance(holder, dict):
            holder[_misspelt(chance, str(key))] = holder.pop(key)
        elif how == "add" and isinstance(holder, dict):
            holder[chance.choice(("", "a.b", "=5", "=[1]", "ü", "x" * 3000))] = copy.deepcopy(
                chance.choice(VALUES)
            )
        elif how == "scale":
            holder[key] = _scaled(chance, holder[key])
        elif how == "wrap":
            holder[key] = chance.choice(([holder[key]], {str(key): holder[key]}))
        elif isinstance(holder, list):
            holder[:] = holder * chance.choice((2, 30))
        return f"{how} {'.'.join(map(str, path))}"


def _at(tree: Any, path: Path) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def places(tree: Any, path: Path = ()) -> Iterator[Path]:
    """Yield the paths of all entries."""
    items: Any = tree.items() if isinstance(tree, dict) else ()
    items = enumerate(tree) if isinstance(tree, list) else items
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def _misspelt(chance: random.Random, key: str) -> str:
    place = chance.randrange(len(key) + 1)
    return chance.choice(
        (key[:place] + key[place + 1 :], key[:place] + "q" + key[place:], key.upper(), key + " ")
    )


def _scaled(chance: random.Random, value: Any) -> Any:
    """Return a number or quantity that is larger or smaller, or has another sign or unit."""
    factor = chance.choice((0, -1, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 2, 10, 1e3, 1e6, 1e12))
    if isinstance(value, bool) or value is None or isinstance(value, dict):
        return value
    if isinstance(value, list):
        return [_scaled(chance, item) for item in value]
    if isinstance(value, int):
        return int(value * factor) if factor < 1e9 else value + 1
    if isinstance(value, float):
        return value * factor
    number, _, unit = value.partition(" ")
    try:
        return (
            f"{float(number) * factor!r} {chance.choice((unit, unit, unit, 'mm', 'N', 'GPa', '%'))}"
        )
    except ValueError:
        return value[::-1]


# --- as YAML --------------------------------------------------------------------------------------


def written(tree: Any, indent: str = "") -> str:
    """Return the tree as YAML, with each entry on its own line."""
    if isinstance(tree, dict) and tree:
        return "".join(_entry(f"{_scalar(key)}:", value, indent) for key, value in tree.items())
    if isinstance(tree, list) and any(isinstance(item, dict) for item in tree):
        return "".join(_entry("-", item, indent) for item in tree)
    return f"{indent}{_scalar(tree)}\n"


def _entry(start: str, value: Any, indent: str) -> str:
    nested = isinstance(value, dict) or (
        isinstance(value, list) and any(isinstance(item, dict) for item in value)
    )
    if nested and value:
        return f"{indent}{start}\n{written(value, indent + '  ')}"
    return f"{indent}{start} {_scalar(value)}\n"


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        return value[1:] if value.startswith("=") else json.dumps(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_scalar, value))}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar(k)}: {_scalar(v)}" for k, v in value.items()) + "}"
    if isinstance(value, int) and abs(value) > 10**300:
        return "9" * 400
    if isinstance(value, float) and value != value:
        return ".nan"
    if isinstance(value, float) and abs(value) == float("inf"):
        return ".inf" if value > 0 else "-.inf"
    return json.dumps(value, default=str)
