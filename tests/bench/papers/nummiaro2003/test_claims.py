"""Claims whose tests are the paper's own, or read several tables, where the outcome is known."""

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.evaluation import judge
from bench.claims.ledger import read_claims
from bench.claims.sides import run_key
from bench.papers.nummiaro2003.measures import CHECKS

CLAIMS = read_claims("nummiaro2003")
WOBBLE = np.arange(10) / 1000


def runs(options="", sequence="nummiaro2003/traffic", **columns):
    """Runs as written, with other options, in ten scenes."""
    text = f"nummiaro2003:preset=as-written{options}"
    usual = {
        "tracker": "nummiaro2003",
        "settled": run_key(text),
        "light": "even",
        "sequence": sequence,
        "kept_scene": True,
        "repetition": 0,
        "frames": 100,
        "failure": "",
    }
    return pd.DataFrame({"scene": range(10), **usual, **columns})


def concluded(name, *scores, **tables):
    found = judge(CLAIMS[name], pd.concat(scores or [runs()]), tables, CHECKS)
    return conclude(CLAIMS[name], found)


def updates(good, other, options="", others=50, **columns):
    counts = {"good_frames": 100, "other_frames": others, "waiting_frames": 50}
    return runs(options, good_updates=good, other_updates=other, **counts, **columns)


@pytest.mark.parametrize(
    ("good", "other", "verdict"),
    [(50, 1, "holds"), (50, 30, "does-not-hold"), (4, 0, "does-not-hold")],
)
def test_an_update_has_its_place_in_good_frames(good, other, verdict):
    found = concluded("NU-9", updates(good, other))
    assert found.verdict == verdict
    assert f"{other:.1f} % of the others with the 500 in" in found.reason
    assert concluded("NU-9", updates(good, 0, others=0)).verdict == "undecided"


def test_each_reading_of_the_condition_is_judged():
    found = concluded(
        "NU-9",
        updates(50, 0),
        updates(0, 0, ":update_reading=printed"),
        updates(100, 50, ":update_reading=coefficient"),
        updates(0, 0, ":model_update=false"),
    )
    assert (found.verdict, found.readings, found.post_hoc) == ("holds", "1 of 2", "0 of 1")


@pytest.mark.parametrize(
    ("fast", "verdict"), [(0.95, "holds"), (0.5, "does-not-hold"), (np.nan, "undecided")]
)
def test_fast_frames_are_set_against_nine_tenths_of_the_others(fast, verdict):
    frame = runs(inside_fast=fast + WOBBLE, inside_otherwise=1.0)
    assert concluded("NU-23", frame).verdict == verdict


def test_time_and_area_rise_together():
    area = np.linspace(1, 2, 30)
    for seconds, verdict in ((area**3, "holds"), (-area, "does-not-hold"), (area[:0], "undecided")):
        table = pd.DataFrame({"area": area[: len(seconds)], "seconds": seconds})
        assert concluded("NU-14", frame_times=table).verdict == verdict


@pytest.mark.parametrize(
    ("worse", "verdict"),  # what 0.1 has less of
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
    def reached(*names, written):
        return {name: 0.9 - written * worse.get(name, 0.0) for name in names}

    scores = [
        runs(
            "" if written else f":kick_off={b}",
            "nummiaro2003/students",
            repetition=repetition,
            **{
                k: v + WOBBLE
                for k, v in reached("recovered", "right_at_end", written=written).items()
            },
        )
        for b in (0.05, 0.1, 0.2, 0.4)
        for written in [b == 0.1]
        for repetition in range(4 if written else 1)
    ]
    entered = [
        {"sequence": "nummiaro2003/person", "scene": scene, "preset": "as-written"}
        | {"kick_off": b, "repetition": 0}
        | reached("started", "no_false_start", written=b == 0.1)
        for b in (0.05, 0.1, 0.2, 0.4)
        for scene in range(10)
    ]
    found = concluded("NU-12", *scores, kick_off=pd.DataFrame(entered))
    assert found.verdict == verdict
    assert concluded("NU-12", *scores).verdict == "undecided"


def test_weights_must_also_lead_to_the_centre():
    table = pd.DataFrame(
        {
            "sequence": "nummiaro2003/car",
            "scene": scene,
            "kernel": kernel,
            "margin": 0.3 + 0.1 * (kernel == "isotropic") + scene / 1000,
            "centre_error": 0.2 + scene / 1000 - 0.1 * (kernel == "isotropic"),
        }
        for scene in range(10)
        for kernel in ("isotropic", "uniform")
    )
    assert concluded("NU-5", kernels=table).verdict == "holds"
    assert concluded("NU-5", kernels=table.assign(centre_error=0.2)).verdict == "does-not-hold"


@pytest.mark.parametrize(("share", "verdict"), [(0.5, "holds"), (0.0, "undecided")])
def test_a_model_that_never_changes_is_compared_with_nothing(share, verdict):
    worse = {"size_error": 0.4 + WOBBLE, "size_correlation": 0.6, "update_share": 0.0}
    better = {"size_error": 0.2 + WOBBLE, "size_correlation": 0.8, "update_share": share}
    found = concluded("NU-22", runs(**better), runs(":model_update=false", **worse))
    assert found.verdict == verdict
    assert ("nothing to compare" in found.reason) == (verdict == "undecided")


def test_wider_trees_change_the_verdict_that_names_them_alone():
    def both(sequence, gain, **columns):
        inside = {"frames_inside": 50 + WOBBLE, "right_at_end": 0.5 + WOBBLE, **columns}
        return [
            runs(":model_update=false", sequence, **inside),
            runs(":reinitialise=false", sequence, **inside),
            runs(
                "",
                sequence,
                **{name: inside[name] + gain * (name != "recovered") for name in inside},
            ),
        ]

    students, wide = (f"nummiaro2003/students{tree}" for tree in ("", ":tree=2"))
    narrow = both(students, 0.3, recovered=1.0)
    hidden = both(wide, -40.0, recovered=0.0)
    changing = both("nummiaro2003/head", 10.0) + both("nummiaro2003/traffic", 10.0)
    found = [concluded("NU-17", *every) for every in (narrow, narrow + hidden)]
    assert found[0].for_json() == found[1].for_json()
    found = [concluded("NU-26", *changing, *every) for every in (narrow, narrow + hidden)]
    assert found[0].for_json() != found[1].for_json()
    assert found[1].verdict == "holds"
