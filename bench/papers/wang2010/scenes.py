"""What no run of a tracker shows, measured on the scenes and in short runs; see `checks`."""

from bench.papers.scenes import SceneCheck
from bench.papers.wang2010.checks import (
    averaging,
    camera,
    contrast,
    drift,
    gating,
    illumination,
    recovery,
    threshold,
    weights,
    window,
)

__all__ = ["CHECKS"]

OURS = ("wang2010/table-tennis", "wang2010/hand", "wang2010/cup")

CHECKS = (
    *(SceneCheck(one.measure, OURS) for one in (contrast, gating, drift, weights)),
    SceneCheck(camera.measure, OURS + camera.MOVING_CAMERA),
    *(
        SceneCheck(one.measure, OURS, everything=True)
        for one in (illumination, window, averaging, threshold, recovery)
    ),
)
"""All that is measured on scenes."""
