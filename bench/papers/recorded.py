"""A paper's trackers on recorded sequences, beside figures that others published on them."""

import csv
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from bench.experiment import Experiment, ExperimentError, SequenceSource
from bench.store.layout import Cell as StoredCell
from bench.store.loading import load_results
from reports.tables import Cell, Table

__all__ = ["Published", "Recorded", "read_published"]

_COLUMNS = ("eval", "tracker", "sequence", "mean_iou_overlapScores", "success_at_0.5_from_errorNum")

Published = dict[tuple[str, str], tuple[float, float]]
"""Mean overlap and share of frames with overlap ≥ 0.5, by tracker and sequence."""


@dataclass(frozen=True)
class Recorded:
    """A paper's trackers on recorded sequences.

    Attributes
    ----------
    name, title : str
        Of the experiment.
    trackers : tuple of str
        The paper's, and simple baselines.
    others : tuple of str
        Trackers whose published figures stand beside.
    """

    name: str
    title: str
    trackers: tuple[str, ...]
    others: tuple[str, ...]

    def experiment(self, sequences: Sequence[SequenceSource], repetitions: int) -> Experiment:
        """The runs."""
        return Experiment(
            name=self.name,
            title=self.title,
            trackers=self.trackers,
            sequences=tuple(sequences),
            repetitions=repetitions,
        )

    def table(
        self,
        folder: Path,
        published: Published,
        cells: Collection[StoredCell] | None = None,
    ) -> Table:
        """Mean overlap and success by sequence, published figures beneath ours.

        As in the published figures the given first frame counts, with overlap 1.

        Parameters
        ----------
        folder : Path
            Results of the experiment.
        published : Published
            What others reached; empty for nothing.
        cells : collection of Cell, optional
            The runs that are meant; all by default.
        """
        runs = load_results(folder, cells)
        data: list[dict[str, Any]] = []
        for sequence, here in runs.groupby("sequence", sort=False, observed=True):
            for tracker, found in here.groupby("tracker", sort=False, observed=True):
                data.append(_ours(sequence, tracker, found))
            for name in self.others:
                if (name, sequence) in published:
                    told, share = published[name, str(sequence)]
                    row = _row(sequence, f"{name}, published", f"{told:.3f}")
                    data.append(row | {"success [%]": f"{100 * share:.1f}"})
        heads = ["sequence", "tracker", "mean overlap", "success [%]"]
        return Table(
            name="recorded",
            caption=(
                "Recorded sequences, first frame counted as in the published figures: mean "
                "overlap (± standard deviation over repetitions), share of frames with overlap "
                "≥ 0.5. All start from the truth's box"
            ),
            heads=heads,
            n_labels=2,
            rows=[[Cell(row[head]) for head in heads] for row in data],
            data=pd.DataFrame(data),
        )


def read_published(path: Path) -> Published:
    """Read published figures: CSV with `eval`, `tracker`, `sequence`, overlap and success.

    Raises
    ------
    ExperimentError
        Naming the file, and the column or line that is wrong.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in _COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise ExperimentError(f"{path}: there is no column {missing[0]!r}.")
            rows = [row for row in reader if row["eval"] == "OPE"]
            return {
                (row["tracker"], row["sequence"]): (
                    float(row[_COLUMNS[3]]),
                    float(row[_COLUMNS[4]]),
                )
                for row in rows
            }
    except (OSError, UnicodeDecodeError) as error:
        raise ExperimentError(f"{path}: {error}.") from None
    except ValueError as error:
        if isinstance(error, ExperimentError):
            raise
        raise ExperimentError(f"{path}: {error}.") from None


def _ours(sequence: Any, tracker: Any, runs: pd.DataFrame) -> dict[str, str]:
    lacking = runs[runs["status"] != "finished"]
    if len(lacking):
        return _row(sequence, tracker, f"{len(lacking)} {lacking.iloc[0]['status']}")
    n = runs["evaluated_frames"]
    overlap = (runs["mean_overlap"] * n + 1) / (n + 1)
    success = (runs["success_frames"] + 1) / (n + 1)
    spread = f" ±{overlap.std():.3f}" if len(runs) > 1 else ""
    row = _row(sequence, tracker, f"{overlap.mean():.3f}{spread}")
    return row | {"success [%]": f"{100 * success.mean():.1f}"}


def _row(sequence: Any, tracker: Any, overlap: str) -> dict[str, str]:
    return {
        "sequence": str(sequence),
        "tracker": str(tracker),
        "mean overlap": overlap,
        "success [%]": "",
    }
