"""What is run: repetitions, and all that the ledger's tests and readings name."""

import pytest

from bench.claims.ledger import ANY, read_claims
from bench.papers import Effort
from bench.papers.wang2010 import SENSITIVITIES, TIMED, experiments
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import labels_of


def by_name(**effort):
    return {experiment.name: experiment for experiment in experiments(Effort(**effort))}


@pytest.fixture(scope="module")
def labels():
    """Labels of all that is run by default, by sequence."""
    return {
        sequence: [
            labels_of(text, sequence)
            for name, one in by_name().items()
            for text in one.trackers
            if name != TIMED and any(s.text.startswith(sequence) for s in one.sequences)
        ]
        for sequence in (TABLE_TENNIS, HAND, CUP)
    }


def test_what_the_papers_figures_and_numbers_rest_on_is_repeated_most():
    usual, every = by_name(), by_name(everything=True)
    assert {usual[f"wang2010-figure-{k}"].repetitions for k in (3, 5, 6)} == {20}
    assert usual["wang2010-particles"].repetitions == 5
    assert {usual[name].repetitions for name in SENSITIVITIES} == {2}
    assert {every[name].repetitions for name in SENSITIVITIES} == {5}
    few = by_name(everything=True, seeds=3)
    assert {few[name].repetitions for name in SENSITIVITIES} == {3}
    assert {one.repetitions for one in by_name(everything=True, quick=True).values()} == {1}


def test_a_quick_look_leaves_out_what_is_varied():
    assert list(by_name(quick=True)) == [n for n in by_name() if n not in SENSITIVITIES]


def test_a_quick_look_times_the_sequence_of_table_1():
    assert [source.text for source in by_name(quick=True)[TIMED].sequences] == [TABLE_TENNIS]


@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_every_weight_of_hue_is_run_on_every_sequence(labels, preset):
    for sequence, known in labels.items():
        models = {
            one["model"]
            for one in known
            if one["tracker"] == "wang2010"
            and one["preset"] == preset
            and one["variant"] == ""
            and one["budget"] == "paper"
        }
        assert models >= {f"alpha={a}" for a in ("0.5", "0.6", "0.8", "0.9", "1")}, sequence


@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_motion_by_drift_is_complete_on_every_sequence(labels, preset):
    for sequence, known in labels.items():
        for number in (15, 60) if sequence == CUP else (60,):
            found = {
                (one["tracker"], one["model"])
                for one in known
                if one["particles"] == number
                and one["preset"] == preset
                and one["variant"] == ""
                and one["radius"] == "rule"
                and one["reach"] in ("rule", ANY)
            }
            assert found >= {
                (tracker, model)
                for tracker in ("wang2010", "particle-filter")
                for model in ("fused", "colour", "hue")
            }, (sequence, number)


def test_number_and_reach_are_told_apart(labels):
    for preset in ("as-written", "recommended"):
        for tracker in ("wang2010", "particle-filter"):
            for radius in ("rule", "10"):
                numbers = {
                    one["particles"]
                    for one in labels[TABLE_TENNIS]
                    if one["tracker"] == tracker
                    and one["preset"] == preset
                    and one["variant"] == ""
                    and one["model"] == "fused"
                    and one["radius"] in (radius, ANY)
                    and one["reach"] in ("rule", ANY)
                }
                assert numbers >= {10, 15, 25, 50, 60, 100, 200, 400, 800}, (tracker, radius)


def test_what_a_climb_stops_at_is_varied_on_every_sequence(labels):
    for known in labels.values():
        for tracker in ("wang2010", "camshift-improved"):
            variants = {one["variant"] for one in known if one["tracker"] == tracker}
            assert variants >= {
                "stop_distance=0.5",
                "stop_distance=1",
                "max_iterations=6",
                "max_iterations=11",
                "max_iterations=15",
            }


def test_every_reading_of_the_ledger_is_run_where_everything_is():
    found = {}
    for name, one in by_name(everything=True).items():
        for text in one.trackers if name != TIMED else ():
            for column, value in labels_of(text, TABLE_TENNIS).items():
                found.setdefault(column, set()).add(value)
    for column, values in read_claims("wang2010")["WA-1"].readings.columns.items():
        assert found[column] >= set(values), column
