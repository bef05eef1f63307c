"""Breaking points: sequences and end of a series, tables and curves."""

from math import exp, isinf, isnan

import numpy as np
import pytest

from trackmark import datasets
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.stress import breaking_points
from trackmark.bench.stress.breaking_points import (
    BreakingPoints,
    Difficulty,
    RunSequences,
    StressTest,
    difficulty_ratio,
    parse_difficulty,
    stress_json,
    stress_tables,
    write_curves,
)
from trackmark.datasets import SequenceError

NOISE = Difficulty("noise", "grey levels", 0, 160)
GAIN = Difficulty("gain", "times the light", 1, 0.02, logarithmic=True)
SCENES = RunSequences(["plain/target"])


def complete_test(tracker, difficulty, half, slope=0.05, most=100, sequences=SCENES):
    """Return the complete series of a tracker whose survival is known."""
    stress_test = StressTest(tracker, difficulty, sequences, most)
    while runs := stress_test.next_runs():
        generator = np.random.default_rng(len(stress_test.trials))
        stress_test = stress_test.extended_by(
            {
                text: (
                    generator.uniform()
                    < 1 / (1 + exp((difficulty.position(level) - half) / slope)),
                    "",
                )
                for text, level in runs
            }
        )
    return stress_test


@pytest.mark.parametrize(
    ("difficulty", "half", "level"), [(NOISE, 0.3, 48), (GAIN, 0.5, 0.1414), (GAIN, 0.75, 0.0532)]
)
def test_breaking_point_is_in_units_of_the_difficulty(difficulty, half, level):
    stress_test = complete_test("a", difficulty, half)
    low, high = sorted(stress_test.interval)
    assert stress_test.outcome == "broken"
    assert low < stress_test.level < high
    assert low < level < high
    assert stress_test.threshold.half_width <= 0.05 or len(stress_test.trials) == 100
    assert stress_test.trials == complete_test("a", difficulty, half).trials


@pytest.mark.parametrize(
    ("half", "outcome", "text"), [(2.5, "never", "never to 0.02"), (-2.0, "at once", "at once")]
)
def test_breaking_point_beyond_the_range_has_no_level(half, outcome, text):
    stress_test = complete_test("a", GAIN, half)
    assert stress_test.outcome == outcome
    assert len(stress_test.trials) < 100
    assert any(map(isinf, stress_test.interval))
    (table,) = stress_tables(BreakingPoints([stress_test], "a"))
    assert text in table.rows[0][2].text
    assert stress_json(BreakingPoints([stress_test], "a"))["stress_tests"][0]["level"] is None


def test_factor_is_above_1_for_the_stronger_tracker():
    weak, strong = (
        complete_test("weak", GAIN, 0.3, 0.02),
        complete_test("strong", GAIN, 0.6, 0.02),
    )
    ratio, (low, high) = difficulty_ratio(strong, weak)
    assert low < 50**0.3 < high
    assert 1 < low < ratio < high
    never = difficulty_ratio(complete_test("never", GAIN, 2.5), weak)
    assert never[0] > 1
    assert isinf(never[1].high)
    assert isnan(difficulty_ratio(strong, complete_test("never", GAIN, 2.5))[0])


@pytest.mark.filterwarnings("error")
def test_factor_needs_levels_that_have_a_ratio():
    fading = Difficulty("light", "share", 1, 0)
    weak = complete_test("weak", fading, 0.5, 0.02)
    for half in (0.97, 2.5):  # the target survives near 0, or at 0
        ratio, (low, high) = difficulty_ratio(complete_test("strong", fading, half, 0.02), weak)
        assert 1 < low < ratio < high
    below = Difficulty("pan", "pixels/frame", -2, 2)
    assert isnan(
        difficulty_ratio(complete_test("a", below, 0.6), complete_test("b", below, 0.4))[0]
    )


def test_runs_of_one_number_share_scene_and_draw():
    texts = [SCENES.spec(NOISE, 20, i) for i in range(50)]
    assert texts[7] == "plain/target:scene=7:filter.noise=20:filter.draw=7"
    assert SCENES.spec(GAIN, 0.5, 7) == "plain/target:scene=7:filter.gain=0.5:filter.draw=7"
    assert len(set(texts)) == 50
    speed = parse_difficulty("speed=2..8", ["plain/target"])
    assert speed.unit == "pixels/frame"
    text = SCENES.spec(speed, 3.5, 0)
    assert datasets.load(text).name == "plain/target:speed=3.5"


def test_runs_without_scenes_start_at_different_frames():
    sequences = RunSequences(["samples/face", "plain/target:scene=4"])
    texts = [sequences.spec(NOISE, 20, i) for i in range(8)]
    assert texts[0] == "samples/face:filter.noise=20"
    assert texts[3] == "plain/target:scene=4:filter.start=15:filter.noise=20:filter.draw=3"
    assert len({datasets.load(text).fingerprint for text in texts}) == 8
    assert all(len(datasets.load(text)) >= 90 for text in texts)
    later = RunSequences(["samples/face:filter.start=40"])
    assert later.spec(NOISE, 20, 1) == "samples/face:filter.start=50:filter.noise=20:filter.draw=1"


@pytest.mark.parametrize(
    ("text", "sequence", "words"),
    [
        ("nois", "samples/face", "Did you mean 'noise'"),
        (
            "speed=1..3",
            "samples/face",
            "--difficulty speed: the sequence samples/face has no parameter 'speed'",
        ),
        ("speed", "plain/target", "speed=FROM..TO"),
        ("noise=3", "plain/target", "noise=FROM..TO"),
        ("noise=3..3", "plain/target", "noise=FROM..TO"),
        ("gain=1..0", "plain/target", "above 0"),
        ("start", "samples/face", "--difficulty start: the sequence samples/face has no"),
        ("scene=0..9", "plain/target", "--difficulty scene: the sequence plain/target has no"),
    ],
)
def test_unknown_difficulty_is_refused(text, sequence, words):
    with pytest.raises(ExperimentError, match=words) as caught:
        parse_difficulty(text, [sequence])
    assert "\n" not in str(caught.value)


def test_sequence_that_is_too_short_is_refused():
    with pytest.raises(ExperimentError, match="Give a sequence of 40 frames or more"):
        RunSequences(["plain/target:length=30:scene=1"])
    with pytest.raises(SequenceError, match="nowhere"):
        RunSequences(["nowhere"])


def test_tables_and_curves_have_the_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(breaking_points, "POSITIONS", np.linspace(0, 1, 21))  # coarse curves
    stress_test = [
        complete_test(name, NOISE, half) for name, half in (("a", 0.3), ("b", 0.5), ("c", 3.0))
    ]
    result = BreakingPoints(stress_test, "a")
    points, runs = stress_tables(result, with_runs=True)
    assert points.rows[0][4].text == "1"
    assert points.rows[2][4].text.startswith("more than")
    assert len(runs.records) == sum(len(entry.trials) for entry in stress_test)
    (curve,) = write_curves(result, tmp_path)
    assert curve.stat().st_size > 10_000
