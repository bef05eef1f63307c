"""The time of section 3 beside ours: usual frames, and the burst at an occlusion's end."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from time import perf_counter, thread_time
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

import datasets
import trackers
from bench.experiments.contestant import contestant
from bench.metrics.times import DISTURBED_RATIO
from bench.papers.in_turns import in_turns
from bench.papers.timed import timed_runs
from bench.store.layout import Cell as StoredCell
from reports.tables import MISSING, Cell, Table
from trackers.base.interface import Box, Image

__all__ = ["PUBLISHED", "course_times", "frame_times", "measured_times", "time_tables"]

PUBLISHED = 0.005
"""Seconds a frame of section 3, on a Pentium II of 400 MHz."""

FEATURES = ("intensity", "rgb", "invariants", "arctan")
PRESETS = ("as-written", "recommended")

CLIP = "nguyen2002/clip-01"
BEFORE, AFTER = 10, 50  # frames of the clip, from where its first occlusion begins
QUICK_BEFORE, QUICK_AFTER = 4, 40
PASSES = 3
HIDDEN = 0.9  # visible share below which something of the target is hidden

Kind: TypeAlias = Literal["usual", "hidden", "burst"]


class Followed:
    """A tracker that remembers what it had to do in each frame.

    Parameters
    ----------
    features, preset : str
    image : ndarray of uint8, shape (rows, columns, 3)
    box : ndarray of float64, shape (4,)
        Where it starts.

    Attributes
    ----------
    kinds : list of str
        By frame: `usual`, `hidden` (an occlusion is declared), `burst` (one has ended, and the
        frames since are tracked again).
    """

    def __init__(self, features: str, preset: str, image: Image, box: Box) -> None:
        self.kinds: list[Kind] = []
        seed = np.random.SeedSequence(0)
        self._tracker = trackers.create("nguyen2002", seed, preset=preset, features=features)
        self._tracker.init(image, box)

    def __call__(self, image: Image) -> None:
        """Take the next frame."""
        said = self._tracker.update(image)
        self.kinds.append("burst" if said.revised else "usual" if said.visible else "hidden")


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """CPU seconds of every frame of the timing runs that no load disturbed.

    Returns
    -------
    DataFrame
        `features`, `preset`, `sequence`, `frame`, `seconds`: medians over the repetitions. Runs
        with other settings are left out.
    """
    meant = {
        contestant(f"nguyen2002:preset={preset}:features={features}").label: (features, preset)
        for features in FEATURES
        for preset in PRESETS
    }
    keys = ["features", "preset", "sequence", "frame"]
    pieces = [pd.DataFrame(columns=[*keys, "seconds"])]
    for run in timed_runs(folder, cells):
        assert run.times is not None
        if run.identity.tracker not in meant:
            continue
        features, preset = meant[run.identity.tracker]
        timed = np.flatnonzero(np.isfinite(run.times.cpu))
        rows = pd.DataFrame({"frame": timed, "seconds": run.times.cpu[timed]})
        labels = {"features": features, "preset": preset, "sequence": run.identity.sequence}
        pieces.append(rows.assign(**labels))
    frames = pd.concat(pieces[1:] or pieces, ignore_index=True)
    return frames.groupby(keys, as_index=False).agg({"seconds": "median"})


def measured_times(
    folder: Path, cells: Collection[StoredCell] | None = None, *, quick: bool = False
) -> dict[str, pd.DataFrame]:
    """What the claim on time rests on, by the names that the ledger gives.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    quick : bool
        Measure fewer frames, and each once.

    Returns
    -------
    dict of str to DataFrame
        Times are CPU times. `frame_times` and `course_times`: see there. `ng-10`, a way of
        tracking a row: `preset`, `features`, `milliseconds` (mean over all frames of
        `course_times`), `usual` (median of usual frames) and `burst` (mean of those in
        which an occlusion ends; both in milliseconds, NaN for none), `disturbed` (1 where other
        load disturbed all passes; else those that it did are left out).
    """
    before, after = (QUICK_BEFORE, QUICK_AFTER) if quick else (BEFORE, AFTER)
    courses = course_times(CLIP, before, after, 1 if quick else PASSES)
    return {
        "frame_times": frame_times(folder, cells),
        "course_times": courses,
        "ng-10": pd.DataFrame(
            {"preset": preset, "features": features} | _means(rows)
            for (preset, features), rows in courses.groupby(["preset", "features"], sort=False)
        ),
    }


def course_times(name: str, before: int, after: int, passes: int) -> pd.DataFrame:
    """Times of all frames about a complete occlusion, which every way of tracking sees in turns.

    Parameters
    ----------
    name : str
        Sequence.
    before, after : int
        Frames from the beginning of its first occlusion to start and to end with.
    passes : int
        How often.

    Returns
    -------
    DataFrame
        A row a frame and pass: `preset`, `features`, `kind` (see `Followed`), `seconds`,
        `disturbed` (1 for a pass that other load disturbed, else 0). The first frame warms up and
        is left out.
    """
    sequence = datasets.load(name)
    hidden = np.flatnonzero(sequence.visibility < HIDDEN)
    middle = int(hidden[0]) if len(hidden) else before
    first = max(0, middle - before)
    part = sequence[first : middle + after]
    images, box = list(part), part.boxes[0]
    return pd.concat([_pass(images, box) for _ in range(passes)], ignore_index=True)


def _pass(images: list[Image], box: Box) -> pd.DataFrame:
    followed = {
        f"{preset}/{features}": Followed(features, preset, images[0], box)
        for preset in PRESETS
        for features in FEATURES
    }
    cpu, wall = thread_time(), perf_counter()
    seconds = in_turns(followed, images[1:])
    wall, cpu = perf_counter() - wall, thread_time() - cpu
    disturbed = float(wall > DISTURBED_RATIO * cpu)
    pieces = []
    for label, one in followed.items():
        preset, features = label.split("/")
        rows = {"kind": one.kinds[1:], "seconds": seconds[label], "disturbed": disturbed}
        pieces.append(pd.DataFrame(rows).assign(preset=preset, features=features))
    return pd.concat(pieces)


def _means(rows: pd.DataFrame) -> dict[str, float]:
    disturbed = rows["disturbed"].min()
    rows = rows[rows["disturbed"] == disturbed]
    milliseconds = 1e3 * rows["seconds"]
    by_kind = milliseconds.groupby(rows["kind"])
    usual, burst = by_kind.median().get("usual", np.nan), by_kind.mean().get("burst", np.nan)
    return {
        "milliseconds": milliseconds.mean(),
        "usual": usual,
        "burst": burst,
        "disturbed": disturbed,
    }


def time_tables(tables: Mapping[str, pd.DataFrame], failed: Sequence[str] = ()) -> list[Table]:
    """Times beside the paper's.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `measured_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    runs = tables["frame_times"]
    data = []
    for row in tables["ng-10"].to_dict("records"):
        same = (runs["features"] == row["features"]) & (runs["preset"] == row["preset"])
        timed = runs.loc[same, "seconds"]
        load = " (disturbed by other load)" if row["disturbed"] else ""
        data.append(
            {
                "setting": row["preset"].replace("-", " "),
                "features": row["features"],
                "all frames [ms]": f"{row['milliseconds']:.3g}{load}",
                "usual frame [ms]": _words(row["usual"]),
                "at an occlusion's end [ms]": _burst(row["burst"], row["usual"]),
                "timing runs [ms]": f"{1e3 * timed.mean():.3g}" if len(timed) else MISSING,
            }
        )
    return [
        Table(
            name="time",
            caption=(
                f"Section 3: CPU time a frame on one thread; the paper says {PUBLISHED} s on a "
                "Pentium II of 400 MHz, for features that it does not name"
            ),
            heads=list(data[0]),
            n_labels=2,
            rows=[[Cell(text) for text in row.values()] for row in data],
            notes=[
                f"all but timing runs: about the first occlusion of {CLIP}, each image shown to "
                "all in turns; a usual frame is one in which no occlusion is declared (median), "
                "at an occlusion's end up to 30 frames are tracked again at once (mean; in "
                "parentheses: how many usual frames of the same row that is)",
                "all frames (mean) are also those of a declared occlusion, in which the box only "
                "goes on and next to nothing is computed: hence a usual frame takes "
                "longer than these",
                "frames are 320x240, the template is about 60x80",
                "timing runs: means over whole sequences, each by itself; those that other load "
                "disturbed are left out, and where none is left there is a dash",
                f"at four thousand million cycles a second the paper's {PUBLISHED} s would be "
                f"{1e3 * PUBLISHED / 10:.1f} ms, if nothing but the clock had changed: stated, "
                "not asserted",
                *failed,
            ],
            data=tables["ng-10"],
        )
    ]


def _burst(burst: float, usual: float) -> str:
    """The time at an occlusion's end, and how many usual frames it is."""
    known = np.isfinite(burst) and np.isfinite(usual)
    return f"{burst:.3g} ({burst / usual:.1f}×)" if known else _words(burst)


def _words(milliseconds: float) -> str:
    return f"{milliseconds:.3g}" if np.isfinite(milliseconds) else MISSING
