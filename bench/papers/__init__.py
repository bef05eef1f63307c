"""The papers whose tables, figures and claims can be reproduced: one folder per paper.

`paper.toml`, `claims.toml` and `sensitivity.toml` of a folder say what is run, shown and claimed,
`criteria.toml` what its scenes must meet. `measures.py`, `scenes.py`, `timing.py` and `figures.py`
of a folder hold what is the paper's own.
"""

from dataclasses import dataclass
from pathlib import Path

from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.datasets.spec_string import close_match

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Effort:
    """Extent of a reproduction."""

    quick: bool = False  # main table and figure strips alone, from few scenes, without verdicts
    everything: bool = False  # also the sensitivity table
    seeds: int | None = None  # maximum repetitions of any tracker; None: those of the paper
    jobs: int | None = None  # worker processes; None: one per core

    def command(self, paper: str) -> str:
        """Return the command that makes the report again."""
        options = [
            *(["--quick"] if self.quick else []),
            *(["--all"] if self.everything else []),
            *([f"--seeds {self.seeds}"] if self.seeds is not None else []),
        ]
        return " ".join(["trackmark", "reproduce", paper, *options])


def paper_names() -> list[str]:
    """Return the papers that can be reproduced; imports none."""
    return sorted(file.parent.name for file in FOLDER.glob("*/paper.toml"))


def check_paper_name(name: str) -> None:
    """Raise `ExperimentError` with the valid names if the name of a paper is unknown."""
    valid_names = paper_names()
    if name not in valid_names:
        hint = close_match(name, valid_names) or f" Known: {', '.join(valid_names)}."
        raise ExperimentError(f"unknown paper {name!r}.{hint}")
