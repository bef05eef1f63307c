"""What a paper's `paper.toml` says, read and checked.

    read_description("wang2010") -> Description

CONTRIBUTING.md shows how a table and a claim are added; `bench/papers/wang2010/paper.toml` has an
example of nearly everything. What TOML can't say plainly is a function of one of the paper's own
modules, named as `module.function`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from bench.claims.kinds import Entry, Limits, Text, Texts, Value, listed
from bench.experiments.experiment import ExperimentError, read_toml
from bench.papers.recorded import Recorded

__all__ = [
    "Column",
    "Description",
    "Experiments",
    "FigureEntry",
    "Line",
    "Measure",
    "Scenes",
    "Settings",
    "TableEntry",
    "read_description",
]

FOLDER = Path(__file__).parent

How = Literal["mean", "median", "min", "max", "all", "any"]
Names = Annotated[tuple[Text, ...], BeforeValidator(listed)]
"""A list, or a single text in place of it."""

Statistic = Literal[
    "share",
    "quartiles",
    "mean",
    "mean-error",
    "scene-means",
    "median",
    "range",
    "count",
    "least",
    "greatest",
    "ratio",
    "runs",
    "scenes",
]


def _by_place(*keys: str) -> BeforeValidator:
    """A list in place of a table whose first keys these are."""

    def named(value: Any) -> Any:
        return dict(zip(keys, value, strict=False)) if isinstance(value, list) else value

    return BeforeValidator(named)


class Experiments(Entry):
    """Which experiments there are, by effort; and which sequences and trackers a quick look takes.

    `more_scenes` are those of `all` that add scenes to what is judged without them. A quick look
    times nothing, and does without the trackers that have one of `quick_without` in their text: a
    parameter, whatever its value, or `parameter=value`.
    """

    always: Texts
    all: tuple[Text, ...] = ()
    more_scenes: tuple[Text, ...] = ()
    not_quick: tuple[Text, ...] = ()
    timed: tuple[Text, ...] = ()
    thorough: dict[Text, int] = Field(default={})
    quick_scenes: dict[Text, int] = Field(default={})
    quick_knobs: dict[Text, Value] = Field(default={"light": "even", "distance": 0})
    quick_without: tuple[Text, ...] = ()
    too_long_for_quick: tuple[Text, ...] = ()


class Settings(Entry):
    """How a tracker's setting is told."""

    told: dict[Text, Texts] = Field(default={})
    post_hoc: tuple[Text, ...] = ()


class Measure(Entry):
    """A number of a run: of a series over frames, from the first to the last, both included."""

    of: Text
    first: int | None = None
    last: int | None = None
    how: How = "mean"


class Column(Entry):
    """A column of a table: a statistic of a measure over the runs of a row.

    A `ratio` is of its sum `to` that of another measure.
    """

    head: Text
    of: str = ""
    to: str = ""
    how: Statistic = Field("mean", alias="as")
    digits: int | None = None
    scale: float = 1.0
    where: Limits = Field(default={})


class Line(Entry):
    """A row, or a row for `each` value of a column, of a table that is no runs'."""

    words: tuple[Text, ...]
    table: Text
    of: Text
    where: Limits = Field(default={})
    each: tuple[Text, ...] = ()
    digits: int = 2
    scale: float = 1.0


class Varied(Entry):
    """Runs that differ from a tracker's text form in one parameter, or in none."""

    base: Texts
    parameters: tuple[Text, ...] = ()


Columns = tuple[Annotated[Column, _by_place("head", "of", "as", "digits")], ...]


class TableEntry(Entry):
    """A table of the report."""

    caption: str = ""
    table: Text = "scores"
    experiments: tuple[Text, ...] = ()
    trackers: tuple[Text, ...] = ()
    where: Limits = Field(default={})
    rows: tuple[Text, ...] = ()
    columns: Columns = ()
    across: Annotated[Column | None, _by_place("head", "of", "as", "digits")] = None
    vary: Varied | None = None
    lines: tuple[Line, ...] = ()
    heads: dict[Text, Text] = Field(default={})
    notes: tuple[Text, ...] = ()
    copies: bool = False
    effort: Literal["default", "all"] = "default"
    hook: str = ""

    @model_validator(mode="after")
    def _says_what_stands_in_it(self) -> "TableEntry":
        if not self.hook and not self.columns and self.across is None:
            raise ValueError("give `columns`, `across`, or a `hook`")
        return self


class FigureEntry(Entry):
    """A figure of the report.

    A `strip` has frames for each tracker, in one row or so many `columns`; `frames` a series over
    frames, a row a panel and a column a sequence, over all of its scenes, or a column for each of
    some `scenes`, over repetitions and beside the series `truth`, shaded where other series are
    true, with a `level`; a panel may name the `trace`. A `curve` has the share of runs in which a
    measure is so, across a parameter. `words` say what a hook's strips show.
    """

    kind: Literal["strip", "frames", "curve", "hook"] = "hook"
    title: str = ""
    words: str = ""
    hook: str = ""
    experiments: Names = ()
    sequences: Names = ()
    trackers: tuple[Text, ...] = ()
    labels: tuple[Text, ...] = ()
    panels: dict[Text, dict[Text, Value]] = Field(default={})
    frames: tuple[int, ...] = ()
    scenes: tuple[int, ...] = ()
    of: Text = "error"
    truth: str = ""
    shades: dict[Text, Text] = Field(default={})
    level: dict[Text, float] = Field(default={})
    quantity: str = ""
    columns: int = 0
    shape: Literal["box", "ellipse"] = "box"
    enlarged: float = 3.0
    height: float = 2.8
    across: str = ""
    marks: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> "FigureEntry":
        if (self.kind == "hook") == (not self.hook):
            raise ValueError("give a `kind`, or a `hook`")
        if self.labels and len(self.labels) != len(self.trackers):
            raise ValueError("there must be as many `labels` as `trackers`")
        if self.kind in ("strip", "frames") and len(self.experiments) != len(self.sequences):
            raise ValueError("there must be as many `experiments` as `sequences`")
        if self.kind == "curve" and not self.across:
            raise ValueError("a curve needs `across`")
        return self


class Scenes(Entry):
    """On which sequences the checks of `scenes.py` measure: those of experiments, and others.

    Where not everything is asked for, on those of `few` alone, without variant (empty for all), and
    on the first `most` of each; a quick look leaves those of `not_quick` out.
    """

    of: Texts
    further: tuple[Text, ...] = ()
    few: tuple[Text, ...] = ()
    most: Annotated[int, Field(ge=1)] | None = None
    not_quick: tuple[Text, ...] = ()


class Description(Entry):
    """A paper; see the module.

    `tolerance` is the share of the mean side of a sequence's boxes up to which a centre error is
    `within`; `frames_from` what the paper calls the first frame; `apart` are knobs that make
    another sequence.
    """

    name: Text
    version: Literal[1]
    title: Text
    remarks: tuple[Text, ...] = ()
    main: tuple[Text, ...] = ()
    frames_from: int = 0
    tolerance: float = Field(0.5, gt=0)
    traces: tuple[Literal["online", "revised"], ...] = ()
    apart: tuple[Text, ...] = ()
    experiments: Experiments
    recorded: Recorded | None = None
    verdicts: dict[Text, dict[Text, str]] = Field(default={})
    names: dict[Text, Text] = Field(default={})
    settings: Settings = Settings()
    measures: dict[Text, Annotated[Measure, _by_place("of", "first", "last", "how")]] = Field(
        default={}
    )
    table: dict[Text, TableEntry] = Field(default={})
    figure: dict[Text, FigureEntry] = Field(default={})
    scenes: Scenes | None = None

    @model_validator(mode="after")
    def _names_what_there_is(self) -> "Description":
        every = {*self.experiments.always, *self.experiments.all}
        told: dict[str, set[str]] = {
            "more_scenes": set(self.experiments.more_scenes),
            "not_quick": set(self.experiments.not_quick),
            "timed": set(self.experiments.timed),
            "thorough": set(self.experiments.thorough),
            "quick_scenes": set(self.experiments.quick_scenes),
        }
        for key, names in told.items():
            for name in sorted(names - every):
                raise ValueError(f"experiments.{key}: {name!r} is not among `always` and `all`")
        return self

    def experiment(self, name: str) -> str:
        """Public name of an experiment, which its results' folder has."""
        return f"{self.name}-{name}"


def read_description(name: str, path: Path | None = None) -> Description:
    """Read what a paper's TOML says.

    Parameters
    ----------
    name : str
        Of the paper.
    path : Path, optional
        Another file than its own.

    Raises
    ------
    ExperimentError
        Naming the file and the entry that is missing, unknown or of the wrong kind.
    """
    path = path or FOLDER / name / "paper.toml"
    table = read_toml(path, ExperimentError)
    try:
        return Description.model_validate({"name": name, **table})
    except ValidationError as error:
        raise ExperimentError(_first_error(path, error)) from None


def _first_error(path: Path, error: ValidationError) -> str:
    """The first thing that is wrong, in words."""
    first: Mapping[str, Any] = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    words = first["msg"].removeprefix("Value error, ")
    return f"{path}:{f' {place}:' if place else ''} {words[:1].lower()}{words[1:]}."
