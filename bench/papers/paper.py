"""Papers as their files describe them, with all names resolved.

    read_paper("wang2010") -> Paper

CONTRIBUTING.md explains the fields; `bench/papers/wang2010/paper.toml` is a complete example.
"""

from functools import cached_property
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, InstanceOf

from trackmark.bench.experiments.experiment import ExperimentError, read_toml
from trackmark.bench.papers import check_paper_name, paper_file
from trackmark.bench.papers.cases import (
    FrameValuesName,
    FunctionName,
    MeasureName,
    MeasureNames,
    Names,
    PaperSequence,
    PaperTracker,
    SequenceName,
    TrackerNames,
    parse_options,
)
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.measures import FrameRules
from trackmark.bench.papers.toml_table import NonEmptyText, Texts, TomlTable, as_tuple, validated
from trackmark.datasets.spec_string import parse_text

MAIN_SCENES = 24
"""Number of scenes per sequence in tables and figures, unless quick."""

OptionTexts = dict[NonEmptyText, str]
"""Options by tracker name, as `{ wang2010 = "preset=as-written" }`."""


def changed_options(options: OptionTexts, tracker: PaperTracker) -> dict[str, str]:
    """Return the options for a tracker, under its own name or else its registered name."""
    return parse_options(options.get(tracker.name, options.get(tracker.registered_name, "")))


class MainRow(TomlTable):
    """Row of the main table: one statement on a video, or one count.

    A cell has one value per tracker and measure. Without a `total`, each value is the number of
    scenes for which a statement is true; its measure is 1 or 0. With a `total`, each value is a
    mean count, such as tracked clips of 20. With `compares`, the statement is that the first of
    two trackers has the better value of the measure. A `function` of the paper's modules returns
    the text of a setting's cell instead.

    `paper`: cell of the paper in the same form, such as `1 of 1`, or `–` if the paper shows none.
    `claims`: claims whose verdicts mark the values on a page, in the order of the values.
    """

    labels: Texts
    paper: NonEmptyText
    claims: Texts = ()
    sequence: SequenceName | None = None
    trackers: TrackerNames = ()
    measures: MeasureNames = ()
    total: Annotated[int, Field(ge=0)] = 0
    compares: bool = False
    function: FunctionName | None = None


class MainTable(TomlTable):
    """Main table of a paper; the label columns have `headings`."""

    caption: NonEmptyText
    headings: Texts
    rows: tuple[MainRow, ...]


class FigureDefinition(TomlTable):
    """Figure of the paper, drawn from our runs.

    A figure with `frames` (numbered as in the paper) is a strip with one row per tracker. Its scene
    has the median error of the first tracker in the setting `recommended`. A figure with a
    `function` of the paper's modules is drawn by it; `bench.papers.figures` describes its result.
    Other figures are plots of a value per frame: median and quartiles over scenes.
    """

    # content of the paper's figure; by file if there are several
    caption: NonEmptyText | dict[str, NonEmptyText]
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
        return not quick or (self.quick and bool(self.frames or self.function))


class ChainStep(TomlTable):
    """Parameter whose default is not the value of the text, and the reason, which is no result.

    `trackers`: registered names of the trackers with these values.
    """

    parameter: NonEmptyText
    as_written: NonEmptyText
    recommended: NonEmptyText
    trackers: Texts
    reason: NonEmptyText


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
    chain: tuple[ChainStep, ...] = ()  # from the text to the defaults, in this order
    main_table: MainTable
    figure: dict[NonEmptyText, FigureDefinition] = Field(default={})
    pictures: Annotated[Texts, Field(max_length=2)] = ()  # strips on the page, by their file stems
    claims: dict[str, InstanceOf[Claim]]

    @cached_property
    def frame_rules(self) -> FrameRules:
        """Rules for the frames of the paper's runs."""
        return FrameRules(self.trajectory, self.frames_from, self.on_target)

    def n_scenes(self, *, quick: bool) -> int:
        """Return the number of scenes per sequence in tables and figures."""
        return self.quick_scenes if quick else MAIN_SCENES

    @property
    def names(self) -> Names:
        """Trackers and sequences by the names that the files of the paper use."""
        return Names(self.name, self.trackers, self.sequences)

    def steps(self, registered_name: str) -> list[ChainStep]:
        """Return the steps from the text to the default of a tracker."""
        return [step for step in self.chain if registered_name in step.trackers]

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
        If the paper is unknown, or if a field is missing, unknown or wrong; the message names file,
        entry and field.
    """
    check_paper_name(name)
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
