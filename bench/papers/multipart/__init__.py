"""The adaptive single-/multi-part colour-histogram particle filter: Table 1, Fig. 3 and 4."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import datasets
from bench.experiment import Experiment, read_experiment
from bench.papers import Asked, Effort, Report
from datasets.text_form import parse_text

__all__ = ["TITLE", "experiments", "prepare", "report"]

TITLE = "Adaptive multi-part and single-part colour histograms with a particle filter"

DEFAULT = ("multipart-table-1", "multipart-twin", "multipart-time")
FURTHER = ("multipart-other-light", "multipart-readings", "multipart-dynamics")
RECORDED_REPETITIONS = 20
QUICK_REPETITIONS = 1


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    from bench.papers.multipart.recorded import read_published, recorded_experiment

    names = DEFAULT + (FURTHER if effort.everything else ())
    affordable = (_scaled(read_experiment(name), effort) for name in names)
    chosen = [experiment for experiment in affordable if experiment is not None]
    if effort.published is not None:
        read_published(effort.published)  # what is wrong with it is said before hours of runs
    if effort.recorded:
        recorded = recorded_experiment(effort.recorded, RECORDED_REPETITIONS)
        for source in recorded.sequences:  # so are those that can't be run
            datasets.load(source.text).check_runnable()
        most = effort.seeds or (QUICK_REPETITIONS if effort.quick else RECORDED_REPETITIONS)
        chosen.append(replace(recorded, repetitions=min(recorded.repetitions, most)))
    return chosen


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: examines the scenes of the tables."""
    from bench.papers.multipart.static import examine_all

    folder.mkdir(parents=True, exist_ok=True)
    examine_all(_scenes(effort), folder, effort.jobs or os.cpu_count() or 1)


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.multipart.reporting import make_report

    return make_report(results, folder, effort, asked)


def _scenes(effort: Effort) -> list[str]:
    """Names of the sequences whose scenes the tables draw."""
    found = [
        source.text
        for experiment in experiments(replace(effort, recorded=(), published=None))
        if experiment.name in ("multipart-table-1", "multipart-other-light")
        for source in experiment.sequences
    ]
    return list(dict.fromkeys(found))


def _scaled(experiment: Experiment, effort: Effort) -> Experiment | None:
    """An experiment with the scenes and repetitions that an effort affords; None without any."""
    most = effort.seeds
    sequences = experiment.sequences
    if effort.quick:
        most = min(most or QUICK_REPETITIONS, QUICK_REPETITIONS)
        # The first of everything that is swept; of the timing runs the shortest.
        sequences = tuple(source for source in sequences if _is_first(source.text))
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


def _is_first(text: str) -> bool:
    """Whether a sequence is the first scene in even light, at distance 0 where there is one."""
    _, options = parse_text(text)
    light = options.get("light", "even")
    return light == "even" and all(float(options.get(key, 0)) == 0 for key in ("scene", "distance"))
