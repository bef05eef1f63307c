"""Readings of a text: what it leaves open, choice by choice.

A ledger's `[readings]` has an axis for each thing that is open, and an axis an option for each way
to read it. A reading is one option of every axis; with the first option of all it is the headline.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Annotated, Any

from pydantic import ConfigDict, Field, model_validator

from bench.claims.kinds import Entry, Limits, Text, Value

__all__ = ["ANY", "NO_MATTER", "Axis", "Option", "Reading", "Readings", "in_words"]

NO_MATTER = "*"
"""Stands for every option of an axis."""

ANY = "any"
"""In a column of readings: a row that depends on none and belongs to all."""


class Option(Entry):
    """One way to read something.

    Its other keys are parameters: of the trackers that the axis is over, or, in a table of a
    tracker's name, of that tracker alone.
    """

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, Value | dict[str, Value]]

    post_hoc: bool = False
    where: Limits = Field(default={})

    @property
    def shared(self) -> dict[str, Value]:
        """Parameters of all trackers that the axis is over."""
        return {k: v for k, v in self.__pydantic_extra__.items() if not isinstance(v, dict)}

    def of(self, tracker: str) -> dict[str, Value]:
        """Parameters of one tracker alone; empty for none."""
        own = self.__pydantic_extra__.get(tracker, {})
        return own if isinstance(own, dict) else {}


class Axis(Entry):
    """Ways to read one thing, by name, the headline's first."""

    over: tuple[Text, ...] = ()
    rivals: bool = False
    options: Annotated[dict[str, Option], Field(min_length=1)]

    @model_validator(mode="before")
    @classmethod
    def _options_stand_among_the_keys(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        settings = {key: table[key] for key in ("over", "rivals") if key in table}
        return {**settings, "options": {k: v for k, v in table.items() if k not in settings}}


@dataclass(frozen=True)
class Reading:
    """One option of every axis.

    Attributes
    ----------
    names : mapping of str to str
        Option by axis.
    options : tuple of (Axis, Option)
        The same.
    """

    names: Mapping[str, str]
    options: tuple[tuple[Axis, Option], ...]

    @property
    def post_hoc(self) -> bool:
        """Whether it was chosen after seeing results."""
        return any(option.post_hoc for _, option in self.options)

    def parameters(self, tracker: str) -> dict[str, Value]:
        """What it sets of a tracker."""
        told: dict[str, Value] = {}
        for axis, option in self.options:
            told |= option.shared if tracker in axis.over or not axis.over else {}
            told |= option.of(tracker)
        return told


class Readings(Entry):
    """All axes of a ledger; `usual` are parameters by sequence and tracker, under all others."""

    axes: dict[Text, Axis] = Field(default={})
    usual: dict[Text, dict[Text, dict[Text, Value]]] = Field(default={})

    @property
    def columns(self) -> Mapping[str, tuple[str, ...]]:
        """Names of options by axis, the headline's first."""
        return {name: tuple(axis.options) for name, axis in self.axes.items()}

    @property
    def rivals(self) -> list[str]:
        """Axes none of whose options is the headline."""
        return [name for name, axis in self.axes.items() if axis.rivals]

    @cached_property
    def limits(self) -> frozenset[str]:
        """Columns of tables that readings limit."""
        options = [option for axis in self.axes.values() for option in axis.options.values()]
        return frozenset(key for one in options for key in (*one.where, *one.shared))

    def all(
        self, matters: Callable[[Axis], bool], has: Callable[[Option], bool] = lambda _: True
    ) -> Iterator[Reading]:
        """Every reading by the axes that matter and the options that there are, headline first."""
        axes = {name: axis for name, axis in self.axes.items() if matters(axis)}
        there = (
            [name for name, option in axis.options.items() if has(option)] for axis in axes.values()
        )
        for names in product(*there):
            options = [
                (axis, axis.options[name]) for axis, name in zip(axes.values(), names, strict=True)
            ]
            yield Reading(dict(zip(axes, names, strict=True)), tuple(options))

    def places(self, reading: Reading) -> tuple[str, ...]:
        """Options in the order of all axes; `NO_MATTER` for an axis that has none."""
        return tuple(reading.names.get(axis, NO_MATTER) for axis in self.axes)

    def is_headline(self, names: Mapping[str, str]) -> bool:
        """Whether it is the first of all readings; rivals are equal."""
        return all(
            names.get(axis, options[0]) == options[0] or axis in self.rivals
            for axis, options in self.columns.items()
        )


def in_words(metric: str) -> str:
    """A metric's name as it is read, with the frames that it is of: `error_1_16`, `within_11`."""
    words = re.sub(r" (\d+)(?: to)? (\d+)$", r" in frames \1 to \2", metric.replace("_", " "))
    return re.sub(r"^(\D*[^ \d])(?<! at) (\d+(?: and \d+)*)$", r"\1 at \2", words)
