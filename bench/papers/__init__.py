"""Papers whose tables, figures and claims can be reproduced: one folder per paper.

A folder contains `paper.toml` (runs, tables and figures), `claims.toml`, `sensitivity.toml` and
`criteria.toml` (criteria that scenes must meet). Its `measures.py`, `scenes.py`, `timing.py` and
`figures.py` contain functions that only this paper needs. `criteria/<paper>.py` measures its
criteria.
"""

from dataclasses import dataclass
from pathlib import Path

from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.datasets.spec_string import name_hint

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Effort:
    """Extent of a reproduction."""

    quick: bool = False  # only main table and film strips, on few scenes, without verdicts
    everything: bool = False  # adds the sensitivity table
    seeds: int | None = None  # maximum number of repetitions; None: as in `paper.toml`
    jobs: int | None = None  # worker processes; None: one per core

    def command(self, paper: str) -> str:
        """Return the command that writes the report."""
        options = [
            *(["--quick"] if self.quick else []),
            *(["--all"] if self.everything else []),
            *([f"--seeds {self.seeds}"] if self.seeds is not None else []),
        ]
        return " ".join(["trackmark", "reproduce", paper, *options])


def paper_names() -> list[str]:
    """Return the names of the papers that can be reproduced, without importing their modules."""
    return sorted(file.parent.name for file in FOLDER.glob("*/paper.toml"))


def check_paper_name(name: str) -> None:
    """Raise `ExperimentError` with the valid names if the name of a paper is unknown."""
    valid_names = paper_names()
    if name not in valid_names:
        hint = name_hint(name, valid_names)
        raise ExperimentError(f"unknown paper {name!r}.{hint}")
