"""How many particles are needed, and how surely."""

from functools import partial
from math import inf

import numpy as np
import pandas as pd
import pytest

from bench.papers.wang2010.measures import _judged, _ratio, particles_needed, success_by_number

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


def scenes(*rows):
    return pd.DataFrame(rows, columns=NUMBERS)


def test_a_needed_number_is_decided_where_resampled_scenes_agree():
    late, early = [0, 0, 0, 1, 1], [1, 1, 1, 1, 1]
    judged = partial(_judged, statistic=NEEDED, least=300, most=600, reason="")
    assert judged(scenes(*[late] * 20)).verdict == "holds"
    assert judged(scenes(*[early] * 20)).verdict == "does-not-hold"
    assert judged(scenes(*[[0] * 5] * 20)).interval == (inf, inf)
    mixed = judged(scenes(*[late] * 3, *[early] * 17))
    assert mixed.verdict == "undecided"
    assert mixed.statistic == 400
    assert mixed.interval == (50, 400)
    assert judged(scenes(*[late] * 7)).cells == 0


def test_a_ratio_of_needed_numbers_is_infinite_where_the_other_never_succeeds_and_0_where_ours():
    ratio = partial(_ratio, NEEDED, NEEDED, len(NUMBERS))
    never, early, late = [0.0] * 5, [0, 1, 1, 1, 1], [0, 0, 0, 0, 1]
    assert ratio(np.array([*early, *late], float)) == 8
    assert ratio(np.array([*early, *never], float)) == inf
    assert ratio(np.array([*never, *late], float)) == 0
    assert ratio(np.array([*never, *never], float)) == 0


def test_success_is_a_share_of_repetitions_by_scene_and_number():
    rows = [(scene, number, scene % 2) for scene in range(4) for number in (15, 60)]
    runs = pd.DataFrame([*rows, (1, 15, 0)], columns=["scene", "particles", "success"])
    assert success_by_number(runs).to_numpy().tolist() == [[0, 0], [0.5, 1], [0, 0], [1, 1]]
