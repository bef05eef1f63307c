"""Kinds of tests that the ledger knows; `bench.claims.ledger` shows how they are written.

Most compare sides (`better`, `worse`, `of`, `others`) by cells of a sequence in one scene. A side
is a tracker's text form, by which runs are found; or columns and their values, by which rows are,
of the scores or of a table of what was measured besides (`table`):

- `order`: `better` less `worse`; `interaction` is an `order` of each scene's difference of
  differences, on the rows `where` less those `against`;
- `no-worse`, also written `equal`: the same difference, on the repetitions that both sides have;
- `share`: scenes in which more than half of the rows of `of` (or of its column `trials`) have a
  metric that is so. `all` and `lost` are shares of runs that are never or sometime lost, `best` is
  the share of scenes in which `of` is no worse, by `margin`, than the best of `others`, and
  `bound` the share of scenes (of rows, in a table without scenes) within a limit;
- `number`: prints the mean of `of`;
- `time`, written `ratio`: one time of a pair is longer than the other by a factor.

`parts` is a claim with several tests, all of which must hold; `summary` has the tests of other
claims as parts; `check` is a function of the paper that returns verdicts of these kinds; `none` is
not testable, for a reason.

`by` names the metrics. `where` limits the rows of a verdict; `groups` are judged in addition, with
limits of their own (by default each sequence); with `every` the groups are parts of the claim.
"""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from bench.statistics.rules import CLAIM_MARGIN, SHARE_LIMIT
from datasets.text_form import parse_text

__all__ = [
    "COUNTS",
    "ERRORS",
    "IN_PIXELS",
    "KINDS",
    "SCORES",
    "AllTest",
    "BestTest",
    "BoundTest",
    "CellTest",
    "CheckTest",
    "Comparison",
    "Entry",
    "InteractionTest",
    "Limits",
    "NoTest",
    "NoWorseTest",
    "NumberTest",
    "OrderTest",
    "PartTest",
    "PartsTest",
    "RatioTest",
    "ShareTest",
    "Side",
    "SummaryTest",
    "Test",
    "Text",
    "Texts",
    "Value",
    "listed",
    "trackers_of",
]

COUNTS = ("success_frames", "frames_inside", "first_loss")
"""Three readings of "frames tracked successfully": judged as shares of the length, and all shown.

Which of them decide, `bench.claims.conclusion` says. Other metrics are judged as they are."""

ERRORS = ("centre_error", "size_error", "error")
"""Metrics of which less is better begin so; a margin is a share of the worse side's mean."""

IN_PIXELS = ("centre_error", "error")
"""Metrics whose names begin so are in pixels; of others a ledger says the unit."""

SCORES = "scores"
"""Name of the table that a reproduction's runs make."""

Value = bool | int | float | str
Side = str | dict[str, Value | list[Value]]
"""A tracker's text form; or columns and their values. There `tracker` may be a text form, too, or a
list of these, whose runs are taken together where there are some of each."""

Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(min_length=1)]


def listed(value: Any) -> Any:
    """A single text as a list of one."""
    return [value] if isinstance(value, str) else value


def _all_listed(limits: Any) -> Any:
    """Limits whose values are all lists."""
    if not isinstance(limits, dict):
        return limits
    return {key: value if isinstance(value, list) else [value] for key, value in limits.items()}


Names = Annotated[Texts, BeforeValidator(listed)]
Limits = Annotated[dict[str, list[Value]], BeforeValidator(_all_listed)]
"""Columns and the values that are let through."""


class Entry(BaseModel):
    """Something that a ledger says; unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


Options = dict[str, Value]


def trackers_of(side: Side) -> tuple[list[tuple[str, Options]], Limits]:
    """A side's trackers, each with its own parameters, and what it says of columns."""
    columns: Limits = {}
    texts: list[Value] = [side] if isinstance(side, str) else []
    for key, value in side.items() if isinstance(side, dict) else ():
        values = value if isinstance(value, list) else [value]
        if key == "tracker":
            texts = values
        else:
            columns[key] = values
    trackers: list[tuple[str, Options]] = []
    for text in texts:
        name, options = parse_text(str(text))
        trackers.append((name, {**options}))
    return trackers, columns


class _TableTest(Entry):
    """What tests on tables share; see the module."""

    naming: ClassVar[tuple[str, ...]] = ()
    """Keys that name columns."""
    counted: ClassVar[str] = "scene"
    """What a verdict rests on, in the singular."""

    table: Text = SCORES
    where: Limits = {}

    @property
    def sides(self) -> list[Side]:
        """What is compared; one side of no name where no cells are needed."""
        return [{}]

    @property
    def sequences(self) -> list[str] | None:
        """Those that it looks at; None for whatever there is."""
        return None

    @property
    def limits(self) -> list[Limits]:
        """Where rows lie that it looks at: within any of these."""
        return [self.where]

    @property
    def columns(self) -> set[str]:
        """Columns that it needs beside those that every table has."""
        named = {*self.where}
        for key in self.naming:
            value = getattr(self, key)
            named |= {value} if isinstance(value, str) else {*(value or ())}
        return named


class _CellTest(_TableTest):
    """What tests by cells share; see the module."""

    naming: ClassVar[tuple[str, ...]] = ("by",)
    on: Names
    by: Names = COUNTS
    groups: dict[str, Limits] = {}
    every: bool = False

    @property
    def sequences(self) -> list[str]:
        return [*self.on]

    @property
    def limits(self) -> list[Limits]:
        return [{}] if self.groups else [self.where]  # groups are judged beside `where`

    @property
    def columns(self) -> set[str]:
        named = {column for limits in self.groups.values() for column in limits}
        of_sides = {column for side in self.sides for column in trackers_of(side)[1]}
        return super().columns | named | of_sides


class _Comparison(_CellTest):
    """Two sides that are compared cell by cell."""

    better: Side
    worse: Side
    margin: float = Field(CLAIM_MARGIN, ge=0.0)

    @property
    def sides(self) -> list[Side]:
        return [self.better, self.worse]


class OrderTest(_Comparison):
    """A is better than B.

    `needs` are columns of A and the least means (shares) of them: below these the two are one and
    the same, and there is nothing to compare.
    """

    naming = ("by", "needs")
    kind: Literal["order"]
    needs: dict[Text, float] = {}


class NoWorseTest(_Comparison):
    """A is as good as B, or better."""

    kind: Literal["no-worse", "equal"]


class InteractionTest(_Comparison):
    """A is better than B on some rows by more than on others of the same scenes.

    Rows of other sequences are paired by the number of the scene.
    """

    naming = ("by", "against")
    kind: Literal["interaction"]
    against: Limits

    @property
    def sequences(self) -> list[str]:
        """Those of either group of rows."""
        return [*self.on, *map(str, self.against.get("sequence", []))]

    @property
    def limits(self) -> list[Limits]:
        """Those of either group of rows."""
        return [self.where, self.against]


class _OneSided(_CellTest):
    """What tests on one side share."""

    of: Side

    @property
    def sides(self) -> list[Side]:
        return [self.of]


class AllTest(_OneSided):
    """The target is kept throughout (`all`), or lost."""

    kind: Literal["all", "lost"]
    by: tuple[Literal["first_loss"]] = ("first_loss",)
    limit: float = Field(SHARE_LIMIT, ge=0.0, le=1.0)


class BestTest(_OneSided):
    """As good as the best of others."""

    kind: Literal["best"]
    others: Annotated[tuple[Side, ...], Field(min_length=2)]
    margin: float = Field(CLAIM_MARGIN, ge=0.0)
    limit: float = Field(SHARE_LIMIT, ge=0.0, le=1.0)

    @property
    def sides(self) -> list[Side]:
        """Side that is judged, and all others."""
        return [self.of, *self.others]


class ShareTest(_OneSided):
    """Something is so in more than half of the rows of a scene."""

    naming = ("by", "trials")
    kind: Literal["share"]
    by: Names
    trials: Text | None = None
    limit: float = Field(SHARE_LIMIT, ge=0.0, le=1.0)


class NumberTest(_OneSided):
    """Numbers to print beside the paper's; `most` is the greatest that a metric can be."""

    kind: Literal["number"]
    most: dict[Text, float] = {}


class BoundTest(_TableTest):
    """A metric lies within a limit in more than half of the rows of a scene.

    In a table without scenes each row is a unit.
    """

    naming = ("metric",)
    counted = "row"
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

    naming = ("longer", "shorter")
    counted = "pair"
    kind: Literal["ratio"]
    longer: Text
    shorter: Text
    least: float = Field(1.0, gt=0.0)


class SummaryTest(Entry):
    """Several other claims of the ledger all hold."""

    kind: Literal["summary"]
    claims: Annotated[tuple[Text, ...], Field(min_length=2)]


class CheckTest(Entry):
    """A function of the paper's `measures.py`."""

    kind: Literal["check"]
    check: Text
    unit: str = ""
    settings: dict[str, float | str | list[str | float]] = {}


class NoTest(Entry):
    """Nothing that we have can show it."""

    kind: Literal["none"]
    reason: Text


Comparison = OrderTest | NoWorseTest | InteractionTest
"""Tests of two sides."""

CellTest = Comparison | AllTest | BestTest | ShareTest | NumberTest
"""Tests by cells."""

PartTest = CellTest | BoundTest | RatioTest
"""Tests that can be a part of another."""


class PartsTest(Entry):
    """Several tests, all of which must hold; each metric of a part is a part of its own."""

    kind: Literal["parts"]
    parts: dict[Text, Annotated[PartTest, Field(discriminator="kind")]] = Field(min_length=2)


Test = PartTest | PartsTest | SummaryTest | CheckTest | NoTest
"""Any test."""

KINDS = (
    *("order", "equal", "no-worse", "interaction", "all", "lost", "best", "share", "number"),
    *("bound", "ratio", "summary", "check", "none"),
)
"""By which a claim's or a part's test is keyed."""
