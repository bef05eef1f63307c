"""The ledger: claims of a paper as data, one TOML file a paper.

    read_claims(paper) -> dict[str, Claim]          # by id, in the file's order
    judge(claim, scores, tables={}) -> list[Finding]            # bench.claims.evaluation
    conclude(claim, findings) -> Conclusion                     # bench.claims.conclusion

```toml
version = 1
retired = ["X-3"]                # ids that were in use once; none is ever given again

[readings]                       # of the text, by columns of the scores; other rows are not judged
initial = ["full", "tight", "body"]                      # the first one is the headline
variant = ["", "uv_range=natural"]                       # likewise
post_hoc = [{ initial = "body" }, { variant = "uv_range=natural" }]      # chosen after results
rivals = []                      # columns of which the text names no value: none is the headline

[claim.X-1]
source = "Section 3, Table 1"    # place in the paper
quote = "..."                    # its words
says = "..."                     # what it claims, in ours
kind = "order"                   # number | order | equal | all | timing | check
asserted = false                 # true where the paper has no experiment for it
published = [{ label = "sequence 1, multi", value = 788, unit = "frames of 788" }]
experiment = ["x-table-1"]       # whose results test it
effort = "default"               # or "all": only with --all
test = { kind = "order", better = { representation = "multi" }, worse = { ... }, sequences = [...] }
falsifier = "..."                # written before the first run
```

What kinds of tests there are, `bench.claims.kinds` says.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationError, model_validator

from bench.claims.kinds import Entry, Test, Text

__all__ = ["ANY", "Claim", "LedgerError", "Published", "Readings", "read_claims"]

FOLDER = Path(__file__).parent

ANY = "any"
"""In a column of readings: a row that depends on none and belongs to all, like a baseline's."""


class LedgerError(ValueError):
    """A ledger that can't be read; the message names file, claim and key."""


class Readings(Entry):
    """Readings of the text: columns of the scores with their values, the headline's first."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, Annotated[tuple[str, ...], Field(min_length=1)]]

    post_hoc: tuple[dict[str, str], ...] = ()
    rivals: tuple[Text, ...] = ()

    @property
    def columns(self) -> Mapping[str, tuple[str, ...]]:
        """Values by column."""
        return self.__pydantic_extra__

    @model_validator(mode="after")
    def _choices_are_of_columns(self) -> "Readings":
        if not self.columns:
            raise ValueError("there must be a column of readings")
        named = {"post_hoc": {column for choice in self.post_hoc for column in choice}}
        for key, columns in (named | {"rivals": {*self.rivals}}).items():
            for column in sorted(columns.difference(self.columns)):
                raise ValueError(f"{key} names {column!r}, which is no column of readings")
        return self

    def is_post_hoc(self, reading: Mapping[str, str]) -> bool:
        """Whether a reading was chosen after seeing results."""
        return any(
            all(reading.get(column) == value for column, value in choice.items())
            for choice in self.post_hoc
        )

    def is_headline(self, reading: Mapping[str, str]) -> bool:
        """Whether it is the first of all readings, or depends on none; rivals are equal."""
        return all(
            reading.get(column, values[0]) in ("", values[0]) or column in self.rivals
            for column, values in self.columns.items()
        )


class Published(Entry):
    """A published number."""

    label: Text
    value: float
    unit: Text


class Claim(Entry):
    """A claim; see the module for what the keys mean. `id` and `readings` come from around it."""

    id: Text
    readings: Readings
    source: Text
    quote: Text
    says: Text
    kind: Literal["number", "order", "equal", "all", "timing", "check"]
    asserted: bool = False
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
        entries = {
            name: {"id": name, "readings": table.get("readings"), **entry}
            if isinstance(entry, dict)
            else entry
            for name, entry in table["claim"].items()
        }
        return {**table, "claim": entries}

    @model_validator(mode="after")
    def _ids_are_never_reused(self) -> "_Ledger":
        for name in self.retired:
            if name in self.claim:
                raise ValueError(f"claim {name} has a retired id; give it one never used before")
        return self


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
        path = FOLDER / f"{paper}.toml"
        if not path.is_file():
            known = ", ".join(sorted(file.stem for file in FOLDER.glob("*.toml")))
            raise LedgerError(f"there are no claims of {str(paper)!r}. Known: {known}.")
    try:
        table = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise LedgerError(f"{path}: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise LedgerError(f"{path}: {error}.") from None
    try:
        return _Ledger.model_validate(table).claim
    except ValidationError as error:
        raise LedgerError(_first_error(path, table, error)) from None


def _first_error(path: Path, table: Mapping[str, object], error: ValidationError) -> str:
    """The first thing that is wrong, in words."""
    first = error.errors(include_url=False)[0]
    place = [str(part) for part in first["loc"]]
    claim = ""
    if place[:1] == ["claim"] and len(place) > 1:
        claim, place = f" claim {place[1]}:", place[2:]
        if place[:1] == ["test"] and len(place) > 1:
            del place[1]  # the kind of test, which pydantic puts in between
        if place[:2] == ["test", "parts"] and len(place) > 3:
            del place[3]  # likewise
    key = f" {'.'.join(place)}:" if place else ""
    words = first["msg"].removeprefix("Value error, ")
    return f"{path}:{claim}{key} {words[:1].lower()}{words[1:]}."
