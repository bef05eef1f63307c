"""Which of a paper's experiments an effort affords, and what of each."""

from collections.abc import Iterable
from dataclasses import replace

import datasets
from bench.claims.kinds import NoWorseTest, PartsTest
from bench.claims.ledger import Claim
from bench.experiments.experiment import Experiment, read_experiment
from bench.papers import Effort
from bench.papers.description import Description
from bench.papers.recorded import RECORDED, read_published
from bench.statistics.rules import MIN_UNITS_FOR_SMALL
from datasets.text_form import parse_text

__all__ = ["affordable", "experiments_of", "more_scenes", "more_to_run", "with_recorded"]

RECORDED_REPETITIONS = 20
QUICK_REPETITIONS = 1


def experiments_of(description: Description, effort: Effort) -> list[Experiment]:
    """All experiments of a paper on synthetic sequences, as far as an effort goes, in order."""
    entry = description.experiments
    names = entry.always + (entry.all if effort.everything else ())
    if effort.quick:
        names = tuple(name for name in names if name not in entry.not_quick + entry.timed)
    chosen = affordable(description, names, effort)
    if effort.quick or not effort.everything:
        return chosen
    least = {description.experiment(name): number for name, number in entry.thorough.items()}
    return [_thorough(one, least.get(one.name, 1), effort) for one in chosen]


def more_to_run(claim: Claim, description: Description, effort: Effort) -> str:
    """Which option would run what tests a claim, in words; empty where none would."""
    if effort.quick and claim.effort != "all":
        return "leave out --quick"
    further = {description.experiment(name) for name in description.experiments.all}
    if effort.everything or not (claim.effort == "all" or further & {*claim.experiment}):
        return "leave out --quick" if effort.quick else ""
    tests = claim.test.parts.values() if isinstance(claim.test, PartsTest) else [claim.test]
    if not any(isinstance(test, NoWorseTest) for test in tests):
        return "give --all"
    return f"give --all; that no difference matters takes {MIN_UNITS_FOR_SMALL} scenes or more"


def more_scenes(claim: Claim, description: Description, effort: Effort) -> str:
    """Which option would run more scenes of what tests a claim, likewise."""
    if effort.quick:
        return "leave out --quick"
    added = {description.experiment(name) for name in description.experiments.more_scenes}
    return "" if effort.everything or not added & {*claim.experiment} else "give --all for more"


def _thorough(experiment: Experiment, least: int, effort: Effort) -> Experiment:
    repetitions = min(least, effort.seeds or least)
    return replace(experiment, repetitions=max(experiment.repetitions, repetitions))


def affordable(description: Description, names: Iterable[str], effort: Effort) -> list[Experiment]:
    """Experiments (named as the description does) with the scenes and repetitions it affords.

    A quick effort takes of each so many scenes as `quick_scenes` says (one of those not named), of
    everything else that is swept the sequences with `quick_knobs`, and no tracker that
    `quick_without` names. An experiment without any is left out.
    """
    scaled = (_scaled(description, name, effort) for name in names)
    return [one for one in scaled if one is not None]


def _scaled(description: Description, name: str, effort: Effort) -> Experiment | None:
    experiment = read_experiment(description.experiment(name))
    most, sequences, trackers = effort.seeds, experiment.sequences, experiment.trackers
    if effort.quick:
        most = min(most or QUICK_REPETITIONS, QUICK_REPETITIONS)
        sequences = tuple(one for one in sequences if _is_quick(description, name, one.text))
        left_out = description.experiments.quick_without
        trackers = tuple(one for one in trackers if not _has_any(left_out, one))
        if not sequences or not trackers:
            return None
    if most is None:
        return experiment
    return replace(
        experiment,
        trackers=trackers,
        sequences=sequences,
        repetitions=min(experiment.repetitions, most),
        repeated={
            text: min(number, most)
            for text, number in experiment.repeated.items()
            if text in trackers
        },
    )


def _has_any(parameters: Iterable[str], text: str) -> bool:
    """Whether a tracker's text has one of these, each a key or `key=value`."""
    _, options = parse_text(text)
    return any(
        one in options or one in (f"{k}={v}" for k, v in options.items()) for one in parameters
    )


def _is_quick(description: Description, name: str, text: str) -> bool:
    """Whether a sequence is of the first scenes, and has the right knobs where it says any."""
    entry, (bare, options) = description.experiments, parse_text(text)
    if bare in entry.too_long_for_quick:
        return False
    knobs = entry.quick_knobs.items()
    has_knobs = all(options.get(key, str(value)) == str(value) for key, value in knobs)
    return has_knobs and int(options.get("scene", 0)) < entry.quick_scenes.get(name, 1)


def with_recorded(
    experiments: list[Experiment], description: Description, effort: Effort
) -> list[Experiment]:
    """The same, and the paper's trackers on the recorded sequences that are asked for.

    Raises
    ------
    ExperimentError
        For published figures that can't be read: before hours of runs, not after.
    SequenceError
        For a recorded sequence that can't be run.
    """
    if effort.published is not None:
        read_published(effort.published)
    if not effort.recorded or description.recorded is None:
        return experiments
    most = effort.seeds or (QUICK_REPETITIONS if effort.quick else RECORDED_REPETITIONS)
    name, repetitions = description.experiment(RECORDED), min(RECORDED_REPETITIONS, most)
    added = description.recorded.experiment(name, effort.recorded, repetitions)
    for source in added.sequences:
        datasets.load(source.text).check_runnable()
    return [*experiments, added]
