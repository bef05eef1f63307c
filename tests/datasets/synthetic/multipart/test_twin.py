"""`stress/twin`: distance of the second person, and effect of the clothes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS
from trackmark import datasets


def twin(**parameters):
    return datasets.load(":".join(["stress/twin", *(f"{k}={v}" for k, v in parameters.items())]))


@settings(max_examples=6, deadline=None)
@given(
    seed=SEEDS,
    distance=st.one_of(st.just(0), st.floats(0, 3).map(lambda d: round(d, 3))),
)
def test_twin_reaches_the_requested_distance(seed, distance):
    sequence = twin(scene=seed, distance=distance)
    target, second = sequence.frames.plan.places
    apart = np.abs(second[:, 0] - target[:, 0]) / sequence.boxes[:, 2]
    assert apart.min() == pytest.approx(distance, abs=0.01)
    assert apart.argmin() == pytest.approx(75, abs=4)
    assert (sequence.visibility[:20] == 1).all()
    assert (sequence.visibility[-20:] == 1).all()
    if distance == 0:  # hidden but for what sticks out beside a narrower second person
        assert sequence.visibility.min() < 0.4
    if distance >= 2:
        assert (sequence.visibility == 1).all()
    assert sequence.present.all()
    assert not sequence.attributes["out_of_view"].any()


@pytest.mark.parametrize("distance", [0, pytest.param(1.5, marks=pytest.mark.slow)])
def test_twin_variants_differ_only_in_clothes(distance):
    same, other = (twin(distance=distance, twin=kind, scene=1) for kind in ("same", "other"))
    assert (same.boxes == other.boxes).all()
    assert (same.visibility == other.visibility).all()
    assert all((same.regions[key] == other.regions[key]).all() for key in same.regions)
    plan = same.frames.plan
    for frame in (75, 110):
        changed = (same[frame] != other[frame]).any(axis=2)
        left, top, alpha = plan.coverage(1, frame)
        rows, columns = np.nonzero(changed)
        reach = 6  # of the blur
        assert (rows >= top - 2).all()
        assert (rows < top + len(alpha) + 2).all()
        assert (columns >= left - reach).all()
        assert (columns < left + alpha.shape[1] + reach).all()
    assert (same[75] != other[75]).any()


def test_twin_wears_the_same_or_clearly_other_clothes():
    same, other = (twin(twin=kind, scene=2).frames.plan for kind in ("same", "other"))
    target, double = (person.look for person in same.people)
    unlike = other.people[1].look
    assert (other.people[0].look, other.people[0].seed) == (target, same.people[0].seed)
    assert (double.shirt, double.trousers) == (target.shirt, target.trousers)
    for garment in (unlike.shirt, unlike.trousers):
        for worn in (target.shirt, target.trousers):
            assert np.abs(np.subtract(garment, worn)).max() > 25
    unchanged = ("hair", "skin", "shoes", "weave", "long_hair", "hem", "bulk", "loose", "bag")
    assert all(getattr(unlike, key) == getattr(double, key) for key in unchanged)


def test_twin_distance_changes_only_the_second_person():
    near, far = twin(distance=0), twin(distance=3)
    assert (near.boxes == far.boxes).all()
    assert near.frames.plan.people[0].look == far.frames.plan.people[0].look
    assert near.frames.plan.seed == far.frames.plan.seed
