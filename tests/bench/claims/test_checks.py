"""Checks, on tables whose outcome is known."""

import numpy as np
import pandas as pd
import pytest

from bench.claims import evaluation
from bench.claims.checks import CHECKS
from bench.claims.conclusion import conclude
from bench.claims.ledger import read_claims
from bench.statistics.separation import auc, error_share, zero_error_thresholds


def judge(claim, scores, tables=None):
    return evaluation.judge(claim, scores, tables, CHECKS)


def test_the_area_under_the_curve_is_the_share_of_pairs_in_order():
    generator = np.random.default_rng(0)
    two, plain = generator.integers(0, 9, 30) / 10, generator.integers(0, 7, 20) / 10
    pairs = [(t > p) + 0.5 * (t == p) for t in two for p in plain]
    assert auc(two, plain) == pytest.approx(np.mean(pairs))
    assert auc(plain, two) == pytest.approx(1 - np.mean(pairs))


def test_thresholds_without_error_make_none():
    two, plain = [0.5, 0.45, 0.9], [0.1, 0.3]
    low, high = zero_error_thresholds(two, plain)
    assert (low, high) == (0.3, 0.45)
    assert error_share(two, plain, low) == 0
    assert error_share(two, plain, high) > 0
    assert zero_error_thresholds([0.3], [0.3]) is None


ADAPTIVE = read_claims("nummiaro2003")


def adaptive_runs(**columns):
    """Runs of the adaptive colour particle filter on a sequence, ten scenes."""
    usual = {
        "tracker": "nummiaro2003",
        "preset": "as-written",
        "variant": "",
        "update": "with",
        "reinitialisation": "with",
        "light": "even",
        "sequence": "nummiaro2003/traffic",
        "kept_scene": True,
        "repetition": 0,
        "frames": 100,
    }
    return pd.DataFrame({"scene": range(10), **usual, **columns})


@pytest.mark.parametrize(
    ("good", "other", "verdict"),
    [(50, 1, "holds"), (50, 30, "does-not-hold"), (4, 0, "does-not-hold")],
)
def test_an_update_has_its_place_in_good_frames(good, other, verdict):
    frame = adaptive_runs(
        good_frames=100, good_updates=good, other_frames=50, other_updates=other, waiting_frames=50
    )
    claim = ADAPTIVE["NU-9"]
    assert f"{other:.1f} % of the others with the 500 in" in judge(claim, frame)[0].verdict.reason
    assert conclude(claim, judge(claim, frame)).verdict == verdict
    never = conclude(claim, judge(claim, frame.assign(other_frames=0, other_updates=0)))
    assert never.verdict == "undecided"


def test_each_reading_of_the_condition_is_judged():
    counts = {"good_frames": 100, "other_frames": 50, "waiting_frames": 0}
    frames = [
        adaptive_runs(variant=variant, good_updates=good, other_updates=other, **counts)
        for variant, good, other in (
            ("", 50, 0),
            ("update_reading=printed", 0, 0),
            ("update_reading=coefficient", 100, 50),
        )
    ]
    without = adaptive_runs(update="without", good_updates=0, other_updates=0, **counts)
    claim = ADAPTIVE["NU-9"]
    found = conclude(claim, judge(claim, pd.concat([*frames, without])))
    assert (found.verdict, found.readings, found.post_hoc) == ("holds", "1 of 2", "0 of 1")


@pytest.mark.parametrize(
    ("fast", "verdict"), [(0.95, "holds"), (0.5, "does-not-hold"), (np.nan, "undecided")]
)
def test_fast_frames_are_set_against_nine_tenths_of_the_others(fast, verdict):
    wobble = np.arange(10) / 1000
    frame = adaptive_runs(inside_fast=fast + wobble, inside_otherwise=1.0)
    claim = ADAPTIVE["NU-23"]
    assert conclude(claim, judge(claim, frame)).verdict == verdict


def test_time_and_area_rise_together():
    claim = ADAPTIVE["NU-14"]
    area = np.linspace(1, 2, 30)
    for seconds, verdict in ((area**3, "holds"), (-area, "does-not-hold")):
        table = pd.DataFrame({"area": area, "seconds": seconds})
        found = judge(claim, adaptive_runs(), {"frame_times": table})
        assert conclude(claim, found).verdict == verdict
    nothing = pd.DataFrame({"area": [], "seconds": []})  # other load disturbed all passes
    assert judge(claim, adaptive_runs(), {"frame_times": nothing})[0].verdict.verdict == "undecided"


def kick_off_tables(**worse):
    """Runs and entrances with every kick-off fraction; `worse` is what 0.1 has less of."""
    gain = dict.fromkeys(("recovered", "right_at_end", "started", "no_false_start"), 0.0) | worse
    wobble = np.arange(10) / 1000
    runs = [
        adaptive_runs(
            sequence="nummiaro2003/students",
            variant=variant,
            repetition=repetition,
            **{
                name: 0.9 - (0 if variant else gain[name]) + wobble
                for name in ("recovered", "right_at_end")
            },
        )
        for variant in ("", "kick_off=0.05", "kick_off=0.2", "kick_off=0.4")
        for repetition in range(1 if variant else 4)
    ]
    entered = [
        {
            "sequence": "nummiaro2003/person",
            "scene": scene,
            "light": "even",
            "preset": "as-written",
            "kick_off": b,
            "repetition": 0,
            **{name: 0.9 - gain[name] * (b == 0.1) for name in ("started", "no_false_start")},
        }
        for b in (0.05, 0.1, 0.2, 0.4)
        for scene in range(10)
    ]
    return pd.concat(runs), {"kick_off": pd.DataFrame(entered)}


@pytest.mark.parametrize(
    ("worse", "verdict"),
    [
        ({}, "holds"),
        ({"recovered": 0.04}, "holds"),
        ({"recovered": 0.1}, "does-not-hold"),
        ({"started": 0.1}, "does-not-hold"),
        ({"no_false_start": 0.1}, "does-not-hold"),
        ({"right_at_end": -0.3}, "holds"),
    ],
)
def test_a_kick_off_fraction_is_no_worse_than_any_other(worse, verdict):
    claim = ADAPTIVE["NU-12"]
    scores, tables = kick_off_tables(**worse)
    assert conclude(claim, judge(claim, scores, tables)).verdict == verdict
    assert conclude(claim, judge(claim, scores)).verdict == "undecided"


def test_weights_must_also_lead_to_the_centre():
    claim = ADAPTIVE["NU-5"]
    table = pd.DataFrame(
        {
            "sequence": "nummiaro2003/car",
            "scene": scene,
            "kernel": kernel,
            "frame": 0,
            "margin": 0.3 + 0.1 * (kernel == "isotropic") + scene / 1000,
            "centre_error": 0.2 + scene / 1000 - 0.1 * (kernel == "isotropic"),
        }
        for scene in range(10)
        for kernel in ("isotropic", "uniform")
    )
    for kernels, verdict in ((table, "holds"), (table.assign(centre_error=0.2), "does-not-hold")):
        assert (
            conclude(claim, judge(claim, adaptive_runs(), {"kernels": kernels})).verdict == verdict
        )


def test_a_model_that_never_changes_is_compared_with_nothing():
    claim = ADAPTIVE["NU-22"]
    for share, verdict in ((0.5, "holds"), (0.0, "undecided")):
        sides = [
            adaptive_runs(
                update=update,
                update_share=share * (update == "with"),
                size_error=0.2 + error + np.arange(10) / 1000,
                size_correlation=0.8 - error,
            )
            for update, error in (("with", 0.0), ("without", 0.2))
        ]
        assert conclude(claim, judge(claim, pd.concat(sides))).verdict == verdict
