"""The time of section 3: usual frames, and the burst at an occlusion's end."""

import numpy as np
import pandas as pd

from bench.experiments.contestant import contestant
from bench.papers.context import Context
from bench.store.layout import run_path
from bench.store.loading import load_results
from bench.store.results import Results

__all__ = ["tables"]

EXPERIMENT = "nguyen2002-time"


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What the claim on time rests on, a way of tracking a row.

    `ng-10`: `preset`, `features`; CPU milliseconds a frame over all timing runs, NaN for none:
    `milliseconds` (mean), `usual` (median where no occlusion is declared), `burst` (mean where one
    ends, and the frames since are tracked again), `burst_in_usual` (its ratio to the second);
    `disturbed` (1 where other load disturbed all runs; else those that it did are left out).
    """
    folder = context.results / EXPERIMENT
    results, frames = Results(folder), []
    runs = load_results(folder, context.asked[EXPERIMENT])
    for row in runs[runs["status"] == "finished"].to_dict("records"):
        place = row["tracker"], row["sequence"], row["repetition"], row["protocol"]
        run = results.read(folder / run_path(*place))
        assert run.times is not None
        settled = contestant(run.identity.tracker)
        ends, hidden = run.details["revision"] > 0, run.details["occluded"] == 1
        kinds = np.select([ends, hidden], ["burst", "hidden"], "usual")
        rows = pd.DataFrame({"milliseconds": 1e3 * run.times.cpu, "kind": kinds})
        labels = {"preset": settled.preset, "features": settled.parameters["features"]}
        frames.append(rows.dropna().assign(**labels, disturbed=row["disturbed"]))
    if not frames:
        return {}
    ways = pd.concat(frames).groupby(["preset", "features"], sort=False)
    return {
        "ng-10": pd.DataFrame(
            {"preset": preset, "features": features} | _told(rows)
            for (preset, features), rows in ways
        )
    }


def _told(rows: pd.DataFrame) -> dict[str, float]:
    disturbed = rows["disturbed"].min()
    rows = rows[rows["disturbed"] == disturbed]
    by_kind = rows.groupby("kind")["milliseconds"]
    usual, burst = by_kind.median().get("usual", np.nan), by_kind.mean().get("burst", np.nan)
    return {
        "milliseconds": rows["milliseconds"].mean(),
        "usual": usual,
        "burst": burst,
        "burst_in_usual": burst / usual,
        "disturbed": disturbed,
    }
