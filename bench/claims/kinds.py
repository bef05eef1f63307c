"""Kinds of tests that the ledger knows; `bench.claims.ledger` shows how they are written.

Most compare rows of the scores, or of a table of what was measured besides (`table`), by cells of
a sequence in one scene:

- `order`, `equal`: rows `better` less rows `worse` (columns and their values);
- `no-worse`: likewise `equal` or better, on the repetitions that both have;
- `interaction`: `order` on `sequences`, by `where`, against `order` on the rows `against`;
- `all`: runs of `rows` whose first loss is the length;
- `lost`: of the sequences, how many lose at least `share` of the runs of `rows`;
- `best`: cells in which `rows` are no worse, by `margin`, than the best of `others`;
- `share`: of `rows`, or of the column `trials` of them, how many a metric counts (in [0, 1]);
- `number`: prints what `rows` reach.

Two need no cells: `bound`, whether all rows lie within limits, and `ratio`, whether one time is
longer than another. `parts` is a claim with several tests, all of which must hold; `check` a
function of `bench.claims.checks`, with `settings` of its own; `none` is not testable, and says why.

`where` limits the cells that a verdict rests on; `groups` are judged beside it, with limits of
their own (each sequence by `where`, where there are none); with `every` the verdict is that all
hold.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.statistics.verdicts import KEPT_LIMIT, KEPT_SHARE, MARGIN

__all__ = [
    "COUNTS",
    "ERRORS",
    "SCORES",
    "AllTest",
    "BestTest",
    "BoundTest",
    "CellTest",
    "CheckTest",
    "Entry",
    "EqualTest",
    "InteractionTest",
    "Limits",
    "LostTest",
    "NoTest",
    "NoWorseTest",
    "NumberTest",
    "OrderTest",
    "PartTest",
    "PartsTest",
    "RatioTest",
    "Rows",
    "ShareTest",
    "Test",
    "Text",
    "Texts",
]

COUNTS = ("success_frames", "frames_inside", "first_loss")
"""Three readings of "frames tracked successfully", of equal rank: judged as shares of the length.

Other metrics are judged as they are."""

ERRORS = ("centre_error", "size_error")
"""Metrics of which less is better begin so; a margin is a share of the worse side's mean."""

SCORES = "scores"
"""Name of the table that a reproduction's runs make."""

Rows = dict[str, str | int | float]
"""Columns and their values: which rows of a table are meant."""
Limits = dict[str, list[str | int | float]]
"""Columns and the values that are let through."""

Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(min_length=1)]


class Entry(BaseModel):
    """Something that a ledger says; unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class _TableTest(Entry):
    """What tests on tables share; see the module."""

    table: Text = SCORES
    where: Limits = {}


class _CellTest(_TableTest):
    """What tests by cells share; see the module."""

    sequences: Texts
    metrics: Texts = COUNTS
    groups: dict[str, Limits] = {}
    every: bool = False


class OrderTest(_CellTest):
    """A is better than B.

    `needs` are columns of A and the least means (shares) of them: below these the two are one and
    the same, and there is nothing to compare.
    """

    kind: Literal["order"]
    better: Rows
    worse: Rows
    margin: float = Field(MARGIN, ge=0.0)
    needs: dict[Text, float] = {}


class EqualTest(_CellTest):
    """A is comparable to B: the same rows as of an order, within the margin."""

    kind: Literal["equal"]
    better: Rows
    worse: Rows
    margin: float = Field(MARGIN, ge=0.0)


class NoWorseTest(_CellTest):
    """A is as good as B, or better: the same rows as of an order."""

    kind: Literal["no-worse"]
    better: Rows
    worse: Rows
    margin: float = Field(MARGIN, ge=0.0)


class InteractionTest(_CellTest):
    """A is better than B on some cells by more than on others."""

    kind: Literal["interaction"]
    better: Rows
    worse: Rows
    against: Limits
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


class ShareTest(_CellTest):
    """Something is so in at least a share `least` of all rows, surely above `lower`."""

    kind: Literal["share"]
    rows: Rows
    metrics: Texts
    trials: Text | None = None
    least: float = Field(KEPT_SHARE, ge=0.0, le=1.0)
    lower: float = Field(KEPT_LIMIT, ge=0.0, le=1.0)


class NumberTest(_CellTest):
    """Numbers to print beside the paper's."""

    kind: Literal["number"]
    rows: Rows


class BoundTest(_TableTest):
    """No row lies beyond a limit: a criterion that leaves nothing to chance."""

    kind: Literal["bound"]
    metric: Text
    least: float | None = None
    most: float | None = None

    @model_validator(mode="after")
    def _has_one_limit(self) -> "BoundTest":
        if (self.least is None) == (self.most is None):
            raise ValueError("give either `least` or `most`")
        return self


class RatioTest(_TableTest):
    """One thing takes longer than another by a factor; a row is a pair measured side by side."""

    kind: Literal["ratio"]
    longer: Text
    shorter: Text
    least: float = Field(1.0, gt=0.0)


class CheckTest(Entry):
    """A function of `bench.claims.checks`."""

    kind: Literal["check"]
    check: Text
    settings: dict[str, float | str | list[str]] = {}


class NoTest(Entry):
    """Nothing that we have can show it."""

    kind: Literal["none"]
    reason: Text


CellTest = (
    OrderTest
    | EqualTest
    | NoWorseTest
    | InteractionTest
    | AllTest
    | LostTest
    | BestTest
    | ShareTest
    | NumberTest
)
"""Tests by cells."""

PartTest = CellTest | BoundTest | RatioTest
"""Tests that can be a part of another."""


class PartsTest(Entry):
    """Several tests, all of which must hold; each metric of a part is a part of its own."""

    kind: Literal["parts"]
    parts: dict[Text, Annotated[PartTest, Field(discriminator="kind")]] = Field(min_length=2)


Test = PartTest | PartsTest | CheckTest | NoTest
"""Any test."""
