"""Numbers and notes on the times of a run."""

import numpy as np
import pytest

from trackmark.bench.metrics.times import TIME_FIELDS, Times, run_delay_share, time_fields

ONE = np.ones(100)


def times(seconds, cpu=None, children=0.0, run_delay=0.0, init=(0.5,), first=(0,)):
    """Return times; the CPU time is by default that of one computing thread."""
    seconds = np.asarray(seconds, float)
    n = len(seconds)
    return Times(
        seconds,
        np.full(n, run_delay),
        seconds if cpu is None else np.full(n, cpu),
        np.full(n, children),
        np.isin(np.arange(n), first),
        np.array(init),
    )


def test_first_update_and_init_are_apart_from_time_per_frame():
    later = np.arange(1, 101) / 1000
    fields = time_fields(times([0.6, *later], init=(0.2, 0.4)))
    assert fields["ms_per_frame"] == pytest.approx(50.5)
    assert fields["fps"] == pytest.approx(1 / 0.0505)
    assert fields["ms_per_frame_median"] == pytest.approx(50.5)
    assert fields["ms_per_frame_p95"] == pytest.approx(1e3 * np.quantile(later, 0.95))
    assert fields["ms_first_update"] == pytest.approx(600)
    assert fields["ms_init"] == pytest.approx(300)
    assert fields.keys() == set(TIME_FIELDS)


def test_each_initialisation_has_a_first_update():
    fields = time_fields(times([0.6, 0.1, 0.4, 0.1], first=(0, 2)))
    assert fields["ms_per_frame"] == pytest.approx(100)
    assert fields["ms_first_update"] == pytest.approx(500)


def test_single_update_is_the_time_per_frame():
    fields = time_fields(times([0.6]))
    assert fields["ms_per_frame"] == fields["ms_first_update"] == pytest.approx(600)
    assert time_fields(times([])) == {}


def test_run_delay_share_is_of_all_updates():
    disturbed = times(ONE, run_delay=0.25)
    assert disturbed.run_delay_share == pytest.approx(0.2)
    assert disturbed.is_disturbed
    assert not times(ONE, run_delay=0.1).is_disturbed


@pytest.mark.parametrize(
    ("measured", "note"),
    [
        (times(ONE), ""),
        (times(ONE, cpu=1.4), ""),
        (times(ONE, cpu=1.6), "computes in several threads"),
        (times(ONE, cpu=0.1, children=0.8), "computes in another process"),
        (times(ONE, cpu=0.6), "waits"),
        (times(ONE * 1e-5, cpu=4e-5), ""),  # differences of microseconds mean nothing
        (times([1, *[0.001] * 97, 0.1, 0.1]), "a few frames take most of the time"),
        (times([1, *[1e-5] * 97, 1e-3, 1e-3]), ""),
        (times([1, *[0.001, 0.001, 0.01] * 33]), ""),  # every third frame is no exception
    ],
)
def test_note_explains_times(measured, note):
    assert time_fields(measured).get("time_note", "") == note


@pytest.mark.parametrize(("seconds", "delay", "share"), [(3, 1, 0.25), (0, 0, 0), (0, 2, 1)])
def test_run_delay_share_is_a_fraction_of_wall_time(seconds, delay, share):
    assert run_delay_share(seconds, delay) == share
