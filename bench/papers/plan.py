"""Runs that a paper's claims, tables and figures need, as experiments."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from trackmark.bench.claims.claims_file import Claim
from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.papers import Effort
from trackmark.bench.papers.description import Description, Sensitivity
from trackmark.bench.papers.scene_check import FIRST_SCENE, passing_scenes, read_values
from trackmark.datasets.spec_string import format_text, parse_text

MAIN_SCENES = 24


@dataclass(frozen=True)
class Request:
    """Runs of one tracker on the first scenes of a sequence."""

    sequence: str  # name in `paper.toml`
    tracker: str  # specification with the options of a setting
    scenes: int
    repetitions: int
    on: str = ""  # additional options of the sequence, such as `light=dappled`


def parse_options(text: str) -> dict[str, str]:
    """Parse options such as `preset=as-written:sigma=1` into a dictionary."""
    return parse_text(f":{text}")[1] if text else {}


def tracker_text(
    description: Description, tracker: str, setting: str, change: Mapping[str, str] | None = None
) -> str:
    """Return the specification of a tracker of `paper.toml` in a setting, with changed options.

    `change`: options by tracker, which is named as in `paper.toml` or by its registered name.
    """
    name, tracker_options = parse_text(description.trackers[tracker])
    setting_options = parse_options(description.settings[setting].get(name, ""))
    changes = change or {}
    changed_options = parse_options(changes.get(tracker, changes.get(name, "")))
    return format_text(name, {**setting_options, **tracker_options, **changed_options})


@cache
def verdict_scenes(paper: str, sequence: str) -> tuple[int, ...]:
    """Return the numbers of the scenes that meet all criteria; empty without criteria."""
    try:
        return tuple(passing_scenes(read_values(paper), sequence))
    except FileNotFoundError:
        return ()


def scene_names(
    description: Description, sequence: str, count: int, on: str = ""
) -> list[list[str]]:
    """Return the first scenes of a sequence as lists of specifications, one per member.

    Each member has its own list of passing scenes, unless `scenes_of` names a common one. Raises
    `ExperimentError` if fewer scenes meet the criteria than are requested.
    """
    entry = description.sequences[sequence]
    further = parse_options(on)
    members = []
    for member in entry.members:
        name, options = parse_text(member)
        numbers = _scene_numbers(description, sequence, entry.scenes_of or name, count)
        members.append([format_text(name, {**options, **further, "scene": n}) for n in numbers])
    return [list(texts) for texts in zip(*members, strict=True)]


def _scene_numbers(
    description: Description, sequence: str, checked_name: str, count: int
) -> Sequence[int]:
    passing = verdict_scenes(description.name, checked_name)
    if passing and len(passing) < count:
        raise ExperimentError(
            f"{description.name}: {count} scenes of {sequence} are requested, but only "
            f"{len(passing)} meet the criteria. Check more: "
            f"python -m trackmark.bench.papers.scene_check {description.name}."
        )
    return passing[:count] or range(FIRST_SCENE, FIRST_SCENE + count)


def requests(
    description: Description, claims: Mapping[str, Claim], effort: Effort
) -> list[Request]:
    """Return the runs that the main table, the figures and, unless quick, the claims need.

    All trackers of a sequence run on the same scenes, because images are rendered once for all
    trackers. The claim that needs the most scenes determines their number.
    """
    scene_counts: dict[str, int] = {}
    tracker_texts: dict[tuple[str, str], None] = {}

    def add(sequences: Iterable[str], trackers: Iterable[str], scenes: int) -> None:
        for sequence in sequences:
            scene_counts[sequence] = max(scene_counts.get(sequence, 0), scenes)
            for tracker in trackers:
                texts = [tracker_text(description, tracker, setting) for setting in SETTINGS]
                tracker_texts.update(dict.fromkeys((sequence, text) for text in texts))

    scenes_shown = description.quick_scenes if effort.quick else MAIN_SCENES
    for row in description.main_table.rows:
        add(row.sequences, row.trackers, scenes_shown)
    for figure in description.figure.values():
        if figure.sequence and figure.is_drawn(effort.quick):
            add([figure.sequence], figure.trackers, scenes_shown)
    for claim in () if effort.quick else claims.values():
        if claim.trackers:
            add(claim.sequences, claim.trackers, claim.n_scenes)
    repetitions = 1 if effort.quick else description.repetitions
    repetitions = min(repetitions, effort.seeds or repetitions)
    return [
        Request(sequence, tracker, scene_counts[sequence], repetitions)
        for sequence, tracker in tracker_texts
    ]


def sensitivity_requests(description: Description, table: Sensitivity) -> list[Request]:
    """Return the runs of the sensitivity table."""
    repetitions = min(table.repetitions, description.repetitions)
    requested = []
    for row in table.rows:
        for column in table.columns:
            text = tracker_text(description, column.tracker, row.setting, row.change)
            requested.append(Request(column.sequence, text, table.scenes, repetitions, row.on))
    return list(dict.fromkeys(requested))


def experiments(
    description: Description, needed_runs: Iterable[Request], suffix: str = ""
) -> list[Experiment]:
    """Convert requests to experiments; sequences with the same trackers share an experiment."""
    trackers: dict[tuple[str, str, int, int], list[str]] = {}
    for request in needed_runs:
        key = request.sequence, request.on, request.scenes, request.repetitions
        trackers.setdefault(key, []).append(request.tracker)
    groups: dict[tuple[tuple[str, ...], int], list[tuple[str, str, int]]] = {}
    for (sequence, on, scenes, repetitions), texts in trackers.items():
        groups.setdefault((tuple(texts), repetitions), []).append((sequence, on, scenes))
    planned: list[Experiment] = []
    for (tracker_texts, repetitions), sequence_keys in groups.items():
        names = [
            text
            for sequence, on, scenes in sequence_keys
            for members in scene_names(description, sequence, scenes, on)
            for text in members
        ]
        name = f"{description.name}-{suffix}{sequence_keys[0][0].replace(' ', '-')}"
        while name in {item.name for item in planned}:
            name += "-more"
        sequence_names = ", ".join(dict.fromkeys(sequence for sequence, *_ in sequence_keys))
        planned.append(
            Experiment(
                name=name,
                trackers=tracker_texts,
                sequences=tuple(map(SequenceSource, dict.fromkeys(names))),
                repetitions=repetitions,
                title=f"{description.name}: {sequence_names}",
            )
        )
    return planned
