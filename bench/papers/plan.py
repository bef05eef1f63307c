"""Which runs a paper's claims, tables and figures need, as experiments."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

from bench.claims.claims_file import Claim
from bench.claims.row_verdicts import SETTINGS
from bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from bench.papers import Effort
from bench.papers.description import Description, Sensitivity
from bench.papers.scene_check import passing_scenes, read_values
from datasets.text_form import format_text, parse_text

FIRST_SCENE = 200  # of sequences without criteria; trials have used those before
MAIN_SCENES = 24


@dataclass(frozen=True)
class Request:
    """Runs of one tracker on the first scenes of a sequence.

    Attributes
    ----------
    sequence : str
        Name of `paper.toml`.
    tracker : str
        Text form, with the options of a setting.
    scenes, repetitions : int
        How many there are.
    on : str
        Further options of the sequence, as `light=dappled`.
    """

    sequence: str
    tracker: str
    scenes: int
    repetitions: int
    on: str = ""


def options_of(text: str) -> dict[str, str]:
    """Return options in text form, as `preset=as-written:sigma=1`."""
    return parse_text(f":{text}")[1] if text else {}


def tracker_text(
    description: Description, tracker: str, setting: str, change: Mapping[str, str] | None = None
) -> str:
    """Return the text form of a tracker of `paper.toml` in a setting, with changed options."""
    name, own = parse_text(description.trackers[tracker])
    usual = options_of(description.settings[setting].get(name, ""))  # type: ignore[index]
    changed = options_of((change or {}).get(name, ""))
    return format_text(name, {**usual, **own, **changed})


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
    """Return text forms of the first scenes of a sequence, each as a list of its members.

    Raises
    ------
    ExperimentError
        If fewer scenes meet the criteria than are asked for.
    """
    entry = description.sequences[sequence]
    first, _ = parse_text(entry.members[0])
    known = verdict_scenes(description.name, entry.scenes_of or first)
    if known and len(known) < count:
        raise ExperimentError(
            f"{description.name}: {count} scenes of {sequence} are asked for, and {len(known)} "
            f"meet the criteria. Check more: python -m bench.papers.scene_check {description.name}."
        )
    numbers = known or range(FIRST_SCENE, FIRST_SCENE + count)
    further = options_of(on)
    named = [parse_text(member) for member in entry.members]
    return [
        [format_text(name, {**options, **further, "scene": number}) for name, options in named]
        for number in numbers[:count]
    ]


def requests(
    description: Description, claims: Mapping[str, Claim], effort: Effort
) -> list[Request]:
    """Return the runs that the main table, the figures and, unless quick, the claims need."""
    wanted: dict[tuple[str, str], int] = {}

    def want(sequences: Iterable[str], trackers: Iterable[str], count: int) -> None:
        for sequence in sequences:
            for tracker in trackers:
                for setting in SETTINGS:
                    key = sequence, tracker_text(description, tracker, setting)
                    wanted[key] = max(wanted.get(key, 0), count)

    shown = description.quick_scenes if effort.quick else MAIN_SCENES
    for row in description.main.rows:
        want(row.sequences, row.trackers, shown)
    for figure in description.figure.values():
        if figure.sequence and (figure.quick or not effort.quick):
            want([figure.sequence], figure.trackers, shown)
    for claim in () if effort.quick else claims.values():
        want(claim.sequences, claim.trackers, claim.n_scenes)
    repetitions = 1 if effort.quick else description.repetitions
    repetitions = min(repetitions, effort.seeds or repetitions)
    return [
        Request(sequence, tracker, count, repetitions)
        for (sequence, tracker), count in wanted.items()
    ]


def sensitivity_requests(description: Description, table: Sensitivity) -> list[Request]:
    """Return the runs of the sensitivity table."""
    return list(
        dict.fromkeys(
            Request(
                column.sequence,
                tracker_text(description, column.tracker, row.setting, row.change),
                table.scenes,
                min(table.repetitions, description.repetitions),
                row.on,
            )
            for row in table.rows
            for column in table.columns
        )
    )


def experiments(
    description: Description, wanted: Iterable[Request], suffix: str = ""
) -> list[Experiment]:
    """Return requests as experiments: sequences with equal trackers and counts share one."""
    by_sequence: dict[tuple[str, str, int, int], list[str]] = {}
    for one in wanted:
        key = one.sequence, one.on, one.scenes, one.repetitions
        by_sequence.setdefault(key, []).append(one.tracker)
    groups: dict[tuple[tuple[str, ...], int], list[tuple[str, str, int]]] = {}
    for (sequence, on, scenes, repetitions), trackers in by_sequence.items():
        group = tuple(dict.fromkeys(trackers)), repetitions
        groups.setdefault(group, []).append((sequence, on, scenes))
    found: list[Experiment] = []
    for (chosen, repetitions), places in groups.items():
        texts = [
            text
            for sequence, on, scenes in places
            for names in scene_names(description, sequence, scenes, on)
            for text in names
        ]
        first = places[0][0].replace(" ", "-")
        name = f"{description.name}-{suffix}{first}"
        while name in {one.name for one in found}:
            name += "-more"
        found.append(
            Experiment(
                name=name,
                trackers=chosen,
                sequences=tuple(map(SequenceSource, dict.fromkeys(texts))),
                repetitions=repetitions,
                title=f"{description.name}: {', '.join(sequence for sequence, *_ in places)}"[:90],
            )
        )
    return found
