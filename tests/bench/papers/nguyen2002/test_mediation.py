"""Whether failures go with what is lost of the margin, set by set."""

import pandas as pd
import pytest

from bench.claims.ledger import read_claims
from bench.claims.measuring import matching, verdict_of
from bench.papers.nguyen2002.measures import CLIPS, failures_by_margin
from bench.papers.nguyen2002.scores import LIGHTS

WRITTEN = "nguyen2002:preset=as-written"
TEXTS = [f"{WRITTEN}:features={features}" for features in ("rgb", "invariants", "arctan")]
SEEN = [f"nguyen2002/clip-{number:02}" for number in range(1, 6)]


def margins(scenes):
    """Of five clips a set: the invariants lose more of them with every clip."""
    return pd.DataFrame(
        {"name": f"{clip}:scene={scene}", "features": features, "margin": 1.0 - lost}
        for scene in range(scenes)
        for number, clip in enumerate(SEEN)
        for features, lost in (("rgb", 0.0), ("invariants", 0.1 * number), ("arctan", 9.0))
    )


def test_failures_go_with_what_the_invariants_lose_of_the_margin_set_by_set(made_scores):
    def fares(text, sequence, scene, trace):
        number = SEEN.index(sequence)
        if "arctan" in text:
            return {"on_target": 0.1 + 0.2 * number}
        if "rgb" in text or trace == "revised":
            return {"on_target": 0.9}  # all clips fare alike in the end
        # In the second set they fail the other way round, and more.
        return {"on_target": 0.9 - 0.01 * number**2 if scene == 0 else 0.1 + 0.2 * number}

    found = failures_by_margin(margins(2), made_scores(fares, TEXTS, 2, SEEN))
    assert found["correlation"].tolist() == pytest.approx([1, 0, -1, 0])
    assert found["pairs"].tolist() == ["of a clip", "by chance"] * 2
    assert found["scene"].tolist() == [0, 0, 1, 1]
    assert set(found["sequence"]) == {CLIPS}
    assert set(found["trace"]) == {"online"}
    assert set(found["preset"]) == {"as-written"}
    assert set(found["clips"]) == {5}


def test_only_clips_whose_margins_were_measured_count(made_scores):
    def fares(text, sequence, scene, trace):
        if sequence not in SEEN:
            return {"on_target": 0.5 if "invariants" in text else 0.9}
        return {"on_target": 0.9 - 0.1 * SEEN.index(sequence) * ("invariants" in text)}

    scores = made_scores(fares, TEXTS, 1, [LIGHTS, *SEEN, "nguyen2002/clip-06"])
    found = failures_by_margin(margins(1), scores)
    assert set(found["clips"]) == {5}
    none = failures_by_margin(margins(1), scores[scores["features"] == "rgb"])
    assert none.empty
    assert list(none) == list(found)


def test_the_claim_compares_what_is_found_with_chance(made_scores):
    test = read_claims("nguyen2002")["NG-9"].test.parts["and hence more failures"]

    def fares(text, sequence, scene, trace):
        return {"on_target": 0.9 - 0.1 * SEEN.index(sequence) * ("invariants" in text)}

    found = failures_by_margin(margins(8), made_scores(fares, TEXTS, 8, SEEN))
    assert verdict_of("NG-9", test, found[found["trace"] == "online"], "correlation").cells == 8
    (better, worse) = (matching(found, rows)["correlation"] for rows in (test.better, test.worse))
    assert better.tolist() == pytest.approx([1.0] * 16)
    assert worse.tolist() == [0.0] * 16
