"""Runs on a painted target with more and more noise."""

import numpy as np
import pandas as pd
import pytest

from bench.papers.nguyen2002.checks import sensor


def test_noise_is_added_and_false_occlusions_are_counted(sequence):
    shown = sequence(30)
    noisy = sensor.Noisy(shown.frames, 4.0)
    assert (noisy[3] == noisy[3]).all()
    assert (noisy[3].astype(float) - shown[3]).std() == pytest.approx(4, abs=0.2)
    rows = sensor.measure(shown, quick=True)["ng-22"]
    assert sorted(rows["noise"].unique()) == [1, 2, 4, 8]
    assert rows.groupby("trace").size().tolist() == [8, 8]
    assert (rows["false_occlusions"] == 0).all()
    assert (rows["mean_overlap"] > 0.8).all()


def flashing(sequence, *frames):
    """False occlusions and overlaps by RGB, in the end and at once, with the least noise."""
    shown = sequence(30, lamp=[0.3 if t in frames else 1.0 for t in range(30)])
    rows = sensor.measure(shown, quick=True)["ng-22"].query("features == 'rgb' and noise == 1")
    rows = rows.set_index("trace").loc[["revised", "online"]]
    return rows["false_occlusions"].tolist(), rows["mean_overlap"].tolist()


def test_a_flash_is_one_false_occlusion_which_is_made_up_for_in_the_end(sequence):
    declared, (revised, online) = flashing(sequence, 12)
    assert declared == pytest.approx([100 / 30] * 2)
    assert revised > online


def test_flashes_are_counted_one_by_one_though_the_second_comes_before_the_first_is_over(sequence):
    declared, _ = flashing(sequence, 8, 22)  # it looks 35 frames ahead
    assert declared == pytest.approx([200 / 30] * 2)


def test_a_part_is_much_longer_than_what_an_occlusion_may_hide(sequence):
    assert sensor.measure(sequence(2 * 35), quick=False) == {}


def test_lines_are_laid_through_all_noises_of_features_and_trace():
    found = pd.DataFrame(
        {
            "features": one,
            "trace": trace,
            "noise": noise,
            "mean_overlap": 0.9 - slope * noise,
            "false_occlusions": 8.0 * (noise == 4),
        }
        for one, slope in (("rgb", 0.01), ("invariants", 0.02))
        for trace in ("revised", "online")
        for noise in (1.0, 2.0, 4.0, 8.0)
    )
    lines = sensor.lines(found).set_index(["features", "trace", "noise"]).sort_index()
    assert len(lines) == 2 * 2 * 2
    assert lines.loc[("rgb", "online", 1.0), "mean_overlap"] == pytest.approx(0.89)
    assert lines.loc[("invariants", "revised", 8.0), "mean_overlap"] == pytest.approx(0.74)
    # What is found between the least and the greatest noise counts.
    at_ends = np.polyval(np.polyfit([1, 2, 4, 8], [0, 0, 8, 0], 1), [1, 8])
    counted = lines.loc[("rgb", "revised"), "false_occlusions"]
    assert counted.tolist() == pytest.approx(at_ends.tolist())
    assert at_ends[0] > 1
