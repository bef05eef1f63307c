"""Single-object trackers: each file in this folder is a tracker, each subfolder shared code."""

if __name__ != "trackmark.trackers":
    raise ImportError("Import `trackmark.trackers` instead of `trackers`.")

from trackmark.trackers.base.catalogue import (
    Specification,
    create,
    describe,
    names,
    resolve,
    summary,
)
from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Finisher,
    Image,
    Mapper,
    Mask,
    Randomness,
    Tracker,
    TrackerPlugin,
    Watcher,
)
from trackmark.trackers.base.parameters import Parameters, TrackerError

__all__ = [
    "Box",
    "Estimate",
    "Finisher",
    "Image",
    "Mapper",
    "Mask",
    "Parameters",
    "Randomness",
    "Specification",
    "Tracker",
    "TrackerError",
    "TrackerPlugin",
    "Watcher",
    "create",
    "describe",
    "names",
    "resolve",
    "summary",
]
