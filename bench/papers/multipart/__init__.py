"""The adaptive single-/multi-part colour-histogram particle filter: Table 1, Fig. 3 and 4."""

import os
from collections.abc import Sequence
from pathlib import Path

from bench.experiments.experiment import Experiment
from bench.papers import Asked, Effort, Report
from bench.papers.recorded import Recorded
from bench.papers.selection import affordable, with_recorded

__all__ = ["RECORDED", "TITLE", "experiments", "prepare", "report"]

TITLE = "Adaptive multi-part and single-part colour histograms with a particle filter"

DEFAULT = ("multipart-table-1", "multipart-twin", "multipart-time")
FURTHER = ("multipart-other-light", "multipart-readings", "multipart-dynamics")
RECORDED = Recorded(
    name="multipart-recorded",
    title="Multi-part histograms on recorded sequences",
    trackers=(
        "multipart:representation=single",
        "multipart:representation=multi",
        "multipart",
        "multipart:preset=robust",
        "camshift",
        "static",
    ),
    others=("CPF", "KMS", "MS"),
)
"""CPF is Pérez' particle filter, KMS kernel mean shift, MS mean shift, of the OTB comparison."""


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    return with_recorded(_synthetic(effort), effort, RECORDED)


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: examines the scenes of the tables."""
    from bench.papers.multipart.static import examine_all

    folder.mkdir(parents=True, exist_ok=True)
    examine_all(_scenes(effort), folder, effort.jobs or os.cpu_count() or 1)


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.multipart.reporting import make_report

    return make_report(results, folder, effort, asked)


def _synthetic(effort: Effort) -> list[Experiment]:
    return affordable(DEFAULT + (FURTHER if effort.everything else ()), effort)


def _scenes(effort: Effort) -> list[str]:
    """Names of the sequences whose scenes the tables draw."""
    found = [
        source.text
        for experiment in _synthetic(effort)
        if experiment.name in ("multipart-table-1", "multipart-other-light")
        for source in experiment.sequences
    ]
    return list(dict.fromkeys(found))
