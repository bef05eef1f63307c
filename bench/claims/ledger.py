"""The ledger: claims of a paper as data, one TOML file a paper.

    read_claims(paper) -> dict[str, Claim]          # by id, in the file's order
    judge(claim, scores, tables={}) -> list[Finding]            # bench.claims.evaluation
    conclude(claim, findings) -> Conclusion                     # bench.claims.conclusion

```toml
version = 1
retired = ["X-3"]                # ids that were in use once; none is ever given again

[readings]                       # of the text; others of the scores' rows are not judged
initial = ["full", "tight", "body"]                      # the first one is the headline
variant = ["", "uv_range=natural"]                       # likewise
post_hoc = [{ initial = "body" }, { variant = "uv_range=natural" }]      # chosen after results

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

Tests (`test.kind`), on cells of a sequence in one scene, as shares of the sequence's length:

- `order`, `equal`: rows `better` less rows `worse` (columns and their values);
- `interaction`: `order` on `sequences` against `order` on the sequences `against`;
- `all`: runs of `rows` whose first loss is the length;
- `lost`: of the sequences, how many lose at least `share` of the runs of `rows`;
- `best`: cells in which `rows` are no worse, by `margin`, than the best of `others`;
- `number`: prints what `rows` reach;
- `check`: a function of `bench.claims.checks`, with `settings` of its own.

`where` limits the cells that a verdict rests on; `groups` are judged beside it (each sequence
where there are none); with `every` the verdict is that all groups hold.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bench.statistics.verdicts import MARGIN

__all__ = [
    "METRICS",
    "AllTest",
    "BestTest",
    "CheckTest",
    "Claim",
    "EqualTest",
    "InteractionTest",
    "LedgerError",
    "Limits",
    "LostTest",
    "NumberTest",
    "OrderTest",
    "Published",
    "Readings",
    "Rows",
    "Test",
    "read_claims",
]

FOLDER = Path(__file__).parent

Metric = Literal["success_frames", "frames_inside", "first_loss"]

METRICS: tuple[Metric, ...] = ("success_frames", "frames_inside", "first_loss")
"""Three readings of "frames tracked successfully", of equal rank."""

Rows = dict[str, str | int | float]
"""Columns and their values: which rows of the scores are meant."""
Limits = dict[str, list[str | int | float]]
"""Columns and the values that are let through."""

Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(min_length=1)]


class LedgerError(ValueError):
    """A ledger that can't be read; the message names file, claim and key."""


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Readings(_Entry):
    """Readings of the text; the first `initial` and the first `variant` are the headline."""

    initial: Texts
    variant: Annotated[tuple[str, ...], Field(min_length=1)] = ("",)
    post_hoc: tuple[dict[Literal["initial", "variant"], str], ...] = ()

    def is_post_hoc(self, initial: str, variant: str) -> bool:
        """Whether a reading was chosen after seeing results."""
        labels = {"initial": initial, "variant": variant}
        return any(
            all(labels[key] == value for key, value in choice.items()) for choice in self.post_hoc
        )


class _CellTest(_Entry):
    """What tests on scores share; see the module."""

    sequences: Texts
    metrics: Annotated[tuple[Metric, ...], Field(min_length=1)] = METRICS
    where: Limits = {}
    groups: dict[str, Limits] = {}
    every: bool = False


class OrderTest(_CellTest):
    """A is better than B."""

    kind: Literal["order"]
    better: Rows
    worse: Rows
    margin: float = Field(MARGIN, ge=0.0)


class EqualTest(_CellTest):
    """A is comparable to B: the same rows as of an order, within the margin."""

    kind: Literal["equal"]
    better: Rows
    worse: Rows
    margin: float = Field(MARGIN, ge=0.0)


class InteractionTest(_CellTest):
    """A is better than B on some sequences by more than on others."""

    kind: Literal["interaction"]
    better: Rows
    worse: Rows
    against: Texts
    margin: float = Field(MARGIN, ge=0.0)


class AllTest(_CellTest):
    """The whole sequence is tracked."""

    kind: Literal["all"]
    rows: Rows
    metrics: tuple[Literal["first_loss"]] = ("first_loss",)


class LostTest(_CellTest):
    """The target is lost in at least `share` of the runs on at least `least` sequences."""

    kind: Literal["lost"]
    rows: Rows
    metrics: tuple[Literal["first_loss"]] = ("first_loss",)
    share: float = Field(ge=0.0, le=1.0)
    least: int = Field(ge=1)


class BestTest(_CellTest):
    """As good as the best of others in at least a share `least` of cells, surely above `lower`."""

    kind: Literal["best"]
    rows: Rows
    others: Annotated[tuple[Rows, ...], Field(min_length=2)]
    margin: float = Field(MARGIN, ge=0.0)
    least: float = Field(ge=0.0, le=1.0)
    lower: float = Field(ge=0.0, le=1.0)


class NumberTest(_CellTest):
    """Numbers to print beside the paper's."""

    kind: Literal["number"]
    rows: Rows


class CheckTest(_Entry):
    """A function of `bench.claims.checks`."""

    kind: Literal["check"]
    check: Text
    settings: dict[str, float | str | list[str]] = {}


Test = (
    OrderTest | EqualTest | InteractionTest | AllTest | LostTest | BestTest | NumberTest | CheckTest
)


class Published(_Entry):
    """A published number."""

    label: Text
    value: float
    unit: Text


class Claim(_Entry):
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


class _Ledger(_Entry):
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
    key = f" {'.'.join(place)}:" if place else ""
    words = first["msg"].removeprefix("Value error, ")
    return f"{path}:{claim}{key} {words[:1].lower()}{words[1:]}."
