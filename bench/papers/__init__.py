"""The papers whose tables, figures and claims can be reproduced: one folder a paper.

`paper.toml` and `claims.toml` say what is run, shown and claimed (`description.py`,
`bench.claims`); `report.py` makes a report of it.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from bench.experiments.experiment import ExperimentError, SequenceSource
from bench.store.layout import Cell

if TYPE_CHECKING:
    from bench.papers.grounds import Ground
    from bench.papers.report import Paper
    from reports.tables import Table
from datasets.text_form import close_match

__all__ = ["NO_EVIDENCE", "Asked", "Effort", "Report", "load_paper", "paper_names"]

FOLDER = Path(__file__).parent

NO_EVIDENCE = "A quick look, no evidence"
"""Where every report of a quick effort begins."""


@dataclass(frozen=True)
class Effort:
    """How much of a reproduction is run.

    Attributes
    ----------
    quick : bool
        Fewer seeds and scenes: a look at whether it works, no evidence.
    everything : bool
        Also sensitivities, ablations and claims that the paper asserts without experiment.
    seeds : int or None
        Most repetitions of any tracker; None keeps those of the experiments.
    jobs : int or None
        Worker processes; None for one a core.
    recorded : tuple of SequenceSource
        Recorded sequences to run the paper's trackers on, too.
    published : Path or None
        Figures that others published on those (CSV), to stand beside ours.
    """

    quick: bool = False
    everything: bool = False
    seeds: int | None = None
    jobs: int | None = None
    recorded: tuple[SequenceSource, ...] = ()
    published: Path | None = None

    @property
    def words(self) -> str:
        """What is marked on everything that comes of it; empty for the whole."""
        marks = []
        if self.quick:
            marks.append(f"{NO_EVIDENCE[:1].lower()}{NO_EVIDENCE[1:]}: few scenes and seeds")
        if self.seeds is not None:
            marks.append(f"at most {self.seeds} repetitions")
        return "; ".join(marks)


@dataclass(frozen=True)
class Report:
    """What a reproduction has to say.

    Attributes
    ----------
    title : str
        Headline; of a quick effort it says that it is no evidence.
    remarks : list of str
        What a reader must know before any number: what was run, on what.
    tables : list of Table
        In reading order.
    rows : list of dict
        A published number a row, for scripts: `table`, `label`, `column`, `published`,
        `measured`, `interval`.
    claims : list of dict
        The ledger after the verdicts, for scripts: `id`, `source`, `text`, `verdict`, `effect`
        (in words), `statistic`, `interval`, `unit`, `cells`, `counted`, `readings`, `evidence`.
    pictures : list of Path
        Figures that were written.
    tracking_seconds : float
        What trackers took in all of its runs, one after another.
    grounds : mapping of str to list of Ground
        Scenes and runs that verdicts rest on, by claim.
    sums : mapping of str to tuple of str
        Claims that others sum up, by claim.
    captions : mapping of str to tuple of str
        A figure's caption, and what is seen in it for those who don't see it (empty where the
        caption says so), by the name of its file without suffix.
    main : list of Table
        What stands on the paper's page; on the screen only the first: at most 100 columns wide.
    """

    title: str
    remarks: list[str]
    tables: "list[Table]"
    rows: list[dict[str, Any]]
    claims: list[dict[str, Any]]
    pictures: list[Path] = field(default_factory=list)
    main: "list[Table]" = field(default_factory=list)
    grounds: "Mapping[str, list[Ground]]" = field(default_factory=dict)
    sums: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tracking_seconds: float = 0.0
    captions: Mapping[str, tuple[str, str]] = field(default_factory=dict)


Asked: TypeAlias = Mapping[str, Collection[Cell]]
"""Cells of the runs that this call asked for, by experiment; others may lie beside them."""


def paper_names() -> list[str]:
    """Papers that can be reproduced; imports none."""
    return sorted(file.parent.name for file in FOLDER.glob("*/paper.toml"))


def load_paper(name: str) -> "Paper":
    """A paper, of which `trackmark reproduce` knows no more than its class has.

    Raises
    ------
    ExperimentError
        For an unknown name, with those that are known.
    """
    known = paper_names()
    if name not in known:
        hint = close_match(name, known)
        raise ExperimentError(f"unknown paper {name!r}.{hint} Known: {', '.join(known)}.")
    from bench.papers.description import read_description
    from bench.papers.report import Paper

    return Paper(read_description(name))
