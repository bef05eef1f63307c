"""Reader of `paper.toml` and `sensitivity.toml`, with checks.

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
"""Options by tracker name, as `{ wang2010 = "preset=as-written" }`."""


class SequenceEntry(Entry):
    """Sequence as named in claims and tables. Values of several members are summed."""

    members: Annotated[tuple[Text, ...], BeforeValidator(as_tuple)]
    scenes_of: Text | None = None  # name of the scenes in criteria.csv, if not that of the member


def _as_sequence(value: Any) -> Any:
    return value if isinstance(value, dict) else {"members": value}


class MainRow(Entry):
    """Row of the main table: the paper's entry and our values in both settings.

    A cell contains one value per tracker and measure. `hook` names a function in the paper's
    modules that returns the text of a setting's cell instead. `paper`: one text, or one per value.
    `claims`: claims whose verdicts mark the values on a page, in the order of the values.
    """

    labels: Annotated[tuple[str, ...], BeforeValidator(as_tuple)]
    paper: Names
    claims: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = ()
    sequences: Names = ()
    trackers: Names = ()
    measures: Names = ()
    hook: str = ""

    @property
    def separator(self) -> str:
        """Text between the values of a cell."""
        return ", " if len(self.measures) > 1 else " / "


class MainTable(Entry):
    """Main table of a paper.

    `heads`: headings of the label columns. `columns`: headings of the values if a page shows one
    column per value.
    """

    caption: Text
    heads: Names
    columns: Names = ()
    rows: tuple[MainRow, ...]


class FigureEntry(Entry):
    """Figure of the paper, drawn from our runs.

    A `strip` shows `frames` (numbered as in the paper), one row per tracker and setting. Its scene
    has the median error of the first tracker in the setting `recommended`. A `series` shows median
    and quartiles over scenes of a value per frame. A `hook` is a function in the paper's modules;
    `bench.papers.figures` describes its result.
    """

    kind: Literal["strip", "series", "hook"]
    caption: Text | dict[str, Text]  # content of the paper's figure; by file if there are several
    words: str = ""  # content of our figure, for hooks
    sequence: Text = ""
    trackers: Names = ()
    frames: tuple[int, ...] = ()
    # tracked (`on`) or lost (`off`) in the paper, by tracker and frame
    paper: dict[Text, tuple[Literal["on", "off"], ...]] = Field(default={})
    shape: Literal["box", "ellipse"] = "box"  # drawn around the target in a strip
    of: Text = "error"  # value per frame of a series
    quantity: str = ""  # axis label of a series with its unit
    hook: str = ""
    quick: bool = True  # False: the hook is not called with `--quick`

    def caption_of(self, stem: str) -> str:
        """Return the caption of a file, `figure-3-recommended`, by the start of its name."""
        if isinstance(self.caption, str):
            return self.caption
        names = [name for name in self.caption if f"{stem}-".startswith(f"{name}-")]
        if not names:
            raise ExperimentError(f"{stem}: `caption` has no entry for this figure. Add one.")
        return self.caption[max(names, key=len)]

    def is_drawn(self, quick: bool) -> bool:
        """Return whether a report contains the figure; quick reports contain no series."""
        return not quick or (self.quick and self.kind != "series")


class SensitivityColumn(Entry):
    """Column of the sensitivity table: a measure of a tracker on a sequence."""

    head: Text
    sequence: Text
    tracker: Text
    measure: Text


class SensitivityRow(Entry):
    """Choice that the paper leaves open, and the options that differ from those of a setting.

    `change`: options by tracker, which is named as in `paper.toml` or by its registered name.
    """

    choice: Text
    setting: Literal["as-written", "recommended"] = "recommended"
    change: Options = Field(default={})
    on: str = ""  # additional options of the sequences


class Sensitivity(Entry):
    """Sensitivity table of a paper, which has no verdicts."""

    scenes: Annotated[int, Field(ge=1)] = 8
    repetitions: Annotated[int, Field(ge=1)] = 1
    columns: tuple[SensitivityColumn, ...]
    rows: tuple[SensitivityRow, ...]


class Description(Entry):
    """Content of a `paper.toml`: what is run, shown and claimed."""

    name: Text
    version: Literal[1]
    title: Text
    citation: Text
    method: Text
    finding: Text  # result of the reproduction in one sentence
    # Runs of stochastic trackers; odd, so that no scene is undecided by half of its runs.
    repetitions: Annotated[int, Field(ge=1)] = 1
    frames_from: int = 0  # number of the first frame in the paper
    # Definition of a tracked frame: `within` (error up to half the mean box side), `inside` (centre
    # in the box), or a function in the paper's `measures.py`.
    on_target: Text = "within"
    trace: Literal["online", "revised"] = "online"
    quick_scenes: Annotated[int, Field(ge=1)] = 3
    trackers: dict[Text, Text]  # specifications by the names of claims, tables and figures
    settings: dict[Text, Options]  # options added to each tracker, by its registered name
    sequences: dict[Text, Annotated[SequenceEntry, BeforeValidator(_as_sequence)]]
    setting_table: tuple[tuple[str, ...], ...]  # parameter, both settings, source
    main_table: MainTable
    figure: dict[Text, FigureEntry] = Field(default={})

    @model_validator(mode="after")
    def _check_names(self) -> "Description":
        if self.repetitions % 2 == 0:
            raise ValueError(f"repetitions is {self.repetitions}; expected: an odd number")
        if {*self.settings} != {*SETTINGS}:
            raise ValueError(f"settings must be {' and '.join(SETTINGS)}")
        for row in self.main_table.rows:
            self.check_names(row.trackers, row.sequences, f"main table, {row.labels[0]}")
        for name, figure in self.figure.items():
            sequences = (figure.sequence,) if figure.sequence else ()
            self.check_names(figure.trackers, sequences, f"figure {name}")
        return self

    def check_names(self, trackers: Names, sequences: Names, place: str) -> None:
        """Raise `ValueError` for trackers or sequences that `paper.toml` does not define."""
        for names, valid_names, kind in (
            (trackers, self.trackers, "tracker"),
            (sequences, self.sequences, "sequence"),
        ):
            if unknown := [name for name in names if name not in valid_names]:
                raise ValueError(
                    f"{place}: unknown {kind} {unknown[0]!r}; known: {', '.join(valid_names)}"
                )


def read_description(name: str, path: Path | None = None) -> Description:
    """Read the `paper.toml` of a paper, or the file `path`; raise `ExperimentError` on errors."""
    path = path or FOLDER / name / "paper.toml"
    return checked(Description, {"name": name, **read_toml(path, ExperimentError)}, str(path))


def read_sensitivity(name: str, path: Path | None = None) -> Sensitivity:
    """Read a paper's `sensitivity.toml`, or the file `path`; raise `ExperimentError` on errors."""
    path = path or FOLDER / name / "sensitivity.toml"
    return checked(Sensitivity, read_toml(path, ExperimentError), str(path))
