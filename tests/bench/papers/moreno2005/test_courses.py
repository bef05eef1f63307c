"""What is told of a run from its region similarities."""

import numpy as np
import pytest

from bench.papers.moreno2005.courses import COURSE, course_of

N = 40


def similarity(**dips):
    """J of .9 after a first frame without any; `dips` by frame, as `f7=.3`."""
    values = np.full(N, 0.9)
    values[0] = np.nan
    for frame, value in dips.items():
        values[int(frame[1:])] = value
    return values


def course(made_run, made_truth, values, **attributes):
    return course_of(made_run(values), made_truth(**attributes))


def test_a_run_without_a_dip_is_tracked_and_nothing_arose(made_run, made_truth):
    found = course(made_run, made_truth, similarity())
    assert tuple(found) == COURSE
    assert (found["first_loss"], found["tracked"], found["gone"]) == (N, 1, 0)
    assert found["least_similarity"] == 0.9
    assert np.isnan([found["lost_by_jump"], found["near_patch"]]).all()
    assert found["elsewhere"] == pytest.approx(0.9)


def test_the_first_frame_below_one_half_ends_tracking(made_run, made_truth):
    found = course(made_run, made_truth, similarity(f7=0.49, f9=0.05, f5=0.5))
    assert (found["first_loss"], found["tracked"], found["gone"]) == (7, 0, 1)
    assert found["least_similarity"] == 0.05
    assert course(made_run, made_truth, similarity(f7=0.1))["gone"] == 0


@pytest.mark.parametrize(
    ("dips", "jumps", "lost"),
    [
        ({"f10": 0.4}, (1,), 1),
        ({"f10": 0.5}, (1,), 0),
        ({"f9": 0.4, "f11": 0.4}, (1,), 0),
        ({"f29": 0.4}, (20, 25), 1),
        ({"f34": 0.4}, (20, 25), 0),
    ],
)
def test_a_target_is_lost_by_a_jump_if_the_tenth_frame_from_it_is_not_tracked(
    made_run, made_truth, dips, jumps, lost
):
    found = course(made_run, made_truth, similarity(**dips), jumps=jumps)
    assert found["lost_by_jump"] == lost


def test_what_was_lost_before_a_jump_is_not_lost_by_it(made_run, made_truth):
    dips = {"f19": 0.49, "f29": 0.1}
    assert np.isnan(course(made_run, made_truth, similarity(**dips), jumps=(20,))["lost_by_jump"])
    dips = {"f18": 0.1, "f19": 0.5, "f29": 0.1}
    assert course(made_run, made_truth, similarity(**dips), jumps=(20,))["lost_by_jump"] == 1


def test_a_jump_too_near_the_end_says_nothing(made_run, made_truth):
    assert course(made_run, made_truth, similarity(f39=0.1), jumps=(30,))["lost_by_jump"] == 1
    assert np.isnan(course(made_run, made_truth, similarity(), jumps=(31,))["lost_by_jump"])


def test_frames_with_a_similar_patch_are_told_from_others(made_run, made_truth):
    values = similarity(f3=0.5, f4=0.7)
    found = course(made_run, made_truth, values, patches=(0, 3, 4))
    assert found["near_patch"] == pytest.approx(0.6)
    assert found["elsewhere"] == pytest.approx(0.9)
