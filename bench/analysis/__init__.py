"""Scores of stored runs: means, comparisons of trackers, and the tables that show them."""

__all__ = ["MARGINS"]

MARGINS = {
    "mean_overlap": 0.01,
    "success_rate": 0.01,
    "inside_rate": 0.01,
    "centre_error": 0.5,
    "centre_error_median": 0.5,
}
"""Default margins: largest irrelevant differences, in the units of the scores.

Margins of overlaps and shares equal `bench.statistics.rules.MARGIN`, whose import takes 0.2 s.
"""
