"""Filters: one difficulty each, laid over any sequence, recorded ones too; its truth is adapted.

They stand behind a sequence's name or path, and are a part of its name and fingerprint:
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
