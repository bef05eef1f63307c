"""The paper's methods in plain NumPy, equation by equation, without any special optimisation.

They are written down from the text and not from the trackers' code: boxes must be the same. Two
things, on which the text is silent, are the same by agreement: the order of the random numbers, and
that a window's edge which is on the border of two pixels but for the rounding of floats is on it
(`windows.ROUNDING`).
"""

from bench.papers.wang2010.plain.camshift import PlainCamShift, PlainImprovedCamShift
from bench.papers.wang2010.plain.colour import Template, colour_bins, colour_map, make_template
from bench.papers.wang2010.plain.filters import PlainParticleFilter, PlainWang2010
from bench.papers.wang2010.plain.motion import (
    grey,
    joint_map,
    local_difference,
    moving,
    threshold,
)
from bench.papers.wang2010.plain.windows import mean_shift

__all__ = [
    "PlainCamShift",
    "PlainImprovedCamShift",
    "PlainParticleFilter",
    "PlainWang2010",
    "Template",
    "colour_bins",
    "colour_map",
    "grey",
    "joint_map",
    "local_difference",
    "make_template",
    "mean_shift",
    "moving",
    "threshold",
]
