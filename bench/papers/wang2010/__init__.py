"""CamShift improved by motion, inside a particle filter: its baselines, Table 1, Fig. 1 to 6."""

from collections.abc import Sequence
from dataclasses import replace
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
    "TIMED",
    "TITLE",
    "examined_scenes",
    "examined_tables",
    "experiments",
    "prepare",
    "report",
]

TITLE = "An improved CamShift inside a particle filter for real-time target tracking"

FIGURES = tuple(f"wang2010-figure-{number}" for number in (3, 5, 6))
TIMED = "wang2010-table-1"
SENSITIVITIES = ("wang2010-sensitivities", "wang2010-sensitivities-cup")
DEFAULT = (*FIGURES, "wang2010-particles", *SENSITIVITIES, TIMED)
FURTHER = tuple(f"wang2010-{name}" for name in ("plain-background", "readings", "readings-cup"))
THOROUGH = 5  # repetitions
RECORDED = Recorded(
    name="wang2010-recorded",
    title="CamShift inside a particle filter on recorded sequences",
    trackers=(
        "wang2010:preset=as-written",
        "wang2010",
        "wang2010:preset=robust",
        "wang2010:beta=0",
        "particle-filter:preset=as-written",
        "particle-filter",
        "camshift-improved",
        "camshift-improved:window=adaptive",
        "camshift",
        "camshift:window=adaptive",
        "opencv-camshift",
        "mean-shift",
        "static",
    ),
    others=("CPF", "KMS", "SMS", "MS", "VR", "TM"),
)
"""Of the OTB comparison: Pérez' colour particle filter, kernel mean shift with and without scale,
mean shift, variance ratio, template matching."""


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    names = DEFAULT + (FURTHER if effort.everything else ())
    if effort.quick:  # what takes longest, and says nothing with few scenes
        names = tuple(name for name in names if name not in SENSITIVITIES)
    chosen = affordable(names, effort)
    if effort.everything and not effort.quick:
        chosen = [_thorough(one, effort) if one.name in SENSITIVITIES else one for one in chosen]
    return with_recorded(chosen, effort, RECORDED)


def _thorough(experiment: Experiment, effort: Effort) -> Experiment:
    """Sensitivities have few repetitions, but where everything is asked for."""
    repetitions = min(THOROUGH, effort.seeds or THOROUGH)
    return replace(experiment, repetitions=max(experiment.repetitions, repetitions))


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: measures on scenes what no run shows."""
    examined_tables(folder, effort)


def examined_tables(folder: Path, effort: Effort) -> "dict[str, DataFrame]":
    """What `checks` measures on the scenes of the figures; what is known is looked up.

    Parameters
    ----------
    folder : Path
        Of the report; keeps what was measured.
    effort : Effort
        How much is asked for.
    """
    from bench.papers.examination import examined_for
    from bench.papers.wang2010.checks import examine

    return examined_for(effort, examine, examined_scenes(effort), folder)


def examined_scenes(effort: Effort) -> list[str]:
    """Names of the sequences of the figures, and of others whose camera moves."""
    from bench.papers.wang2010.checks import MOVING_CAMERA

    figures = [source.text for one in affordable(FIGURES, effort) for source in one.sequences]
    return [*figures, *MOVING_CAMERA]


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.wang2010.reporting import make_report

    return make_report(results, folder, effort, asked)
