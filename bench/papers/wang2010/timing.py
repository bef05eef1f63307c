"""Times of Table 1 and section 3.2, in plain NumPy and compiled."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.timing import Methods, kept_times, milliseconds, tracker_methods
from trackmark.bench.papers.wang2010 import plain
from trackmark.reports.tables import MISSING, Table, text_table

CAMSHIFT, IMPROVED = "CamShift", "improved CamShift"
PROPOSED, FILTER = "proposed, N = 60", "particle filter, N = 400"
PUBLISHED = {
    "table-tennis": {CAMSHIFT: 0.063, PROPOSED: 0.120, FILTER: 0.214},
    "hand": {CAMSHIFT: 0.071, IMPROVED: 0.098},
}
"""Seconds per frame in Table 1 and section 3.2, by sequence and tracker of `paper.toml`."""

SIZES = {"table-tennis": "115 × 142", "hand": "120 × 160"}
HEADS = ["image, method", "particles", "paper [s]", "paper, ratio to CamShift"]
HEADS += ["ours, NumPy [ms]", "ours, ratio", "ours, compiled [ms]"]


def plain_methods(specs: Mapping[str, str]) -> Methods:
    """Return the plain versions of trackers with equal parameters."""
    classes = {"camshift": plain.PlainCamShift, "camshift-improved": plain.PlainImprovedCamShift}
    classes |= {"wang2010": plain.PlainWang2010, "particle-filter": plain.PlainParticleFilter}
    parsed = {name: parse_tracker(spec) for name, spec in specs.items()}
    return {
        name: partial(classes[spec.name], np.random.SeedSequence(0), **spec.parameters)
        for name, spec in parsed.items()
    }


def time_table(context: Context) -> Table:
    """Return the paper's times, and ours in the setting `as-written`."""
    rows = []
    for sequence, published in PUBLISHED.items():
        slow, fast = (
            kept_times(context, methods, "as-written", [*published], [sequence])[sequence]
            for methods in (plain_methods, tracker_methods)
        )
        for tracker, seconds in published.items():
            name, _, particles = tracker.partition(", N = ")
            ratio = float(np.exp(np.log(slow[tracker] / slow[CAMSHIFT]).mean()))
            rows.append(
                [
                    *(f"{SIZES[sequence]}, {name}", particles or MISSING, f"{seconds:.3f}"),
                    f"{seconds / published[CAMSHIFT]:.2f}",
                    milliseconds(slow[tracker]),
                    "1.00" if tracker == CAMSHIFT else f"{ratio:.1f}",
                    milliseconds(fast[tracker]),
                ]
            )
    caption = (
        "Time per frame, Table 1 and section 3.2. Our times are those of the setting "
        "as-written, the median of 12 rounds. The paper used a Pentium 4 with 2.8 GHz and MATLAB "
        "6.5. Times on different machines cannot be compared; the ratios can."
    )
    return text_table("times", caption, HEADS, rows, 2)
