"""Stored results as tables and pictures: what `trackmark report` and `show` print and draw."""

__all__ = ["MARGINS"]

MARGINS = {
    "mean_overlap": 0.01,
    "success_share": 0.01,
    "inside_share": 0.01,
    "centre_error": 0.5,
    "centre_error_median": 0.5,
}
"""Differences up to these are irrelevant, in the scores' units, unless others are given.

Those of overlaps and shares are `bench.statistics.rules.MARGIN`, whose import takes 0.2 s.
"""
