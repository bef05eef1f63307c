"""Origins of parameters: the printed values with their equations, and reasons for the others."""

import re

import pytest

from trackmark import trackers
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.paper import read_paper

STEPS = "section 2.2, step 3: stop if n₁ > n₀ = 10, after n₁ was increased"
MEAN_SHIFT = {"stop_distance": (2.0, "section 2.2: ε = 2"), "max_iterations": (10 + 1, STEPS)}
COLOUR_AND_MOTION = {
    "alpha": (0.7, "section 2.1.1: α = 0.7"),
    "beta": (0.8, "section 2.1.3: β = 0.8"),
    "differences": ("two", "section 2.1.2, step 3: D = (D¹ + D²) / 2"),
    "motion_threshold": ("adaptive", "section 2.1.2, step 4: T = m + λσ"),
    "threshold_factor": (2.0, "section 2.1.2, step 4: λ = 2"),
}
POSITION_FILTER = COLOUR_AND_MOTION | {
    "radius": ("rule", "eq. 8: r = √N / 2"),
    "sigma": (1.0, "eq. 10: exp(-D² / 2), without a scale"),
    "velocity": ("particle", "eq. 8: s_(k-1) - s_(k-2) of each particle"),
}
SEGMENTER = {
    "ring": ("image", "section 5.2: image pixels in and out of W"),
    "outside": ("image", "section 5.4: image pixels inside and outside the contour"),
    "snake": (True, "section 5.5: the average contour initialises a snake"),
    "snake_edges": (
        "supported",
        "section 5.5, Fig. 6: the posterior of the best colours eliminates edges",
    ),
    "output": ("snake", "section 5.5: the contour R after the snake"),
}
PRINTED = {
    "camshift": MEAN_SHIFT,
    "camshift-improved": COLOUR_AND_MOTION | MEAN_SHIFT,
    "contour-smooth-color": SEGMENTER,
    "moreno2005": SEGMENTER
    | {
        "feedback": ("marginal", "eq. 4: each filter receives its own weights"),
        "association": (
            "by-weight",
            "section 5.3: samples are associated according to their weights",
        ),
        "position": (
            "particles",
            "section 4.3: the contour's points are the state of a particle filter",
        ),
        "colour_model": (
            "particles",
            "section 4.2: mixtures are the state of a particle filter",
        ),
    },
    "multipart": {
        "representation": ("adaptive", "eq. 7: choice by the distance of the halves"),
        "particles": (200, "section 3: N = 200"),
        "position_divisor": (3.0, "section 3: a = 3"),
        "size_divisor": (10.0, "section 3: b = 10"),
        "sigma": (0.1, "section 3: σ = 0.1"),
        "threshold": (0.4, "section 3: T = 0.4"),
        "sigma_meaning": (
            "deviation",
            "eq. 8: exp(-d² / 2σ²), although the text calls σ a variance",
        ),
        "dynamics": ("random-walk", "eq. 5: random walk"),
        "noise": ("proportional", "eq. 6: noise by the rectangle's size"),
        "resampling": (
            "multinomial",
            "section 2.2: the algorithm of the paper's [1], Isard & Blake",
        ),
    },
    "particle-filter": POSITION_FILTER | {"particles": (400, "Table 1: N = 400")},
    "wang2010": POSITION_FILTER | MEAN_SHIFT | {"particles": (60, "Table 1: N = 60")},
    "nummiaro2003": {
        "particles": (100, "section 7: N = 100"),
        "colour": ("rgb", "section 3: RGB space"),
        "bins": (8, "section 3: 8 × 8 × 8 bins"),
        "kernel": ("isotropic", "eq. 2 and 3: k(r) = 1 - r², a = √(Hx² + Hy²)"),
        "dynamics": ("first-order", "section 4: first order model"),
        "scale_change": ("linear", "section 4: s_t = A s_(t-1) + w_(t-1)"),
        "scale_persistence": (1.0, "section 4: constant velocity and scale change"),
        "model_update": (True, "eq. 12"),
        "update_reading": ("printed", "eq. 10 and 11: π = exp(-(1 - ρ) / 2σ²) / √(2πσ)"),
        "update_threshold": (0.9, "section 5: π_T = 0.9"),
        "models": ("one", "eq. 12: one model q, updated by the histogram of E[S]"),
        "reinitialise": (True, "section 6: the tracker returns into the initialization mode"),
        "kick_off": (0.1, "section 6: b = 0.1"),
    },
    "nguyen2002": {
        "features": ("invariants", "eq. 18; section 3 also compares (R, G, B) and R + G + B"),
        "delta": (0.99, "section 2.1: δ = 0.99"),
        "gamma": (0.25, "section 2.4: γ = 25 %"),
        "minimal_speed": (0.05, "section 2.4: κ = 5 %"),
        "outlier_rule": ("reaches", "eq. 11: n_o ≥ n_omax"),
        "candidates": ("skipped", "section 2.4: 5, 7, 11, 19, 35 etc."),
        "norm": ("huber", "eq. 3"),
        "covariance": ("full", "eq. 13: R is a full matrix"),
        "adaptive_noise": (True, "eq. 14"),
        "gate": (True, "eq. 11"),
        "rebootstrap": (True, "eq. 11"),
        "report": ("smoothed", "section 2.1: the solution of eq. 4 is further smoothed"),
        "end": ("minimum", "section 2.4: the frame with the minimum cost"),
    },
}
"""Printed values of the preset `as-written` and their places, by tracker and parameter.

They are copied from the papers, not from the trackers.
"""

NAMES = sorted(
    {
        tracker.registered_name
        for paper in paper_names()
        for tracker in read_paper(paper).trackers.values()
    }
)


@pytest.mark.parametrize("name", sorted(PRINTED))
def test_as_written_has_the_printed_values(name):
    written = trackers.resolve(name, preset="as-written").parameters
    printed = {
        parameter: (getattr(written, parameter), origin.removeprefix("printed: "))
        for parameter, origin in type(written).origins().items()
        if origin.startswith("printed: ")
    }
    assert printed == PRINTED[name]


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_has_an_origin(name):
    plugin = trackers.resolve(name).plugin
    origins = plugin.Parameters.origins()
    assert set(origins) == set(plugin.Parameters.model_fields)
    for origin in origins.values():
        assert origin in {"option", "harness"} or re.match("(printed|chosen): .", origin)


@pytest.mark.parametrize("name", NAMES)
def test_default_is_the_preset_recommended(name):
    recommended = trackers.resolve(name, preset="recommended").parameters
    assert trackers.create(name).parameters == recommended
    trackers.resolve(name, preset="as-written")
