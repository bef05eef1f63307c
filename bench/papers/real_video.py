"""Scores of trackers on recorded sequences of OTB and on scenes of the papers.

`real_video.csv` has a row per tracker and sequence, which `python -m tools.real_video` writes. A
row is *stale* if the output of its tracker or its sequence has changed since its runs. As for all
runs, `make seal` decides on the output (`datasets.versioning`): a changed source with equal output
keeps the version.
"""

import json

import pandas as pd

from trackmark import datasets
from trackmark.bench.analysis.published_scores import with_published
from trackmark.bench.analysis.published_sets import SETS
from trackmark.bench.analysis.run_checks import compared_measure
from trackmark.bench.experiments.tracker_spec import GOLDEN, parse_tracker
from trackmark.bench.papers import FOLDER
from trackmark.bench.papers.paper import Paper
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.versioning import find_version
from trackmark.reports.tables import MISSING, Table, text_table
from trackmark.trackers import TrackerError

FILE = FOLDER / "real_video.csv"
OTB = "OTB"
"""Value of the column `data` for recorded sequences; scenes have the name of their paper."""

REFERENCES = ("mean-shift", "static", "STRUCK (published)", "CPF (published)")
"""Trackers next to those of a paper."""

STALE = "†"
"""Mark of a tracker with stale scores."""

STALE_NOTE = (
    f"{STALE}: the tracker or a sequence has changed since these runs. `python -m "
    "tools.real_video FOLDER --write` repeats them."
)


def read_scores() -> pd.DataFrame:
    """Return the stored scores, one row per tracker and sequence.

    Columns: `data`; `tracker` (specification), `version` and `parameters` as in `tracker_state`;
    `sequence`, `fingerprint` (its first 16 digits); `grey`, whether the images are grey;
    `mean_overlap` and `success_rate` of the metrics `otb`; `ms_per_frame`. `parameters` are only in
    the first row of a tracker.
    """
    return pd.read_csv(FILE, dtype={"version": str, "fingerprint": str, "parameters": str})


def with_published_scores(scores: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows on OTB with those of published trackers, and the labels of these trackers."""
    recorded = scores[scores["data"] == OTB]
    extended, labels = with_published(
        recorded, SETS["otb100"], compared_measure("otb", "mean_overlap")
    )
    grey = recorded.groupby("sequence")["grey"].first()
    return extended.assign(grey=extended["sequence"].map(grey).astype(bool)), labels


def tracker_state(tracker: str) -> tuple[str, str]:
    """Return the version of a tracker's source, and all its parameters as JSON.

    Versions of libraries do not count, so that scores are not stale with the newest packages.
    """
    spec = parse_tracker(tracker)
    return str(spec.version["source"]), json.dumps(dict(spec.parameters), sort_keys=True)


def _is_current(tracker: str, version: str, parameters: str) -> bool:
    """Return whether a tracker has this version, and its parameters their values at that time.

    Parameters that exist only then or only now do not count: the version shows equal output.
    """
    try:
        current_version, current = tracker_state(tracker)
    except TrackerError:
        # The installed OpenCV can lack a tracker. `make seal` then cannot compare its output, and
        # only a version that was sealed elsewhere counts.
        name, _ = parse_text(tracker)
        sealed = find_version(name, GOLDEN) if name.startswith("opencv-") else None
        return sealed is not None and "-".join(map(str, sealed.version)) == version
    then, now = json.loads(parameters), json.loads(current)
    return current_version == version and all(then[key] == now[key] for key in then.keys() & now)


def stale_rows(scores: pd.DataFrame) -> "pd.Series[bool]":
    """Return for each row whether its tracker or its sequence has changed since its runs.

    Recorded sequences are not part of the package. They are stale if the trackers' runs on them
    used different images or ground truth.
    """
    parameters = scores.dropna(subset="parameters").set_index("tracker")["parameters"].to_dict()
    states = list(zip(scores["tracker"], scores["version"], strict=True))
    changed = {state for state in {*states} if not _is_current(*state, parameters[state[0]])}
    is_changed = pd.Series([state in changed for state in states], scores.index)
    for sequence, rows in scores.groupby("sequence"):
        if {*rows["data"]} == {OTB}:
            is_changed[rows.index] |= len({*rows["fingerprint"]}) > 1
        else:
            current = datasets.name_and_fingerprint(str(sequence))[1]
            is_changed[rows.index] |= rows["fingerprint"] != current
    return is_changed


def stale_trackers(scores: pd.DataFrame) -> list[str]:
    """Return the trackers with stale rows."""
    return [str(tracker) for tracker in scores["tracker"][stale_rows(scores)].unique()]


def ranked_rows(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Return the rows of each tracker, the tracker with the best mean overlap first."""
    groups = {str(tracker): group for tracker, group in rows.groupby("tracker")}
    return sorted(groups.items(), key=lambda item: -item[1]["mean_overlap"].mean())


def score_cells(tracker: str, rows: pd.DataFrame, stale: list[str]) -> list[str]:
    """Return the cells of a tracker: label, mean overlap, 95 % interval, success and time."""
    overlaps = rows["mean_overlap"]
    low, high = mean_interval(overlaps)
    success, time = rows["success_rate"].mean(), rows["ms_per_frame"].mean()
    return [
        f"{tracker} {STALE}" if tracker in stale else tracker,
        f"{overlaps.mean():.2f}",
        f"[{max(low, 0):.2f}, {min(high, 1):.2f}]",
        MISSING if pd.isna(success) else f"{100 * success:.0f} %",
        MISSING if pd.isna(time) else f"{time:.2g}",
    ]


HEADINGS = ("tracker", "overlap", "95 %", "success", "ms/frame")
"""Headings of `score_cells`."""


def paper_table(paper: Paper) -> Table:
    """Return the scores of a paper's trackers in their presets, next to `REFERENCES`."""
    scores = read_scores()
    rows, _ = with_published_scores(scores)
    names = {tracker.registered_name for tracker in paper.trackers.values()}
    is_listed = [
        tracker in REFERENCES or parse_text(tracker)[0] in names for tracker in rows["tracker"]
    ]
    listed = rows[is_listed]
    stale = stale_trackers(scores[scores["tracker"].isin(listed["tracker"].unique())])
    cells = [score_cells(tracker, group, stale) for tracker, group in ranked_rows(listed)]
    caption = (
        f"Means over {listed['sequence'].nunique()} sequences of OTB, with intervals for new "
        "sequences of this kind."
    )
    return text_table("real-video", caption, HEADINGS, cells, notes=[STALE_NOTE] if stale else [])
