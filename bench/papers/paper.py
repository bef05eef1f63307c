"""Papers as their files describe them, with all names resolved.

    read_paper("wang2010") -> Paper

CONTRIBUTING.md explains the fields; `bench/papers/wang2010/paper.toml` is a complete example.
"""

from functools import cached_property
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, InstanceOf, model_validator

from trackmark.bench.experiments.experiment import ExperimentError, read_toml
from trackmark.bench.papers import paper_file
from trackmark.bench.papers.cases import (
    Case,
    FrameValuesName,
    FunctionName,
    MeasureName,
    MeasureNames,
    Names,
    PaperSequence,
    PaperTracker,
    SequenceName,
    SequenceNames,
    TrackerName,
    TrackerNames,
    parse_options,
)
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.measures import FrameRules
from trackmark.bench.papers.toml_table import NonEmptyText, Texts, TomlTable, as_tuple, validated
from trackmark.datasets.spec_string import parse_text

OptionTexts = dict[NonEmptyText, str]
"""Options by tracker name, as `{ wang2010 = "preset=as-written" }`."""


class MainRow(TomlTable):
    """Row of the main table: the paper's entry and our values in both settings.

    A cell contains one value per tracker and measure. `function`, which is in the paper's modules,
    returns the text of a setting's cell instead. `paper`: one text, or one per value.
    `claims`: claims whose verdicts mark the values on a page, in the order of the values.
    """

    labels: Texts
    paper: Texts
    claims: Texts = ()
    sequences: SequenceNames = ()
    trackers: TrackerNames = ()
    measures: MeasureNames = ()
    function: FunctionName | None = None

    @property
    def separator(self) -> str:
        """Text between the values of a cell."""
        return ", " if len(self.measures) > 1 else " / "


class MainTable(TomlTable):
    """Main table of a paper.

    The label columns have `headings`. If a page shows a column per value, `columns` gives the
    headings of the values; otherwise a cell joins them.
    """

    caption: NonEmptyText
    headings: Texts
    columns: Texts = ()
    rows: tuple[MainRow, ...]


class FigureDefinition(TomlTable):
    """Figure of the paper, drawn from our runs.

    A `strip` shows `frames` (numbered as in the paper), one row per tracker and setting. Its scene
    has the median error of the first tracker in the setting `recommended`. A `plot` shows median
    and quartiles over scenes of a value per frame. A `function` in the paper's modules draws any
    other figure; `bench.papers.figures` describes its result.
    """

    kind: Literal["strip", "plot", "function"]
    caption: (
        NonEmptyText | dict[str, NonEmptyText]
    )  # content of the paper's figure; by file if there are several
    description: str = ""  # content of our figure, for functions
    sequence: SequenceName | None = None
    trackers: TrackerNames = ()
    frames: tuple[int, ...] = ()
    # state of the target in the paper, by tracker and frame
    paper: dict[NonEmptyText, tuple[Literal["tracked", "lost"], ...]] = Field(default={})
    shape: Literal["box", "ellipse"] = "box"  # drawn around the target in a strip
    quantity: FrameValuesName = Field(default="error", validate_default=True)  # of a plot
    axis_label: str = "centre error [px]"  # of the quantity, with its unit
    function: FunctionName | None = None
    quick: bool = True  # False: the function is not called with `--quick`

    def caption_of(self, stem: str) -> str:
        """Return the caption of a file, `figure-3-recommended`, by the start of its name."""
        if isinstance(self.caption, str):
            return self.caption
        names = [name for name in self.caption if f"{stem}-".startswith(f"{name}-")]
        if not names:
            raise ExperimentError(f"{stem}: `caption` has no entry for this figure. Add one.")
        return self.caption[max(names, key=len)]

    def is_drawn(self, quick: bool) -> bool:
        """Return whether a report contains the figure; quick reports contain no plot."""
        return not quick or (self.quick and self.kind != "plot")


class SensitivityColumn(TomlTable):
    """Column of the sensitivity table: a measure of a tracker on a sequence."""

    heading: NonEmptyText
    sequence: SequenceName
    tracker: TrackerName
    measure: MeasureName


class SensitivityRow(TomlTable):
    """Choice that the paper leaves open, and the options that differ from those of a setting.

    `changed_options`: options by tracker, which is named as in `paper.toml` or by its registered
    name.
    """

    choice: NonEmptyText
    setting: Literal["as-written", "recommended"] = "recommended"
    changed_options: OptionTexts = Field(default={})
    sequence_options: str = ""  # additional options of the sequences


class Sensitivity(TomlTable):
    """Sensitivity table of a paper, which has no verdicts."""

    scenes: Annotated[int, Field(ge=1)] = 8
    repetitions: Annotated[int, Field(ge=1)] = 1
    columns: tuple[SensitivityColumn, ...]
    rows: tuple[SensitivityRow, ...]

    def case(self, row: SensitivityRow, column: SensitivityColumn) -> Case:
        """Return the runs behind a cell of the table."""
        tracker, changes = column.tracker, row.changed_options
        change = changes.get(tracker.name, changes.get(tracker.registered_name, ""))
        spec = tracker.spec(row.setting, parse_options(change))
        return Case(spec, column.sequence, self.scenes, row.sequence_options)


class SequenceTable(TomlTable):
    """Sequence in `paper.toml`; a text or a list gives only the members."""

    members: Annotated[tuple[NonEmptyText, ...], BeforeValidator(as_tuple)]
    scenes_of: str = ""


class NameTables(TomlTable):
    """Tables of `paper.toml` that define trackers and sequences."""

    trackers: dict[NonEmptyText, NonEmptyText]
    sequences: dict[
        NonEmptyText,
        Annotated[
            SequenceTable,
            BeforeValidator(lambda table: table if isinstance(table, dict) else {"members": table}),
        ],
    ]

    def names(self, paper: str) -> Names:
        """Return the trackers and sequences by name."""
        trackers = {
            name: PaperTracker(name, *parse_text(spec)) for name, spec in self.trackers.items()
        }
        sequences = {
            name: PaperSequence(name, paper, table.members, table.scenes_of)
            for name, table in self.sequences.items()
        }
        return Names(paper, trackers, sequences)


class Paper(TomlTable):
    """Content of a paper's `paper.toml` and `claims.toml`: what is run, shown and claimed."""

    name: NonEmptyText
    version: Literal[1]
    title: NonEmptyText
    citation: NonEmptyText
    method: NonEmptyText
    finding: NonEmptyText  # result of the reproduction in one sentence
    # Runs of stochastic trackers; odd, so that no scene is undecided by half of its runs.
    repetitions: Annotated[int, Field(ge=1)] = 1
    frames_from: int = 0  # number of the first frame in the paper
    # Definition of a tracked frame: `within` (error up to half the mean box side), `inside` (centre
    # in the box), or a function in the paper's `measures.py`.
    on_target: FrameValuesName = Field(default="within", validate_default=True)
    # Definition of a run that keeps the target, for the reference of no-worse claims.
    kept_measure: MeasureName = Field(default="kept_to_end", validate_default=True)
    trajectory: Literal["online", "revised"] = "online"
    quick_scenes: Annotated[int, Field(ge=1)] = 3
    trackers: dict[str, InstanceOf[PaperTracker]]
    sequences: dict[str, InstanceOf[PaperSequence]]
    # Why a parameter differs between the settings, by its name.
    reasons: dict[NonEmptyText, NonEmptyText] = Field(default={})
    equal_values: Texts = ()  # values of both settings, after the word `printed` or `not printed`
    main_table: MainTable
    figure: dict[NonEmptyText, FigureDefinition] = Field(default={})
    claims: dict[str, InstanceOf[Claim]]

    @model_validator(mode="after")
    def _check_repetitions(self) -> "Paper":
        if self.repetitions % 2 == 0:
            raise ValueError(f"repetitions is {self.repetitions}; expected: an odd number")
        return self

    @cached_property
    def frame_rules(self) -> FrameRules:
        """Rules for the frames of the paper's runs."""
        return FrameRules(self.trajectory, self.frames_from, self.on_target)

    @property
    def names(self) -> Names:
        """Trackers and sequences by the names that the files of the paper use."""
        return Names(self.name, self.trackers, self.sequences)

    def spec(self, tracker: str, setting: str) -> str:
        """Return the specification of a tracker, as named in `paper.toml`, in a setting."""
        return self.trackers[tracker].spec(setting)

    def first_scene(self, sequence: str) -> str:
        """Return the specification of the first scene of a sequence with one member."""
        ((scene,),) = self.sequences[sequence].scenes(1)
        return scene


def read_paper(name: str) -> Paper:
    """Read the `paper.toml` and the `claims.toml` of a paper.

    Raises
    ------
    ExperimentError
        If a field is missing, unknown or wrong; the message names file, entry and field.
    """
    path = paper_file(name, "paper.toml")
    table = read_toml(path, ExperimentError)
    tables = {key: table.pop(key, {}) for key in NameTables.model_fields}
    names = validated(NameTables, tables, str(path)).names(name)
    resolved = {
        **table,
        "name": name,
        "trackers": names.trackers,
        "sequences": names.sequences,
        "claims": read_claims(name, names),
    }
    return validated(Paper, resolved, str(path), names)


def read_claims(name: str, names: Names) -> dict[str, Claim]:
    """Read the claims of a paper by identifier; `names`: objects behind the names in claims."""
    path = paper_file(name, "claims.toml")
    return {
        claim: validated(Claim, {"name": claim, **table}, f"{path}: claim {claim}", names)
        for claim, table in read_toml(path, ExperimentError).items()
    }


def read_sensitivity(paper: Paper) -> Sensitivity:
    """Read a paper's `sensitivity.toml`; raise `ExperimentError` on errors."""
    path = paper_file(paper.name, "sensitivity.toml")
    return validated(Sensitivity, read_toml(path, ExperimentError), str(path), paper.names)
