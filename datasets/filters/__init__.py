"""Filters: each adds one difficulty to any sequence and adapts its ground truth.

Filters follow the name or path of a sequence, and are part of its name and fingerprint:
`samples/face:filter.noise=20`, `plain/target:scene=3:filter.motion=0.4:filter.draw=7`.
"""

from trackmark.datasets.filters.registry import (
    FILTERS,
    Filter,
    filtered,
    split_filters,
    with_filters,
)

__all__ = ["FILTERS", "Filter", "filtered", "split_filters", "with_filters"]
