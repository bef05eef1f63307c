"""A template of per-pixel Kalman filters on colour invariants: its Table 1, Fig. 1, and claims."""

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
    "COLOURED",
    "LIGHTS",
    "RECORDED",
    "TABLE",
    "TIMED",
    "TITLE",
    "examined_scenes",
    "examined_tables",
    "experiments",
    "prepare",
    "report",
]

TITLE = "Template tracking using colour invariant pixel features"

LIGHTS, COLOURED, TABLE, TIMED = (
    f"nguyen2002-{name}" for name in ("figure-1", "coloured-lamps", "table-1", "time")
)
QUICK = (LIGHTS, COLOURED, TABLE, TIMED)
BESIDE = ("nguyen2002-settings",)
FURTHER = ("nguyen2002-readings", "nguyen2002-ablations")
QUICK_SCENES = 2
RECORDED = Recorded(
    name="nguyen2002-recorded",
    title="Template of Kalman filters on recorded sequences",
    trackers=(
        *(
            f"nguyen2002:preset={preset}:features={features}"
            for preset in ("as-written", "recommended")
            for features in ("intensity", "rgb", "invariants", "arctan")
        ),
        "nguyen2002:preset=robust",
        "nguyen2002:preset=robust:features=invariants",
        "static",
    ),
    others=("IVT", "L1APG", "TM"),
)
"""Of the OTB comparison: others that keep a template, in a subspace, sparsely, and as it is."""


def experiments(effort: Effort) -> Sequence[Experiment]:
    """See `bench.papers.Paper`."""
    names = [*QUICK, *(() if effort.quick else BESIDE), *(FURTHER if effort.everything else ())]
    return with_recorded(affordable(names, effort, _is_quick), effort, RECORDED)


def prepare(folder: Path, effort: Effort) -> None:
    """See `bench.papers.Paper`: measures on scenes what no run shows."""
    examined_tables(folder, effort)


def examined_tables(folder: Path, effort: Effort) -> "dict[str, DataFrame]":
    """What `checks` measures on the scenes of figure and table; what is known is looked up.

    Parameters
    ----------
    folder : Path
        Of the report; keeps what was measured.
    effort : Effort
        How much is asked for.
    """
    from bench.papers.examination import examined_for
    from bench.papers.nguyen2002.scenes import examine

    return examined_for(effort, examine, examined_scenes(effort), folder)


def examined_scenes(effort: Effort) -> list[str]:
    """Names of the sequences of figure and table."""
    chosen = affordable((LIGHTS, TABLE), effort, _is_quick)
    return [source.text for one in chosen for source in one.sequences]


def report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper`."""
    from bench.papers.nguyen2002.reporting import make_report

    return make_report(results, folder, effort, asked)


def _is_quick(text: str) -> bool:
    """Whether a sequence is of the first scenes: a set of clips is no set without all of them."""
    _, options = parse_text(text)
    return int(options.get("scene", 0)) < (1 if "lamps" in options else QUICK_SCENES)
