"""Cues that depend on one another: the paper's figures, its one-dimensional example, its claims."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bench.experiments.experiment import Experiment
from bench.papers import Asked, Effort, Report
from bench.papers.recorded import Recorded
from bench.papers.selection import affordable, with_recorded
from datasets.text_form import parse_text

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = [
    "FIGURES",
    "LIGHT",
    "RECORDED",
    "TIMED",
    "TITLE",
    "examined_scenes",
    "experiments",
    "measured_tables",
    "prepare",
    "report",
]

TITLE = "Integration of conditionally dependent object features for figure-background segmentation"

FIGURES = {number: f"moreno2005-figure-{number}" for number in (7, 8, 9, 10)}
"""Experiments of the paper's figures, by their numbers."""

LIGHT, TIMED = "moreno2005-light", "moreno2005-time"
QUICK = (*FIGURES.values(), LIGHT, TIMED)
BESIDE = tuple(
    f"moreno2005-{name}" for name in ("association", "shadow", "self-shadow", "kalman", "moderate")
)
FURTHER = tuple(
    f"moreno2005-{name}" for name in ("ablations", "diagonal", "literal", "temperatures", "learnt")
)
NOT_QUICK = (*BESIDE, "moreno2005-learnt")

RECORDED = Recorded(
    name="moreno2005-recorded",
    title="Dependent cues on recorded sequences",
    trackers=(
        "moreno2005:preset=as-written",
        "moreno2005",
        "moreno2005:preset=robust",
        "moreno2005:association=uniform",
        "contour-smooth-color",
        "contour-smooth-color:plane=refitted",
        "contour-smooth-color:mixing=0.5",
        "contour-smooth-color:preset=robust",
        "static",
    ),
    others=(),
)


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    names = [*QUICK, *BESIDE, *(FURTHER if effort.everything else ())]
    left_out = NOT_QUICK if effort.quick else ()
    chosen = affordable([name for name in names if name not in left_out], effort, _is_quick)
    return with_recorded(chosen, effort, RECORDED)


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: simulates one dimension, measures what no run shows."""
    measured_tables(folder, effort)


def measured_tables(folder: Path, effort: Effort) -> "dict[str, DataFrame]":
    """What is measured of the example and on scenes; or found before.

    Parameters
    ----------
    folder : Path
        Of the report; keeps what was measured.
    effort : Effort
        How much is asked for.
    """
    import os

    from bench.papers.examination import examined_for
    from bench.papers.moreno2005 import example_tables, scenes

    jobs = effort.jobs or os.cpu_count() or 1
    return {
        **example_tables.measure(folder, jobs, quick=effort.quick),
        **examined_for(effort, scenes.examine, examined_scenes(effort), folder),
    }


def examined_scenes(effort: Effort) -> list[str]:
    """Names of the sequences of the figures."""
    chosen = affordable(tuple(FIGURES.values()), effort, _is_quick)
    return [source.text for one in chosen for source in one.sequences]


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.moreno2005.reporting import make_report

    return make_report(results, folder, effort, asked)


def _is_quick(text: str) -> bool:
    """Whether a sequence is of the first scene."""
    return int(parse_text(text)[1].get("scene", 0)) == 0
