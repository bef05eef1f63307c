"""Which experiments of a paper an effort affords."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import datasets
from bench.experiments.experiment import Experiment, read_experiment
from bench.papers import Effort
from bench.papers.recorded import Recorded, read_published
from datasets.text_form import parse_text

__all__ = ["FIRST", "affordable", "is_first", "with_recorded"]

RECORDED_REPETITIONS = 20
QUICK_REPETITIONS = 1


FIRST: Mapping[str, str | int] = {"light": "even", "distance": 0}
"""Knobs of what is first of all that is swept but scenes, as far as a sequence has them."""


def is_first(text: str, scenes: int = 1, knobs: Mapping[str, object] = FIRST) -> bool:
    """Whether a sequence is of the first scenes, and has these knobs where it says any."""
    _, options = parse_text(text)
    has_knobs = all(options.get(key, str(value)) == str(value) for key, value in knobs.items())
    return has_knobs and int(options.get("scene", 0)) < scenes


def affordable(
    names: Sequence[str],
    effort: Effort,
    quick_scenes: Mapping[str, int] | None = None,
    quick_knobs: Mapping[str, object] = FIRST,
) -> list[Experiment]:
    """Experiments with the scenes and repetitions that an effort affords, in order.

    A quick one takes of each experiment so many scenes (one of those not named), and of everything
    else that is swept the sequences with `quick_knobs`; of timing runs the last of these. An
    experiment without any is left out.
    """
    chosen = []
    for name in names:
        scenes = (quick_scenes or {}).get(name, 1)
        among_first = partial(is_first, scenes=scenes, knobs=quick_knobs)
        experiment = _scaled(read_experiment(name), effort, among_first)
        chosen += [] if experiment is None else [experiment]
    return chosen


def with_recorded(
    experiments: Sequence[Experiment], effort: Effort, recorded: Recorded
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
    if not effort.recorded:
        return list(experiments)
    most = effort.seeds or (QUICK_REPETITIONS if effort.quick else RECORDED_REPETITIONS)
    repetitions = min(RECORDED_REPETITIONS, most)
    added = recorded.experiment(effort.recorded, repetitions)
    for source in added.sequences:
        datasets.load(source.text).check_runnable()
    return [*experiments, added]


def _scaled(
    experiment: Experiment, effort: Effort, is_quick: Callable[[str], bool]
) -> Experiment | None:
    most = effort.seeds
    sequences = experiment.sequences
    if effort.quick:
        most = min(most or QUICK_REPETITIONS, QUICK_REPETITIONS)
        sequences = tuple(source for source in sequences if is_quick(source.text))
        sequences = sequences[-1:] if experiment.timing else sequences
        if not sequences:
            return None
    if most is None:
        return experiment
    return replace(
        experiment,
        sequences=sequences,
        repetitions=min(experiment.repetitions, most),
        repeated={text: min(number, most) for text, number in experiment.repeated.items()},
    )
