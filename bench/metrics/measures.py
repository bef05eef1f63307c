"""The scores that tables show: name, head, unit, direction."""

from reports.tables import Measure

__all__ = ["MASKS", "PER_SEQUENCE", "SEGMENTATION", "SUMMARY", "TIMES"]

SUMMARY = (
    Measure("mean_overlap", "mean overlap", direction="higher", decimals=3),
    Measure("success_share", "success", "%", "higher", 1, scale=100),
    Measure("inside_share", "inside", "%", "higher", 1, scale=100),
    Measure("centre_error", "centre error", "px", "lower", 2),
    Measure("centre_error_median", "median", "px", "lower", 2),
)
"""Over several sequences: shares, so that each sequence counts once."""

PER_SEQUENCE = (
    Measure("mean_overlap", "mean overlap", direction="higher", decimals=3),
    Measure("success_frames", "success", "frames", "higher", 1, out_of="evaluated_frames"),
    Measure("frames_inside", "inside", "frames", "higher", 1, out_of="evaluated_frames"),
    Measure("first_loss", "first loss", "frame", "higher", 1),
    Measure("centre_error", "centre error", "px", "lower", 2),
    Measure("centre_error_p90", "90th percentile", "px", "lower", 2),
)
"""On one sequence: counts of frames, as papers give them."""

MASKS = (
    Measure("mean_region_similarity", "region similarity J", direction="higher", decimals=3),
    Measure("mean_contour_accuracy", "contour accuracy F", direction="higher", decimals=3),
)
"""Of runs whose trackers gave masks, beside what their boxes score."""

SEGMENTATION = (
    Measure("mean_region_similarity", "J, mean", direction="higher", decimals=3),
    Measure("region_recall", "J, recall", "%", "higher", 1, scale=100),
    Measure("region_decay", "J, decay", direction="lower", decimals=3),
    Measure("mean_contour_accuracy", "F, mean", direction="higher", decimals=3),
    Measure("contour_recall", "F, recall", "%", "higher", 1, scale=100),
    Measure("contour_decay", "F, decay", direction="lower", decimals=3),
)
"""Of the same runs: all that DAVIS tells of region similarity J and contour accuracy F."""

TIMES = (
    Measure("cpu_seconds_median", "CPU a frame, median", "ms", "lower", 4, scale=1e3),
    Measure("cpu_seconds_p95", "95th percentile", "ms", "lower", 4, scale=1e3),
    Measure("cpu_seconds_p99", "99th percentile", "ms", "lower", 4, scale=1e3),
    Measure("wall_seconds_median", "wall, median", "ms", "lower", 4, scale=1e3),
    Measure("initialisation_seconds", "initialisation", "ms", "lower", 3, scale=1e3),
    Measure("disturbed", "disturbed passes", "share", None, 2),
    Measure("mean_overlap", "mean overlap", direction="higher", decimals=3),
)
"""Of timing runs, with what the time bought."""
