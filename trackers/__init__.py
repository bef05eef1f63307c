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
    EarlyFrameTracker,
    Estimate,
    Image,
    Mask,
    Randomness,
    RevisingTracker,
    Tracker,
    TrackerPlugin,
    WeightMapTracker,
)
from trackmark.trackers.base.parameters import Parameters, TrackerError

__all__ = [
    "Box",
    "EarlyFrameTracker",
    "Estimate",
    "Image",
    "Mask",
    "Parameters",
    "Randomness",
    "RevisingTracker",
    "Specification",
    "Tracker",
    "TrackerError",
    "TrackerPlugin",
    "WeightMapTracker",
    "create",
    "describe",
    "names",
    "resolve",
    "summary",
]
