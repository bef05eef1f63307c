"""The same tracker on recorded sequences, beside figures that others published on them."""

import csv
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bench.experiment import Experiment, ExperimentError, SequenceSource
from bench.store.layout import Cell as StoredCell
from bench.store.loading import load_results
from reports.tables import Cell, Table

__all__ = ["NAME", "Published", "read_published", "recorded_experiment", "recorded_table"]

NAME = "multipart-recorded"
OTHERS = ("CPF", "KMS", "MS")
"""Colour trackers of the OTB comparison: Perez' particle filter, kernel mean shift, mean shift."""

_COLUMNS = ("eval", "tracker", "sequence", "mean_iou_overlapScores", "success_at_0.5_from_errorNum")

Published = dict[tuple[str, str], tuple[float, float]]
"""Mean overlap and share of frames with overlap ≥ 0.5, by tracker and sequence."""


def recorded_experiment(sequences: Sequence[SequenceSource], repetitions: int) -> Experiment:
    """All representations and two simple baselines on recorded sequences."""
    return Experiment(
        name=NAME,
        title="Multi-part histograms on recorded sequences",
        trackers=(
            "multipart:representation=single",
            "multipart:representation=multi",
            "multipart",
            "camshift",
            "static",
        ),
        sequences=tuple(sequences),
        repetitions=repetitions,
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


def recorded_table(
    folder: Path, published: Published, cells: Collection[StoredCell] | None = None
) -> Table:
    """Mean overlap and success by sequence, published figures beneath ours.

    As in the published figures the given first frame counts, with overlap 1.
    """
    runs = load_results(folder, cells)
    data: list[dict[str, Any]] = []
    for sequence, here in runs.groupby("sequence", sort=False, observed=True):
        for tracker, found in here.groupby("tracker", sort=False, observed=True):
            lacking = found[found["status"] != "finished"]
            if len(lacking):
                data.append(_row(sequence, tracker, f"{len(lacking)} {lacking.iloc[0]['status']}"))
                continue
            n = found["evaluated_frames"]
            overlap = (found["mean_overlap"] * n + 1) / (n + 1)
            success = (found["success_frames"] + 1) / (n + 1)
            spread = f" ±{overlap.std():.3f}" if len(found) > 1 else ""
            row = _row(sequence, tracker, f"{overlap.mean():.3f}{spread}")
            data.append(row | {"success [%]": f"{100 * success.mean():.1f}"})
        for name in OTHERS:
            if (name, sequence) in published:
                told, share = published[name, str(sequence)]
                row = _row(sequence, f"{name}, published", f"{told:.3f}")
                data.append(row | {"success [%]": f"{100 * share:.1f}"})
    heads = ["sequence", "tracker", "mean overlap", "success [%]"]
    return Table(
        name="recorded",
        caption=(
            "Recorded sequences, first frame counted as in the published figures: mean overlap "
            "(± standard deviation over repetitions), share of frames with overlap ≥ 0.5. All "
            "start from the truth's box"
        ),
        heads=heads,
        n_labels=2,
        rows=[[Cell(row[head]) for head in heads] for row in data],
        data=pd.DataFrame(data),
    )


def _row(sequence: Any, tracker: Any, overlap: str) -> dict[str, str]:
    return {
        "sequence": str(sequence),
        "tracker": str(tracker),
        "mean overlap": overlap,
        "success [%]": "",
    }
