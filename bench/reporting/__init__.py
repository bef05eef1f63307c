"""Stored results as tables and pictures: what `trackmark report` and `show` print and draw."""

__all__ = ["MARGINS"]

MARGINS = {
    "mean_overlap": 0.01,
    "success_share": 0.01,
    "inside_share": 0.01,
    "centre_error": 0.5,
    "centre_error_median": 0.5,
}
"""Differences that mean nothing in practice, in the scores' units, unless others are given."""
