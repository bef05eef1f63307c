"""How many particles are needed, and how surely."""

from functools import partial
from math import inf
from types import SimpleNamespace

import pandas as pd
import pytest

from bench.papers.wang2010 import measures
from bench.papers.wang2010.measures import particles_needed, success_by_number

NUMBERS = (50, 100, 200, 400, 800)
NEEDED = partial(particles_needed, NUMBERS, share=0.9)


@pytest.mark.parametrize(
    ("shares", "needed"),
    [
        ([0.1, 0.5, 0.7, 1.0, 1.0], 400),
        ([0.1, 0.5, 0.9, 1.0, 1.0], 200),  # 90 % of the greatest
        ([0.1, 0.95, 0.2, 0.9, 1.0], 100),
        ([0.1, 0.5, 0.7, 0.8, 0.89], inf),
        ([0.0] * 5, inf),
    ],
)
def test_the_least_number_that_reaches_the_plateau_is_needed(shares, needed):
    assert NEEDED(shares) == needed
    assert (NEEDED([shares, shares]) == needed).all()


LATE, EARLY, NEVER = [0, 0, 0, 1, 1], [1, 1, 1, 1, 1], [0, 0, 0, 0, 0]


def judged(monkeypatch, check, settings, *curves):
    """Verdict of a check on made-up runs: scenes of each tracker with their successes."""
    tables = [
        pd.DataFrame(
            [
                {"scene": scene, "particles": number, "success": success}
                for scene, curve in enumerate(scenes)
                for number, success in zip(NUMBERS, curve, strict=True)
            ]
        )
        for scenes in curves
    ]
    monkeypatch.setattr(measures, "_curves", lambda *_: [({}, tables)])
    evidence = SimpleNamespace(
        claim=SimpleNamespace(id="WA-12"), comparisons=1, setting=settings.__getitem__
    )
    (finding,) = check(evidence)
    return finding.verdict


@pytest.mark.parametrize(
    ("scenes", "verdict"),
    [
        ([LATE] * 20, "holds"),
        ([EARLY] * 20, "does not hold"),
        ([NEVER] * 20, "does not hold"),
        ([LATE] * 12 + [EARLY] * 8, "inconclusive"),
        ([LATE] * 7, "inconclusive"),
    ],
)
def test_needed_particles_are_judged_by_scene(monkeypatch, scenes, verdict):
    settings = {"least": 300.0, "most": 600.0, "share": 0.9}
    found = judged(monkeypatch, measures.least_particles, settings, scenes)
    assert found.verdict == verdict
    assert found.cells == len(scenes)


@pytest.mark.parametrize(
    ("ours", "theirs", "verdict"),
    [
        (EARLY, LATE, "holds"),
        (EARLY, NEVER, "holds"),
        (EARLY, EARLY, "does not hold"),
        (NEVER, NEVER, "does not hold"),
    ],
)
def test_ratio_of_needed_particles_is_judged_by_scene(monkeypatch, ours, theirs, verdict):
    settings = {"ratio": 3.0, "particles": 50, "share": 0.9}
    found = judged(monkeypatch, measures.fewer_particles, settings, [ours] * 20, [theirs] * 20)
    assert found.verdict == verdict


def test_success_is_a_share_of_repetitions_by_scene_and_number():
    rows = [(scene, number, scene % 2) for scene in range(4) for number in (15, 60)]
    runs = pd.DataFrame([*rows, (1, 15, 0)], columns=["scene", "particles", "success"])
    assert success_by_number(runs).to_numpy().tolist() == [[0, 0], [0.5, 1], [0, 0], [1, 1]]
