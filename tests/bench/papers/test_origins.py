"""Origins of parameters: the printed values with their equations, and reasons for the others."""

import pytest

from trackmark import trackers
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.paper import read_paper

PRINTED = {
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
        parameter: (getattr(written, parameter), origin.text)
        for parameter, origin in type(written).origins().items()
        if origin.kind == "printed"
    }
    assert printed == PRINTED[name]


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_has_an_origin(name):
    plugin = trackers.resolve(name).plugin
    origins = plugin.Parameters.origins()
    assert set(origins) == set(plugin.Parameters.model_fields)
    for origin in origins.values():
        assert bool(origin.text) == (origin.kind in {"printed", "chosen"})


@pytest.mark.parametrize("name", NAMES)
def test_every_choice_has_a_value_and_a_reason(name):
    for choice, (value, reason) in trackers.resolve(name).plugin.choices.items():
        assert choice
        assert value is not None
        assert len(reason) > 10


@pytest.mark.parametrize("name", NAMES)
def test_default_is_the_preset_recommended(name):
    recommended = trackers.resolve(name, preset="recommended").parameters
    assert trackers.create(name).parameters == recommended
    trackers.resolve(name, preset="as-written")
