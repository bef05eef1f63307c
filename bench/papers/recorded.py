"""A paper's trackers on recorded sequences, beside figures that others published on them."""

import csv
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.kinds import Entry, Text, Texts
from bench.evaluation.record import Trace
from bench.evaluation.scoring import REVISED
from bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from bench.metrics.centre_error import centres
from bench.metrics.overlap import overlap
from bench.store.layout import Cell as StoredCell
from bench.store.layout import run_path
from bench.store.loading import as_revised, load_results
from bench.store.results import Results
from bench.store.truth import read_truth
from reports.tables import Cell, Table

__all__ = ["RECORDED", "Published", "Recorded", "read_published", "shares_of_place_and_size"]

_COLUMNS = ("eval", "tracker", "sequence", "mean_iou_overlapScores", "success_at_0.5_from_errorNum")

MASK_SCORES = {"J": "mean_region_similarity", "F": "mean_contour_accuracy"}
"""DAVIS's, by the heads of their columns; frames after the first count."""

RECORDED = "recorded"
"""Name of the experiment on recorded sequences."""

Published = dict[tuple[str, str], tuple[float, float]]
"""Mean overlap and share of frames with overlap ≥ 0.5, by tracker and sequence."""


class Recorded(Entry):
    """A paper's trackers and simple baselines on recorded sequences.

    `others` are trackers whose published figures stand beside.
    """

    title: Text
    trackers: Texts
    others: tuple[Text, ...] = ()

    def experiment(
        self, name: str, sequences: Sequence[SequenceSource], repetitions: int
    ) -> Experiment:
        """Experiment of all trackers on the recorded sequences."""
        return Experiment(
            name=name,
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

        As in the published figures the given first frame counts, with overlap 1. Of trackers that
        revised boxes there are rows of what they said at once and of what they said in the end.

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
        revised = as_revised(runs)
        data: list[dict[str, Any]] = []
        for sequence, here in runs.groupby("sequence", sort=False, observed=True):
            for tracker, found in here.groupby("tracker", sort=False, observed=True):
                data += _ours(folder, sequence, tracker, found, revised)
            for name in self.others:
                if (name, sequence) in published:
                    told, share = published[name, str(sequence)]
                    row = _row(sequence, f"{name}, published", f"{told:.3f}")
                    data.append(row | {"success [%]": f"{100 * share:.1f}"})
        segmented = any(row["J"] for row in data)
        unused = {"trace"} if revised is None else set()
        if not segmented:
            unused |= MASK_SCORES.keys()
        heads = [head for head in _row("", "", "") if head not in unused]
        return Table(
            name="recorded",
            caption=(
                "Recorded sequences, first frame counted as in the published figures: mean "
                "overlap [quartiles over repetitions], share of frames with overlap "
                "≥ 0.5. All start from the truth's box, or from its mask where there is one and a "
                "tracker takes it"
            ),
            notes=[
                "what costs the overlap: it would be the one of true size if the estimates kept "
                "their centres and had the truth's size, and the one at the true centre if they "
                "kept their size; where only the latter is high the tracker drifts or is lost, "
                "where only the former is, the scale is wrong",
                *(["J, F: of masks, as DAVIS defines them, without the first frame"] * segmented),
            ],
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


def _ours(
    folder: Path, sequence: Any, tracker: Any, runs: pd.DataFrame, revised: pd.DataFrame | None
) -> list[dict[str, str]]:
    """A row of what a tracker said, or one of either trace where these differ."""
    lacking = runs[runs["status"] != "finished"]
    if len(lacking):
        return [_row(sequence, tracker, f"{len(lacking)} {lacking.iloc[0]['status']}")]
    if revised is None or runs[f"{REVISED}mean_overlap"].isna().all():
        return [_scored(folder, sequence, tracker, runs, "online") | {"trace": "both"}]
    in_the_end = revised.loc[runs.index]
    return [
        _scored(folder, sequence, tracker, runs, "online"),
        _scored(folder, sequence, tracker, in_the_end, "revised"),
    ]


def _scored(
    folder: Path, sequence: Any, tracker: Any, runs: pd.DataFrame, trace: Trace
) -> dict[str, str]:
    n = runs["evaluated_frames"]
    overlaps = (runs["mean_overlap"] * n + 1) / (n + 1)
    success = (runs["success_frames"] + 1) / (n + 1)
    low, high = overlaps.quantile([0.25, 0.75])
    spread = f" [{low:.3f}–{high:.3f}]" if len(runs) > 1 else ""
    of_true_size, at_true_centre = _parts(folder, runs, trace)
    return (
        _row(sequence, tracker, f"{overlaps.mean():.3f}{spread}")
        | {
            "trace": trace,
            "success [%]": f"{100 * success.mean():.1f}",
            "of true size": f"{of_true_size:.2f}",
            "at true centre": f"{at_true_centre:.2f}",
        }
        | _of_masks(runs)
    )


def _of_masks(runs: pd.DataFrame) -> dict[str, str]:
    """J and F of trackers that give masks, on sequences that have them; empty for others."""
    means = {head: runs[name].mean() for head, name in MASK_SCORES.items() if name in runs}
    return {head: f"{mean:.3f}" for head, mean in means.items() if np.isfinite(mean)}


def _parts(folder: Path, runs: pd.DataFrame, trace: Trace) -> tuple[float, float]:
    """Mean overlap if only the centre, and if only the size, were the tracker's."""
    results = Results(folder)
    places = runs[["tracker", "sequence", "repetition", "protocol"]]
    found = []
    for place in places.itertuples(index=False, name=None):
        run = results.read(folder / run_path(*place))
        truth = read_truth(folder, run.identity.sequence, run.identity.fingerprint).boxes
        boxes = run.boxes_in(trace)
        there = np.isfinite(truth).all(axis=1) & np.isfinite(boxes).all(axis=1)
        found.append(shares_of_place_and_size(truth[there], boxes[there]))
    of_true_size, at_true_centre = np.mean(found, axis=0).tolist()
    return of_true_size, at_true_centre


def shares_of_place_and_size(
    truth: NDArray[np.float64], boxes: NDArray[np.float64]
) -> tuple[float, float]:
    """Mean overlap of boxes (n, 4) given the truth's size, and of boxes moved to its centre."""
    sizes, true_sizes = boxes[:, 2:], truth[:, 2:]
    of_true_size = np.hstack([centres(boxes) - true_sizes / 2, true_sizes])
    at_true_centre = np.hstack([centres(truth) - sizes / 2, sizes])
    return (
        float(overlap(truth, of_true_size).mean()),
        float(overlap(truth, at_true_centre).mean()),
    )


def _row(sequence: Any, tracker: Any, overlap: str) -> dict[str, str]:
    return {
        "sequence": str(sequence),
        "tracker": str(tracker),
        "trace": "",
        "mean overlap": overlap,
        "success [%]": "",
        "of true size": "",
        "at true centre": "",
        **dict.fromkeys(MASK_SCORES, ""),
    }
