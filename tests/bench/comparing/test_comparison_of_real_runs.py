"""Answers of `compare` on runs of a particle filter: equal trackers, and more particles."""

import numpy as np
import pytest

from trackmark import bench, datasets
from trackmark.bench.comparing.comparison import compare
from trackmark.bench.reporting.tables import SUMMARY

pytestmark = pytest.mark.slow


def first_frames(name, n):
    """Return the first n frames of a synthetic sequence, rendered once."""
    sequence = datasets.load(name)
    images = [sequence[frame] for frame in range(n)]
    return datasets.Sequence(name, images, sequence.boxes[:n], fingerprint=f"{name} {n}")


def overlaps(tracker, sequences, seeds):
    """Return the mean overlap of every run, (n_sequences, seeds)."""
    return np.array(
        [
            [
                bench.score(bench.evaluate(tracker, sequence, seed), sequence)["mean_overlap"]
                for seed in range(seeds)
            ]
            for sequence in sequences
        ]
    )


def test_tracker_is_rarely_better_than_itself(make_runs):
    names = [f"plain/target:length=24:width=160:height=120:scene={k}" for k in range(8)]
    sequences = [first_frames(name, 24) for name in names]
    scores = overlaps("multipart:particles=25", sequences, 40)
    generator = np.random.default_rng(0)
    differing = 0
    for _ in range(200):
        seeds = generator.permutation(40)
        runs = make_runs({"a": scores[:, seeds[:5]], "b": scores[:, seeds[5:10]]}, names=names)
        (pair,) = compare(runs, SUMMARY[0]).pairs
        differing += pair.answer.label in ("better", "worse")
    assert scores.std(axis=1).min() > 0
    assert differing <= 16


def test_more_particles_are_better(make_runs):
    names = [f"multipart/1:scene={k}" for k in range(20)]
    sequences = [first_frames(name, 40) for name in names]
    few, many = (overlaps(f"multipart:particles={n}", sequences, 2) for n in (25, 200))
    (pair,) = compare(make_runs({"many": many, "few": few}, names=names), SUMMARY[0]).pairs
    assert (pair.answer.label, len(pair.by_unit)) == ("better", 20)
