"""Papers whose tables, figures and claims can be reproduced: one folder per paper.

A folder contains `paper.toml` (runs, tables and figures), `claims.toml`, `sensitivity.toml`,
`criteria.toml` (criteria that scenes must meet) and `development.toml` (values that were compared
before the defaults were chosen). Its `measures.py`, `scenes.py`, `timing.py` and
`figures.py` contain functions that only this paper needs. `tools/criteria/<paper>.py`, which is not
part of the wheel, measures its criteria.

`paper.py` reads the files and replaces the names in them by trackers, sequences and measures. All
other modules work with these objects and with `Case`, the runs of a tracker on a sequence.
"""

from dataclasses import dataclass
from pathlib import Path

from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.datasets.spec_string import name_hint

FOLDER = Path(__file__).parent

SETTINGS = ("as-written", "recommended")
"""Settings in which every claim is judged."""

SETTING_LABELS = {setting: setting.replace("-", " ") for setting in SETTINGS}
"""Settings as they are called in tables and figures."""


@dataclass(frozen=True)
class ReproductionOptions:
    """Options of `trackmark reproduce`: which parts of a paper are reproduced."""

    quick: bool = False  # only main table and film strips, on few scenes, without verdicts
    with_sensitivity: bool = False  # adds the sensitivity table
    jobs: int | None = None  # worker processes; None: one per core

    def command(self, paper: str) -> str:
        """Return the command that writes the report."""
        options = [
            *(["--quick"] if self.quick else []),
            *(["--all"] if self.with_sensitivity else []),
        ]
        return " ".join(["trackmark", "reproduce", paper, *options])


def paper_names() -> list[str]:
    """Return the names of the papers that can be reproduced, without importing their modules."""
    return sorted(file.parent.name for file in FOLDER.glob("*/paper.toml"))


def paper_file(paper: str, name: str) -> Path:
    """Return the path of a file in the folder of a paper."""
    return FOLDER / paper / name


def check_paper_name(name: str) -> None:
    """Raise `ExperimentError` with the valid names if the name of a paper is unknown."""
    valid_names = paper_names()
    if name not in valid_names:
        hint = name_hint(name, valid_names)
        raise ExperimentError(f"unknown paper {name!r}.{hint}")
