"""What is asked of the multi-part tracker's runs: checks on tables whose outcome is known."""

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.judging import judge
from bench.claims.ledger import read_claims
from bench.claims.sides import run_key
from bench.papers.multipart.measures import CHECKS, scores
from bench.papers.multipart.timing import kernel_times

CLAIMS = read_claims("multipart")
NOTHING = pd.DataFrame()


def concluded(name, scores=NOTHING, **tables):
    frames = {key: pd.DataFrame(table) for key, table in tables.items()}
    found = judge(CLAIMS[name], scores, frames, CHECKS)
    return conclude(CLAIMS[name], found)


def rectangles(two, plain, initial="full"):
    """First rectangles of eight sequences in 24 scenes; `two`, `plain`: what the rule says."""
    return [
        {
            "sequence": f"multipart/{number}",
            "init": "boxes" if initial == "body" else initial,
            "scene": scene,
            "kept_scene": True,
            "distance": 0.4 + (two if number in (1, 2, 5, 6) else plain) + 0.001 * scene,
            "multi_share": float((two if number in (1, 2, 5, 6) else plain) > 0),
        }
        for number in range(1, 9)
        for scene in range(24)
    ]


def runs(share, near=False, sequences=range(1, 9), representations=("adaptive",)):
    return pd.DataFrame(
        [
            {
                "tracker": "multipart",
                "settled": run_key(f"multipart:init=full:representation={representation}"),
                "failure": "",
                "sequence": f"multipart/{number}",
                "scene": scene,
                "light": "even",
                "repetition": repetition,
                "frames": 100,
                "kept_scene": True,
                "frames_inside": 100 * share(representation, number),
                "first_loss": 100 * share(representation, number),
                "near_occlusion": float(near),
            }
            for representation in representations
            for number in sequences
            for scene in range(12)
            for repetition in range(3)
        ]
    )


def times(ratio, kernel="one pass"):
    single = np.linspace(1.0, 2.0, 10)
    return [{"kernel": kernel, "single": t, "multi": ratio * t} for t in single]


def test_identity_and_layout_are_shares_of_scenes():
    assert concluded("MP-6a", identity={"identical": [True] * 12}).verdict == "holds"
    assert concluded("MP-6a", identity={"identical": [False] * 12}).verdict == "does not hold"
    few = concluded("MP-6a", identity={"identical": [True] * 2})
    assert few.reason == "only 2 of 12 scenes"


@pytest.mark.parametrize(
    ("single", "multi", "verdict"),
    [(0.0, 0.5, "holds"), (0.03, 0.5, "does not hold"), (0.0, 0.39, "does not hold")],
)
def test_swapped_halves_are_seen_by_two_histograms_alone(single, multi, verdict):
    layout = {"single": [single] * 12, "multi": [multi] * 12}
    assert concluded("MP-17", layout=layout).verdict == verdict


def test_the_switch_must_be_right_on_every_sequence():
    good = rectangles(0.1, -0.1)
    assert concluded("MP-7", switch=good).verdict == "holds"
    for wrong, verdict in ((4, "inconclusive"), (24, "does not hold")):
        for row in good[:wrong]:  # of the first sequence
            row["multi_share"] = 0.0
        assert concluded("MP-7", switch=good).verdict == verdict
    found = concluded("MP-7", switch=good)
    assert found.found.effect.startswith("multipart/1: 0.00 [")
    assert found.reason.startswith("part multipart/1: interval below 0.75; interval at 99.4 %")
    assert found.reason.endswith("88 % of all picks are right")
    assert concluded("MP-7", switch=rectangles(0.1, -0.1)[::6]).verdict == "inconclusive"


def test_the_headline_of_the_switch_is_the_full_rectangle():
    table = rectangles(-0.1, 0.1) + rectangles(0.1, -0.1, "body")
    found = concluded("MP-7", switch=table)
    assert (found.verdict, found.readings, found.post_hoc) == ("does not hold", "0 of 1", "1 of 1")
    assert found.fragile


def test_classes_are_told_apart_or_not():
    found = concluded("MP-7a", switch=rectangles(0.1, -0.1))
    assert found.verdict == "holds"
    assert "area over all scenes 1.000; thresholds from 0.323 to 0.500" in found.reason
    found = concluded("MP-7a", switch=rectangles(0.1, 0.1))
    assert found.verdict == "does not hold"
    assert "no threshold is without error" in found.reason
    assert "at 0.4 50 % are wrong" in found.reason
    some = rectangles(0.1, -0.1)
    for row in some[:12]:  # the first sequence in half of the scenes
        row["distance"] = 0.2
    found = concluded("MP-7a", switch=some)
    assert found.verdict == "inconclusive"
    assert found.found.cells == 24
    assert found.found.statistic == pytest.approx(0.875 - 0.9)
    assert concluded("MP-7a", switch=rectangles(0.1, -0.1)[::10]).verdict == "inconclusive"


def test_slower_is_judged_by_kernel_with_one_pass_as_the_headline():
    found = concluded("MP-8", times=times(1.0) + times(1.3, "two calls"))
    assert (found.verdict, found.readings) == ("does not hold", "1 of 2")
    assert found.fragile
    assert concluded("MP-8", times=times(1.1)).verdict == "holds"


@pytest.mark.parametrize(
    ("multi", "single", "ratio", "verdict"),
    [
        (0.8, 1.0, 1.1, "holds"),
        (1.0, 1.0, 1.0, "holds"),
        (1.0, 1.0, 0.9, "does not hold"),
        (0.8, 1.0, 0.9, "does not hold"),
        (1.0, 0.5, 1.1, "does not hold"),
    ],
)
def test_single_is_preferable_if_no_worse_and_no_slower(multi, single, ratio, verdict):
    shares = {"multi": multi, "single": single}
    frame = runs(lambda name, _: shares[name], representations=("single", "multi"))
    assert concluded("MP-9", frame, times=times(ratio)).verdict == verdict


@pytest.mark.parametrize(
    ("share", "near", "verdict"),
    [(1.0, False, "holds"), (0.5, False, "does not hold"), (1.0, True, "does not hold")],
)
def test_an_occlusion_is_survived(share, near, verdict):
    assert concluded("MP-13", runs(lambda *_: share, near)).verdict == verdict


def test_when_a_target_is_lost_is_printed():
    found = concluded("MP-15", runs(lambda *_: 0.8))
    assert found.verdict == "not testable"
    assert "lost in 36 of 36 runs, 0 of them near an occlusion" in found.reason
    assert (found.found.cells, found.found.counted) == (12, "scene")


def picked(distance, representation, failure=""):
    """A run whose switch sees a distance of the halves."""
    text = f"multipart:init=full:representation={representation}"
    known = {"text": text, "part_distance": distance, "threshold": 0.4, "failure": failure}
    return known | {"representation": representation}


def test_the_proposed_methods_runs_are_copies_of_the_picked_ones():
    both = (
        [(0.5, name) for name in ("single", "multi")],
        [(0.3, name) for name in ("single", "multi")],
    )
    found = scores(pd.DataFrame(picked(*one) for run in both for one in run).assign(copied=False))
    copies = found[found["copied"]]
    assert set(copies["representation"]) == {"adaptive"}
    assert copies["part_distance"].tolist() == [0.5, 0.3]
    # What it would have picked is not known of a run that failed: it failed, too.
    found = scores(pd.DataFrame([picked(np.nan, "single", "why")]).assign(copied=False))
    assert found["representation"].tolist() == ["single", "adaptive"]


def test_both_kernels_are_timed_whole_and_by_halves():
    found = kernel_times(["stress/twin:distance=3:scene=1"], 2)
    assert set(found["kernel"]) == {"one pass", "two calls"}
    assert (found[["single", "multi", "reference"]] > 0).all(axis=None)
