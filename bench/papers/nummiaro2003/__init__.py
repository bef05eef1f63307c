"""The adaptive elliptic colour particle filter: Fig. 2 to 10, and what the text claims of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bench.experiments.experiment import Experiment
from bench.papers import Asked, Effort, Report
from bench.papers.recorded import Recorded
from bench.papers.selection import affordable, with_recorded

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = [
    "RECORDED",
    "TITLE",
    "examined_scenes",
    "examined_tables",
    "experiments",
    "prepare",
    "report",
]

TITLE = "Color Features for Tracking Non-Rigid Objects: an adaptive colour particle filter"

FIGURES = tuple(f"nummiaro2003-figure-{number}" for number in (4, 6, 8, 10, 5))
FURTHER = tuple(
    f"nummiaro2003-{name}"
    for name in (
        *("figure-9", "readings", "placement", "ablations"),
        *("tree", "light", "clutter", "noise"),
    )
)
RECORDED = Recorded(
    name="nummiaro2003-recorded",
    title="Adaptive colour particle filter on recorded sequences",
    trackers=(
        "nummiaro2003:preset=as-written",
        "nummiaro2003:preset=as-written:model_update=false",
        "nummiaro2003",
        "nummiaro2003:model_update=false",
        "nummiaro2003:preset=robust",
        "multipart",
        "multipart:preset=robust",
        "mean-shift",
        "mean-shift-kalman",
        "static",
    ),
    others=("CPF", "KMS", "SMS", "MS", "VR", "TM"),
)
"""Of the OTB comparison: Pérez' colour particle filter, kernel mean shift with and without scale,
mean shift, variance ratio, template matching."""


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    return with_recorded(_synthetic(effort), effort, RECORDED)


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: measures on scenes what no run shows."""
    examined_tables(folder, effort)


def examined_tables(folder: Path, effort: Effort) -> "dict[str, DataFrame]":
    """What `scenes` measures on those of the figures; what is known is looked up.

    Parameters
    ----------
    folder : Path
        Of the report; keeps what was measured.
    effort : Effort
        How much is asked for.
    """
    from bench.papers.examination import examined_for
    from bench.papers.nummiaro2003.scenes import examine

    return examined_for(effort, examine, examined_scenes(effort), folder)


def examined_scenes(effort: Effort) -> list[str]:
    """Names of the sequences of the figures."""
    every = [
        source.text
        for experiment in affordable(FIGURES, effort)
        if not experiment.timing
        for source in experiment.sequences
    ]
    return list(dict.fromkeys(every))


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.nummiaro2003.reporting import make_report

    return make_report(results, folder, effort, asked)


def _synthetic(effort: Effort) -> list[Experiment]:
    return affordable(FIGURES + (FURTHER if effort.everything else ()), effort)
