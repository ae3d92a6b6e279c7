"""What a value in a scene may be. Each rule reads a raw value, and writes it back as plain data.

Whatever a rule refuses is a ValueError that names the key, the value and what is allowed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from math import inf
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

LARGEST = 1e300  # numbers beyond count as infinite


class Rule:
    """A rule of the scene's grammar."""

    def read(self, value: Any, key: str, folder: Path) -> Any:
        """The checked value; `folder` is where relative paths begin."""
        raise NotImplementedError

    def write(self, value: Any) -> Any:
        """Plain data that `read` takes back."""
        return list(value) if isinstance(value, tuple) else value

    def keys(self) -> "Mapping[str, Rule]":
        """The keys that a value can have, each with its rule; none where it is no table."""
        return {}


def refuse(key: str, value: Any, allowed: str) -> ValueError:
    """The error for a value that is not allowed."""
    return ValueError(f"{key} is {value!r}; allowed: {allowed}")


@dataclass(frozen=True)
class Number(Rule):
    """A finite number from `low` to `high`; `above` and `below` leave out the ends themselves."""

    low: float = -inf
    high: float = inf
    unit: str = ""
    above: bool = False
    below: bool = False
    whole: bool = False

    def read(self, value, key, folder):
        kind = Integral if self.whole else Real
        if isinstance(value, bool) or not isinstance(value, kind):
            raise refuse(key, value, self.allowed() if self.whole else f"a number {self.allowed()}")
        if isinstance(value, np.floating):
            value = float(value)  # the bounds are no numbers of smaller types
        if not -LARGEST < value < LARGEST:
            raise refuse(key, value, f"a finite number {self.allowed()}")
        too_low = value <= self.low if self.above else value < self.low
        too_high = value >= self.high if self.below else value > self.high
        if too_low or too_high:
            raise refuse(key, value, self.allowed())
        return int(value) if self.whole else float(value)

    def allowed(self) -> str:
        """The range in words."""
        what = "a whole number" if self.whole else ""
        low = f"{'>' if self.above else '>='} {self.low:g}" if self.low > -inf else ""
        high = f"{'<' if self.below else '<='} {self.high:g}" if self.high < inf else ""
        span = " and ".join(part for part in (low, high) if part)
        unit = self.unit if span or not self.unit else f"in {self.unit}"
        return " ".join(part for part in (what, span, unit) if part)


@dataclass(frozen=True)
class Span(Rule):
    """A number, or [least, most]; kept as (least, most)."""

    number: Number

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple):
            value = (value, value)
        if len(value) != 2:
            raise refuse(key, value, self.allowed())
        low, high = (self.number.read(end, key, folder) for end in value)
        if low > high:
            raise refuse(key, list(value), f"{self.allowed()}, least <= most")
        return low, high

    def allowed(self) -> str:
        """The range in words."""
        return f"{self.number.allowed()}, one number or [least, most]"

    def write(self, value):
        return value[0] if value[0] == value[1] else list(value)


@dataclass(frozen=True)
class Vector(Rule):
    """So many numbers under one rule."""

    count: int
    number: Number = Number(unit="m")

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple) or len(value) != self.count:
            raise refuse(key, value, f"a list of {self.count} numbers {self.number.allowed()}".rstrip())
        return tuple(self.number.read(part, f"{key}[{i}]", folder) for i, part in enumerate(value))


@dataclass(frozen=True)
class Points(Rule):
    """At least three points [[x, y], ...] in metres."""

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple) or len(value) < 3:
            raise refuse(key, value, "at least three points [[x, y], ...] in m")
        return tuple(Vector(2).read(point, f"{key}[{i}]", folder) for i, point in enumerate(value))

    def write(self, value):
        return [list(point) for point in value]


@dataclass(frozen=True)
class Choice(Rule):
    """One of a few words or numbers."""

    words: tuple[str | int, ...]

    def read(self, value, key, folder):
        if value not in self.words:
            raise refuse(key, value, self.allowed())
        return value

    def allowed(self) -> str:
        """The words."""
        return ", ".join(f'"{word}"' if isinstance(word, str) else str(word) for word in self.words)


@dataclass(frozen=True)
class Several(Rule):
    """A list of different words, at least one."""

    choice: Choice

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple) or not value or len(set(map(repr, value))) < len(value):
            raise refuse(key, value, f"a list of different ones of {self.choice.allowed()}")
        return tuple(self.choice.read(word, f"{key}[{i}]", folder) for i, word in enumerate(value))


@dataclass(frozen=True)
class Either(Rule):
    """A word, or something else under a rule."""

    words: Choice
    other: Rule
    meaning: str

    def read(self, value, key, folder):
        if not isinstance(value, str):
            return self.other.read(value, key, folder)
        if value not in self.words.words:
            raise refuse(key, value, f"{self.words.allowed()} or {self.meaning}")
        return value


@dataclass(frozen=True)
class Flag(Rule):
    """true or false."""

    def read(self, value, key, folder):
        if not isinstance(value, bool):
            raise refuse(key, value, "true, false")
        return value


@dataclass(frozen=True)
class Text(Rule):
    """Any text."""

    def read(self, value, key, folder):
        if not isinstance(value, str):
            raise refuse(key, value, "a text")
        return value


@dataclass(frozen=True)
class FilePath(Rule):
    """A path, relative to the scene file's folder or absolute; kept absolute."""

    def read(self, value, key, folder):
        if not isinstance(value, str | Path) or not str(value):
            raise refuse(key, value, "a path to a file")
        return str((folder / Path(value).expanduser()).resolve())


@dataclass(frozen=True)
class Table(Rule):
    """A table of keys, each with its rule; `make` builds the value from them, and has the defaults of keys left out.

    `needed` lists keys without a default; `fields` the attribute's name where it is not the key.
    """

    make: Callable[..., Any]
    rules: Mapping[str, Rule]
    needed: tuple[str, ...] = ()
    fields: Mapping[str, str] | None = None

    def read(self, value, key, folder):
        known_keys(value, key, self.rules)
        for name in self.needed:
            if name not in value:
                raise ValueError(f"{join(key, name)} is missing; needed: {', '.join(self.needed)}")
        return self.make(
            **{
                self.field(name): rule.read(value[name], join(key, name), folder)
                for name, rule in self.rules.items()
                if name in value
            }
        )

    def write(self, value):
        plain = {name: (rule, getattr(value, self.field(name))) for name, rule in self.rules.items()}
        return {name: rule.write(item) for name, (rule, item) in plain.items() if item is not None}

    def keys(self):
        return self.rules

    def field(self, name: str) -> str:
        """The attribute that keeps a key's value."""
        return (self.fields or {}).get(name, name)


@dataclass(frozen=True)
class Kinds(Rule):
    """A table of one of several kinds, told by its key `kind`."""

    tables: Mapping[str, Table]
    default: str | None = None

    def read(self, value, key, folder):
        if not isinstance(value, Mapping):
            raise refuse(key, value, "a table")
        kind = value.get("kind", self.default)
        if kind is None:
            raise ValueError(f"{join(key, 'kind')} is missing; allowed: {Choice(tuple(self.tables)).allowed()}")
        Choice(tuple(self.tables)).read(kind, join(key, "kind"), folder)
        rest = {name: item for name, item in value.items() if name != "kind"}
        return self.tables[kind].read(rest, key, folder)

    def write(self, value):
        return {"kind": value.kind, **self.tables[value.kind].write(value)}

    def keys(self):
        every = {name: rule for table in self.tables.values() for name, rule in table.rules.items()}
        return {"kind": Choice(tuple(self.tables)), **every}


@dataclass(frozen=True)
class Named(Kinds):
    """The same; the kind's name alone stands for a table with nothing else in it."""

    def read(self, value, key, folder):
        if isinstance(value, str):
            Choice(tuple(self.tables)).read(value, key, folder)
            value = {"kind": value}
        return super().read(value, key, folder)


@dataclass(frozen=True)
class Many(Rule):
    """An array of tables."""

    table: Rule

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple):
            raise refuse(key, value, f"an array of tables, [[{key}]]")
        return tuple(self.table.read(item, f"{key}[{i}]", folder) for i, item in enumerate(value))

    def write(self, value):
        return [self.table.write(item) for item in value]


def known_keys(value: Any, key: str, rules: Mapping[str, Rule]) -> None:
    """An error for a key that is not known, with the one that may be meant."""
    if not isinstance(value, Mapping):
        raise refuse(key, value, "a table")
    for name in value:
        if name not in rules:
            close = get_close_matches(str(name), list(rules), n=1)
            hint = f", did you mean {close[0]}?" if close else ""
            raise ValueError(f"{join(key, str(name))} is not known{hint or ';'} known: {', '.join(rules) or 'no keys'}")


def join(key: str, name: str) -> str:
    """The name of a key inside a table."""
    return f"{key}.{name}" if key else name
