"""A paper as its `paper.toml` describes it, read and checked.

    read_description("wang2010") -> Description

CONTRIBUTING.md explains the fields; `bench/papers/wang2010/paper.toml` is a complete example.
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from trackmark.bench.claims.claims_file import Entry, Names, Text, as_tuple, checked
from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.experiments.experiment import ExperimentError, read_toml

FOLDER = Path(__file__).parent

Options = dict[Text, str]
"""Options in text form by tracker name, as `{ wang2010 = "preset=as-written" }`."""


class SequenceEntry(Entry):
    """A sequence that claims and tables name; of several members the values are added up."""

    members: Annotated[tuple[Text, ...], BeforeValidator(as_tuple)]
    scenes_of: Text | None = None  # name in criteria.csv, if it differs from the member's name


def _as_sequence(value: Any) -> Any:
    return value if isinstance(value, dict) else {"members": value}


class MainRow(Entry):
    """A row of the main table: the paper's entry and ours in both settings.

    Values of several trackers stand next to each other, those of several measures, too. `hook`
    names a function of the paper's own that returns the text of a setting.
    """

    labels: Annotated[tuple[str, ...], BeforeValidator(as_tuple)]
    paper: Text
    sequences: Names = ()
    trackers: Names = ()
    measures: Names = ()
    hook: str = ""


class MainTable(Entry):
    """The paper's main table with our values."""

    caption: Text
    heads: Names  # of the labels
    rows: tuple[MainRow, ...]


class FigureEntry(Entry):
    """A figure of the paper, drawn from our runs.

    A `strip` shows `frames` (numbered as in the paper) of the scene with the median error of the
    first tracker as recommended; one row per tracker and setting. A `series` shows the median and
    the quartiles of a series by frame over the scenes. A `hook` is a function of the paper's own
    modules; `bench.papers.figures` describes what it returns.
    """

    kind: Literal["strip", "series", "hook"]
    caption: Text | dict[str, Text]  # what the paper's figure shows; by file if there are several
    words: str = ""  # what a hook's figure shows
    sequence: Text = ""
    trackers: Names = ()
    frames: tuple[int, ...] = ()
    shape: Literal["box", "ellipse"] = "box"  # of the target in a strip
    of: Text = "error"  # series by frame
    quantity: str = ""  # name of the series with its unit; as the series by default
    hook: str = ""
    quick: bool = True  # whether a hook is called under `--quick`

    def caption_of(self, stem: str) -> str:
        """Return the caption of a file, as `figure-3-recommended`, by the start of its name."""
        if isinstance(self.caption, str):
            return self.caption
        names = [name for name in self.caption if f"{stem}-".startswith(f"{name}-")]
        if not names:
            raise ExperimentError(f"{stem}: there is no caption of this figure in `caption`.")
        return self.caption[max(names, key=len)]

    def is_drawn(self, quick: bool) -> bool:
        """Return whether a report, quick or not, has the figure; quick ones have no series."""
        return not quick or (self.quick and self.kind != "series")


class SensitivityColumn(Entry):
    """A column of the sensitivity table: a measure of a tracker on a sequence."""

    head: Text
    sequence: Text
    tracker: Text
    measure: Text


class SensitivityRow(Entry):
    """One choice that the text leaves open: options that replace those of a setting.

    `change` has options by tracker, named as in `paper.toml` or by its own name.
    """

    choice: Text
    setting: Literal["as-written", "recommended"] = "recommended"
    change: Options = Field(default={})
    on: str = ""  # further options of the sequences


class Sensitivity(Entry):
    """The sensitivity table of a paper; it has no verdicts."""

    scenes: Annotated[int, Field(ge=1)] = 8
    repetitions: Annotated[int, Field(ge=1)] = 1
    columns: tuple[SensitivityColumn, ...]
    rows: tuple[SensitivityRow, ...]


class Description(Entry):
    """A paper.

    Attributes
    ----------
    title, citation, method : str
        Title of the page, the full citation, one sentence on the method.
    repetitions : int
        Repetitions of every run that draws random numbers; an odd number, as a share counts the
        scenes in which more than half of the runs succeed.
    frames_from : int
        Number that the paper gives the first frame.
    on_target : str
        Series by frame that says where the target is tracked: `within` (half the mean box side),
        `inside` (centre inside the box), or a function of the paper's `measures.py`.
    trace : str
        Boxes that are judged: `online`, or `revised`.
    quick_scenes : int
        Scenes of each sequence under `--quick`.
    trackers : mapping of str to str
        Text forms by the names that claims, tables and figures use.
    settings : mapping of str to options
        Options that a setting adds to each tracker, by the tracker's own name.
    sequences : mapping of str to SequenceEntry
        Sequences by the names that claims, tables and figures use.
    setting_table : list of lists of str
        Rows of the page's table of settings: value, as written, recommended, source.
    main, figure : MainTable, mapping of str to FigureEntry
        Main table and figures.
    """

    name: Text
    version: Literal[1]
    title: Text
    citation: Text
    method: Text
    repetitions: Annotated[int, Field(ge=1)] = 1
    frames_from: int = 0
    on_target: Text = "within"
    trace: Literal["online", "revised"] = "online"
    quick_scenes: Annotated[int, Field(ge=1)] = 3
    trackers: dict[Text, Text]
    settings: dict[Text, Options]
    sequences: dict[Text, Annotated[SequenceEntry, BeforeValidator(_as_sequence)]]
    setting_table: tuple[tuple[str, ...], ...]
    main: MainTable
    figure: dict[Text, FigureEntry] = Field(default={})

    @model_validator(mode="after")
    def _check_names(self) -> "Description":
        if self.repetitions % 2 == 0:
            raise ValueError(f"repetitions is {self.repetitions}; give an odd number")
        if {*self.settings} != {*SETTINGS}:
            raise ValueError(f"settings must be {' and '.join(SETTINGS)}")
        for row in self.main.rows:
            self.check_names(row.trackers, row.sequences, f"main table, {row.labels[0]}")
        for name, figure in self.figure.items():
            sequences = (figure.sequence,) if figure.sequence else ()
            self.check_names(figure.trackers, sequences, f"figure {name}")
        return self

    def check_names(self, trackers: Names, sequences: Names, place: str) -> None:
        """Raise `ValueError` for trackers or sequences that the description does not name."""
        for names, valid_names, kind in (
            (trackers, self.trackers, "tracker"),
            (sequences, self.sequences, "sequence"),
        ):
            if unknown := [name for name in names if name not in valid_names]:
                raise ValueError(
                    f"{place}: unknown {kind} {unknown[0]!r}; known: {', '.join(valid_names)}"
                )


def read_description(name: str, path: Path | None = None) -> Description:
    """Read a paper's `paper.toml`; `path` replaces its own file.

    Raises
    ------
    ExperimentError
        Naming the file and the entry that is missing, unknown or of the wrong kind.
    """
    path = path or FOLDER / name / "paper.toml"
    return checked(Description, {"name": name, **read_toml(path, ExperimentError)}, str(path))


def read_sensitivity(name: str, path: Path | None = None) -> Sensitivity:
    """Read a paper's `sensitivity.toml`; raises as `read_description`."""
    path = path or FOLDER / name / "sensitivity.toml"
    return checked(Sensitivity, read_toml(path, ExperimentError), str(path))
