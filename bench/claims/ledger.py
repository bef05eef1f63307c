"""The ledger: claims of a paper as data, a TOML file a paper.

    read_claims(paper) -> dict[str, Claim]          # by id, in the file's order
    judge(claim, scores, tables={}) -> list[Finding]            # bench.claims.judging
    conclude(claim, findings) -> Conclusion                     # bench.claims.conclusion

```toml
version = 1
retired = ["X-3"]                # ids that were in use once; none is ever given again

[units]                          # of metrics that aren't shares of frames or runs
jitter = "px"

[cells]                          # what is repeated in a table beside the scores, if not scenes
sets = "set of clips"

[usual."suite/sequence"]         # parameters of trackers there, under all others
proposed = { particles = 15 }

[readings.text]                  # an axis of what the text leaves open, its headline first
over = ["proposed"]              # trackers whose parameters it sets; by default all that are named
"as written" = { preset = "as-written" }
"σ = 0.2" = { preset = "as-written", sigma = 0.2, post_hoc = true }      # chosen after results
"r = 10" = { preset = "as-written", baseline = { radius = 10 } }         # of one tracker alone

[readings.window]
rivals = true                    # the text names none: none is the headline, all must agree
fixed = { baseline = { window = "fixed" } }
adaptive = { baseline = { window = "adaptive" } }

[readings.light]
even = { where = { light = "even" } }                    # rows, whatever tracker

[claim.X-1]
short = "the proposed filter is lost later"              # its line on the screen
source = "Section 3, Table 1"    # place in the paper
quote = "..."                    # its words
says = "..."                     # what it claims, in ours
kind = "order"                   # number | order | equal | all | timing | check
asserted = false                 # true where the paper has no experiment for it
ours = false                     # true where the paper says no such thing: not counted
published = [{ label = "sequence 1, multi", value = 788, unit = "frames of 788" }]
experiment = ["x-table-1"]       # whose results test it
effort = "default"               # or "all": only with --all
falsifier = "..."                # written before the first run
on = ["suite/sequence"]          # for all of its tests
order = { better = "proposed", worse = ["baseline", "proposed:beta=0"], by = "first_loss" }
# or several: parts."a name".share = { of = "proposed", by = "kept" }
```

What kinds of tests there are, `bench.claims.kinds` says; what a reading does, `readings`.
"""

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from bench.claims.kinds import KINDS, Entry, SummaryTest, Test, Text
from bench.claims.readings import Readings
from bench.experiments.experiment import read_toml

__all__ = ["Claim", "LedgerError", "Published", "read_claims"]

PAPERS = Path(__file__).parents[1] / "papers"

MOST_LETTERS = 50
"""Of a claim in a few words: it has a line of a terminal with its verdict."""


class LedgerError(ValueError):
    """A ledger that can't be read; the message names file, claim and key."""


class Published(Entry):
    """A published number."""

    label: Text
    value: float
    unit: Text


class Claim(Entry):
    """A claim; see the module for what the keys mean. The first four come from around it."""

    id: Text
    readings: Readings
    units: dict[Text, str] = Field(default={})
    cells: dict[Text, Text] = Field(default={})
    short: Annotated[str, Field(max_length=MOST_LETTERS)] = ""
    source: Text
    quote: Text
    says: Text
    kind: Literal["number", "order", "equal", "all", "timing", "check"]
    asserted: bool = False
    ours: bool = False
    published: tuple[Published, ...] = ()
    experiment: tuple[Text, ...]
    effort: Literal["default", "all"] = "default"
    test: Test = Field(discriminator="kind")
    falsifier: Text


class _Ledger(Entry):
    version: Literal[1]
    retired: tuple[Text, ...] = ()
    readings: Readings
    claim: dict[Text, Claim]

    @model_validator(mode="before")
    @classmethod
    def _entries_know_their_surroundings(cls, table: object) -> object:
        if not isinstance(table, dict) or not isinstance(table.get("claim"), dict):
            return table
        table = dict(table)
        known = Readings.model_validate(
            {"axes": table.get("readings", {}), "usual": table.pop("usual", {})}
        )
        shared = {"units": table.pop("units", {}), "cells": table.pop("cells", {})}
        entries = {
            name: {"id": name, "readings": known, **shared, **_with_its_test(entry)}
            if isinstance(entry, dict)
            else entry
            for name, entry in table["claim"].items()
        }
        return {**table, "readings": known, "claim": entries}

    @model_validator(mode="after")
    def _names_are_right(self) -> "_Ledger":
        for name in self.retired:
            if name in self.claim:
                raise ValueError(f"claim {name} has a retired id; give it one never used before")
        for name, claim in self.claim.items():
            for part in claim.test.claims if isinstance(claim.test, SummaryTest) else ():
                if part not in self.claim or isinstance(self.claim[part].test, SummaryTest):
                    raise ValueError(
                        f"claim {name} sums up {part!r}, which is no claim with a test"
                    )
        return self


def _with_its_test(entry: Mapping[str, Any]) -> dict[str, Any]:
    """An entry whose test, keyed by its kind, stands in `test` with all of its parts."""
    general = {key: entry[key] for key in _GENERAL if key in entry}
    named = entry.get("parts", {"": {key: entry[key] for key in KINDS if key in entry}})
    rest = {k: v for k, v in entry.items() if k not in (*KINDS, *_GENERAL, "parts")}
    parts: dict[str, Any] = {}
    for name, tests in named.items():
        for kind, test in tests.items():
            if isinstance(test, dict):
                parts |= dict(_one_by_one(name, {"kind": kind, **_shared(kind, general), **test}))
            else:
                parts[name] = {"kind": kind, **general}
    if not parts:
        return rest  # the lack is told as that of `test`
    test = next(iter(parts.values())) if len(parts) == 1 else {"kind": "parts", "parts": parts}
    return {**rest, "test": test}


def _shared(kind: str, general: Mapping[str, Any]) -> Mapping[str, Any]:
    """What a claim says for all of its tests, as far as this kind has it."""
    return {} if kind in ("bound", "ratio", "summary", "check", "none") else general


def _one_by_one(name: str, test: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """A test for each of the sides that are listed."""
    listed = [key for key in ("better", "worse", "of") if isinstance(test.get(key), list)]
    for sides in product(*(test[key] for key in listed)):
        told = [
            side if isinstance(side, str) else ", ".join(map(str, side.values())) for side in sides
        ]
        words = [name, *(f"{_WORDS[key]}{one}" for key, one in zip(listed, told, strict=True))]
        yield ", ".join(filter(None, words)), {**test, **dict(zip(listed, sides, strict=True))}


_GENERAL = ("on",)
"""What a claim may say for all of its tests."""

_WORDS = {"better": "", "worse": "than ", "of": ""}


def read_claims(paper: str | Path) -> dict[str, Claim]:
    """Read a paper's claims: one that comes with trackmark, or a TOML file.

    Returns
    -------
    dict of str to Claim
        By id, in the order of the file.

    Raises
    ------
    LedgerError
        Naming the file, the claim and the key that is missing, unknown or of the wrong kind.
    """
    path = Path(paper)
    if path.suffix != ".toml":
        path = PAPERS / str(paper) / "claims.toml"
        if not path.is_file():
            known = ", ".join(sorted(file.parent.name for file in PAPERS.glob("*/claims.toml")))
            raise LedgerError(f"there are no claims of {str(paper)!r}. Known: {known}.")
    table = read_toml(path, LedgerError)
    try:
        return _Ledger.model_validate(table).claim
    except ValidationError as error:
        raise LedgerError(_first_error(path, table, error)) from None


def _first_error(path: Path, table: Mapping[str, object], error: ValidationError) -> str:
    """The first thing that is wrong, in words."""
    first = error.errors(include_url=False)[0]
    place = [str(part) for part in first["loc"]]
    claim = ""
    if place[:1] == ["axes"]:
        place = ["readings", *(part for part in place[1:] if part != "options")]
    if place[:1] == ["claim"] and len(place) > 1:
        claim, place = f" claim {place[1]}:", place[2:]
        if place[:1] == ["test"] and len(place) > 1:
            del place[1]  # the kind of test, which pydantic puts in between
        if place[:2] == ["test", "parts"] and len(place) > 3:
            del place[3]  # likewise
    key = f" {'.'.join(place)}:" if place else ""
    words = first["msg"].removeprefix("Value error, ")
    return f"{path}:{claim}{key} {words[:1].lower()}{words[1:]}."
