"""The time of section 3: usual frames, and the burst at an occlusion's end."""

import numpy as np
import pandas as pd

from bench.experiments.contestant import contestant
from bench.papers.context import Context
from bench.papers.timing import frame_times
from bench.statistics.intervals import mean_interval

__all__ = ["tables"]

EXPERIMENT = "nguyen2002-time"
STRETCH = 20
"""Frames whose mean is a value of the interval: neighbours take about as long."""


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What the claim on time rests on, a way of tracking a row.

    `ng-10`: `preset`, `features`; CPU milliseconds a frame over all timing runs, NaN for none:
    `decoded` (mean, as decoded, as a camera's frames come one by one) with the 95 % limits `low`
    and `high`; warm: `milliseconds` (mean), `usual` (median where no occlusion is declared),
    `burst` (mean where one ends, and the frames since are tracked again), `burst_in_usual` (its
    ratio to the second); `disturbed` (1 where other load disturbed all runs; else those that it did
    are left out).
    """
    if EXPERIMENT not in context.asked:  # a quick look times nothing
        return {}
    frames = frame_times(
        context.results / EXPERIMENT, context.asked[EXPERIMENT], ("revision", "occluded")
    )
    if frames.empty:
        return {}
    ends, hidden = frames["revision"] > 0, frames["occluded"] == 1
    frames["kind"] = np.select([ends, hidden], ["burst", "hidden"], "usual")
    frames["milliseconds"], frames["decoded"] = 1e3 * frames["seconds"], 1e3 * frames["decoded"]
    rows = []
    for tracker, every in frames.groupby("tracker", sort=False):
        settled, disturbed = contestant(str(tracker)), every["disturbed"].min()
        chosen = every[every["disturbed"] == disturbed]
        stretches = [chosen["sequence"], chosen["repetition"], chosen["frame"] // STRETCH]
        means = chosen.groupby(stretches)["decoded"].mean()
        low, high = mean_interval(means) if len(means) > 1 else (np.nan, np.nan)
        by_kind = chosen.groupby("kind")["milliseconds"]
        usual, burst = by_kind.median().get("usual", np.nan), by_kind.mean().get("burst", np.nan)
        rows.append(
            {
                "preset": settled.preset,
                "features": settled.parameters["features"],
                "milliseconds": chosen["milliseconds"].mean(),
                "decoded": chosen["decoded"].mean(),
                "low": low,
                "high": high,
                "degrees": len(means) - 1,
                "usual": usual,
                "burst": burst,
                "burst_in_usual": burst / usual,
                "disturbed": disturbed,
            }
        )
    return {"ng-10": pd.DataFrame(rows)}
