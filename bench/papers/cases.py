"""Trackers and sequences of a paper, and the cases that they form.

The files of a paper name trackers, sequences, measures and functions. The annotated types of this
module replace each name by its object while a file is read, so that a wrong name is an error in
its field.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, TypeVar

import pandas as pd
from pydantic import BeforeValidator, InstanceOf, ValidationInfo

from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers.criteria import passing_scenes, read_criteria, read_values
from trackmark.bench.papers.measures import Measure, find_function, find_measure, frame_values
from trackmark.bench.papers.toml_table import as_tuple
from trackmark.datasets.spec_string import format_text, parse_text

Found = TypeVar("Found")

POSED_SCENES = 40
"""Number of first scenes of a sequence that are asked whether they pose the problem."""


@dataclass(frozen=True)
class PaperTracker:
    """Tracker of a paper, whose preset in a setting has the name of the setting.

    A tracker with equal values in both settings names its preset in its options.
    """

    name: str  # in claims, tables and figures
    registered_name: str
    options: Mapping[str, str]  # in both settings

    def spec(self, setting: str, changed_options: Mapping[str, str] | None = None) -> str:
        """Return the specification of the tracker in a setting, with changed options."""
        options = {"preset": setting, **self.options, **(changed_options or {})}
        return format_text(self.registered_name, options)


@dataclass(frozen=True)
class PaperSequence:
    """Sequence as named in claims and tables. Values of several members are summed.

    Each member has its own list of scenes, unless `scenes_of` names a common one. A member with
    options, such as `multipart/1:others=exchanged`, has the scenes of `criteria.csv` under this
    text, or else those of its sequence without options.
    """

    name: str
    paper: str
    members: tuple[str, ...]  # specifications without the scene
    scenes_of: str = ""  # name of the scenes in criteria.csv, if not that of the member

    def scenes(self, n_scenes: int) -> list[tuple[str, ...]]:
        """Return the specifications of the first scenes, one per member.

        Raises `ExperimentError` if fewer scenes meet the criteria than are requested.
        """
        members = []
        for member in self.members:
            name, options = parse_text(member)
            passing = verdict_scenes(self.paper, self.scenes_of or member)
            if len(passing) < n_scenes:
                raise ExperimentError(
                    f"{self.paper}: {n_scenes} scenes of {self.name} are requested, but only "
                    f"{len(passing)} meet the criteria. Check more: "
                    f"python -m tools.scene_check {self.paper}."
                )
            members.append(
                [format_text(name, {**options, "scene": scene}) for scene in passing[:n_scenes]]
            )
        return list(zip(*members, strict=True))


@dataclass(frozen=True)
class Case:
    """Runs of a tracker on the first scenes of a sequence."""

    tracker: str  # specification
    sequence: PaperSequence
    n_scenes: int

    @property
    def scenes(self) -> list[tuple[str, ...]]:
        """Specifications of the scenes, one per member of the sequence."""
        return self.sequence.scenes(self.n_scenes)

    @property
    def scenes_of_members(self) -> list[str]:
        """Specifications of the scenes of all members."""
        return [scene for members in self.scenes for scene in members]


@dataclass(frozen=True)
class Names:
    """Objects that the names in the files of a paper stand for."""

    paper: str
    trackers: Mapping[str, PaperTracker]
    sequences: Mapping[str, PaperSequence]


def _find(noun: str, name: str, valid: Mapping[str, Found]) -> Found:
    if name not in valid:
        raise ValueError(f"unknown {noun} {name!r}; known: {', '.join(valid)}")
    return valid[name]


def parse_options(options: str) -> dict[str, str]:
    """Parse options such as `preset=as-written:sigma=1` into a dictionary."""
    return parse_text(f":{options}")[1] if options else {}


@cache
def verdict_scenes(paper: str, member: str) -> tuple[int, ...]:
    """Return the numbers of the scenes of a sequence that meet all criteria.

    `member`: the sequence, with options if `criteria.csv` has values of this variant.
    """
    values = read_values(paper)
    return tuple(passing_scenes(values, _measured_name(values, member)))


def _measured_name(values: pd.DataFrame, member: str) -> str:
    """Return the name of a sequence in `criteria.csv`, without its options if they have none."""
    is_measured = values["sequence"].eq(member).any()
    return member if is_measured else parse_text(member)[0]


@cache
def posed_scenes(paper: str, member: str) -> tuple[int, int]:
    """Return how many of the first scenes of a sequence pose the problem, and their number.

    A scene poses the problem if it meets all criteria of difficulty; both numbers count up to
    `POSED_SCENES`. They are 0 if the sequence has no such criterion. `member`: see
    `verdict_scenes`.
    """
    values = read_values(paper)
    sequence = _measured_name(values, member)
    names = {
        criterion.name
        for criterion in read_criteria(paper)[1]
        if criterion.sequence == sequence and criterion.kind == "difficulty" and criterion.target
    }
    rows = values[(values["sequence"] == sequence) & values["name"].isin(names)]
    passes = rows.groupby("scene", sort=False)["passes"].all().head(POSED_SCENES)
    return int(passes.sum()), len(passes)


def _resolved_by(find: Callable[[Names, str], Any]) -> BeforeValidator:
    """Return a validator that replaces a name by the object that `find` returns for it."""

    def resolve(value: Any, info: ValidationInfo) -> Any:
        names: Any = info.context
        return find(names, value) if isinstance(value, str) else value

    return BeforeValidator(resolve)


TrackerName = Annotated[
    InstanceOf[PaperTracker],
    _resolved_by(lambda names, name: _find("tracker", name, names.trackers)),
]
SequenceName = Annotated[
    InstanceOf[PaperSequence],
    _resolved_by(lambda names, name: _find("sequence", name, names.sequences)),
]
MeasureName = Annotated[
    InstanceOf[Measure], _resolved_by(lambda names, spec: find_measure(spec, names.paper))
]
FunctionName = Annotated[
    Callable[..., Any], _resolved_by(lambda names, name: find_function(name, names.paper))
]
FrameValuesName = Annotated[
    Callable[..., Any], _resolved_by(lambda names, name: frame_values(name, names.paper))
]

TrackerNames = Annotated[tuple[TrackerName, ...], BeforeValidator(as_tuple)]
SequenceNames = Annotated[tuple[SequenceName, ...], BeforeValidator(as_tuple)]
MeasureNames = Annotated[tuple[MeasureName, ...], BeforeValidator(as_tuple)]
