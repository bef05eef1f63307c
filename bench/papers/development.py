"""Development data of a paper: what was measured to choose the defaults of its trackers.

`development.toml` names the runs and the values that were compared. `tools/development.py`, which
is not part of the wheel, executes the runs and stores their means in `development.csv`. None of the
scenes of the claims is among them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated

import pandas as pd
from pydantic import Field, InstanceOf

from trackmark.bench.experiments.experiment import ExperimentError, read_toml
from trackmark.bench.papers import paper_file
from trackmark.bench.papers.cases import (
    Case,
    MeasureName,
    PaperTracker,
    SequenceName,
    SequenceNames,
    TrackerName,
)
from trackmark.bench.papers.paper import ChainStep, OptionTexts, Paper, changed_options
from trackmark.bench.papers.toml_table import NonEmptyText, Texts, TomlTable, validated

FIRST_SCENE = 100
"""First scene of the development data; claims are judged on scenes from 200 on."""

N_RECORDINGS = 7
"""Number of recordings."""

N_SCENES = 16
"""Number of development scenes per sequence, unless the cost of a paper's runs forbids it."""

WRITTEN, RECOMMENDED = "as-written", "recommended"

ALL = "all"
"""Name of all sequences, or of all recordings, in `development.csv`."""


class DevelopmentRuns(TomlTable):
    """Tracker of a paper, and the sequences on which it runs with every variant.

    `recordings`: False if another tracker of the same registered name runs on the recordings.
    """

    tracker: TrackerName
    sequences: SequenceNames
    recordings: bool = True


class Candidate(TomlTable):
    """Values that were compared with the recommended ones, and not taken.

    A candidate with a `reason` is as well founded as the recommended value. The other candidates
    are choices that the text leaves open. `changed_options`: options by tracker,
    which is named as in `paper.toml` or by its registered name.
    """

    name: NonEmptyText
    changed_options: OptionTexts
    reason: str = ""


class Development(TomlTable):
    """Content of `development.toml`.

    `measure`: main measure of the paper's page, a share from 0 to 1. `scenes`: number of scenes per
    sequence; `reason`: reason, if it is not `N_SCENES`. `choice_scenes`: number of scenes on
    which the candidates without a reason run. `skipped_recordings`: names of recordings that would
    take too long.
    """

    measure: MeasureName
    heading: NonEmptyText  # of the measure on a page
    scenes: Annotated[int, Field(ge=1, le=N_SCENES)] = N_SCENES
    reason: str = ""
    choice_scenes: Annotated[int, Field(ge=1, le=N_SCENES)] = N_SCENES
    skipped_recordings: Texts = ()
    runs: tuple[DevelopmentRuns, ...]
    candidates: tuple[Candidate, ...] = ()

    @property
    def n_recordings(self) -> int:
        """Number of recordings on which the variants run."""
        return N_RECORDINGS - len(self.skipped_recordings)


class SensitivityColumn(TomlTable):
    """Column of the sensitivity table: a measure of a tracker on a sequence."""

    heading: NonEmptyText
    sequence: SequenceName
    tracker: TrackerName
    measure: MeasureName


class Sensitivity(TomlTable):
    """Sensitivity table of a paper, which has no verdicts.

    Its rows are candidates of `development.toml` without a reason: choices that the paper leaves
    open. Columns of trackers that a candidate does not change have the recommended values.
    """

    scenes: Annotated[int, Field(ge=1)] = 8
    columns: tuple[SensitivityColumn, ...]
    rows: tuple[InstanceOf[Candidate], ...]

    def case(self, row: Candidate, column: SensitivityColumn) -> Case:
        """Return the runs behind a cell of the table."""
        changes = changed_options(row.changed_options, column.tracker)
        return Case(column.tracker.spec(RECOMMENDED, changes), column.sequence, self.scenes)


@dataclass(frozen=True)
class Variant:
    """Values of a tracker on development data, and the variant with which they are compared."""

    name: str
    setting: str
    changed_options: Mapping[str, str] = field(default_factory=dict)
    reference: str = ""  # name of a variant; empty for the first one
    n_scenes: int = N_SCENES  # per sequence
    on_recordings: bool = True

    def spec(self, tracker: PaperTracker) -> str:
        """Return the specification of a tracker with the values of the variant."""
        return tracker.spec(self.setting, self.changed_options)


def read_development(paper: Paper) -> Development:
    """Read a paper's `development.toml`; raise `ExperimentError` on errors."""
    path = paper_file(paper.name, "development.toml")
    return validated(Development, read_toml(path, ExperimentError), str(path), paper.names)


def read_sensitivity(paper: Paper) -> Sensitivity:
    """Read a paper's `sensitivity.toml`; raise `ExperimentError` on errors."""
    path = paper_file(paper.name, "sensitivity.toml")
    table = read_toml(path, ExperimentError)
    candidates = {candidate.name: candidate for candidate in read_development(paper).candidates}
    if unknown := [name for name in table["rows"] if name not in candidates]:
        raise ExperimentError(
            f"{path}: {unknown[0]!r} is no candidate of development.toml. Add it there."
        )
    rows = [candidates[name] for name in table["rows"]]
    return validated(Sensitivity, {**table, "rows": rows}, str(path), paper.names)


def variants(paper: Paper, development: Development, tracker: PaperTracker) -> list[Variant]:
    """Return the variants of a tracker.

    They are the as-written values, each step of its chain alone, the first steps together, the
    default, and the candidates that change the tracker.
    """
    n_scenes, steps = development.scenes, paper.steps(tracker.registered_name)
    compared = [Variant(WRITTEN, WRITTEN, n_scenes=n_scenes)]
    for step in steps:
        options = {step.parameter: step.recommended}
        variant = Variant(alone(step), WRITTEN, options, WRITTEN, n_scenes, on_recordings=False)
        compared.append(variant)
    options, previous = {}, WRITTEN
    for step in steps:
        options = options | {step.parameter: step.recommended}
        compared.append(Variant(together(step), WRITTEN, options, previous, n_scenes))
        previous = together(step)
    compared.append(Variant(RECOMMENDED, RECOMMENDED, {}, WRITTEN, n_scenes))
    for candidate in development.candidates:
        if options := changed_options(candidate.changed_options, tracker):
            is_reasoned = bool(candidate.reason)
            limit = n_scenes if is_reasoned else min(n_scenes, development.choice_scenes)
            compared.append(
                Variant(candidate.name, RECOMMENDED, options, RECOMMENDED, limit, is_reasoned)
            )
    return compared


def alone(step: ChainStep) -> str:
    """Return the name of the variant that takes only one step from the text."""
    return f"only {step.parameter}"


def together(step: ChainStep) -> str:
    """Return the name of the variant that takes all steps up to this one."""
    return f"up to {step.parameter}"


@cache
def read_effects(paper: str) -> pd.DataFrame:
    """Read a paper's `development.csv`.

    Columns: `data` (`scenes` or `recordings`), `sequence`, `tracker`, `variant`, `measure`, `value`
    (mean), `n` (number of units), `reference` (name of a variant), `difference` (mean difference
    from the reference), `low` and `high` (its interval) and `decision` (label of `rules.decide`).
    The tracker is a name of `paper.toml`. In rows on `all` sequences it is a registered name.
    """
    file = paper_file(paper, "development.csv")
    return pd.read_csv(file, keep_default_na=False, na_values=[""], encoding="utf-8")


def effect(paper: str, data_set: str, tracker: str, variant: str) -> "pd.Series | None":
    """Return the row of a tracker that covers most units; None if it was not measured.

    `data_set`: `scenes` or `recordings`. `tracker`: a registered name, for the row on all
    sequences, or a name of `paper.toml`, for the row on its sequence.
    """
    effects = read_effects(paper)
    rows = effects[
        (effects["data"] == data_set)
        & (effects["tracker"] == tracker)
        & (effects["variant"] == variant)
    ]
    return None if rows.empty else rows.sort_values("n").iloc[-1]


def registered_names(development: Development) -> Iterator[str]:
    """Yield the registered names of the trackers, each once."""
    yield from dict.fromkeys(runs.tracker.registered_name for runs in development.runs)
