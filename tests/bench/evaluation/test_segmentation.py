"""Masks of trackers: compared with ground truth, stored, scored and shown in tables."""

from dataclasses import replace

import numpy as np
import pytest

import trackmark as tm
from trackmark import datasets
from trackmark.bench.analysis.run_tables import tables
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.metrics.regions import contour_accuracy, region_similarity
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.trackers import Estimate

SHAPE = (24, 32)
NAMES = (
    "mean_region_similarity",
    "region_recall",
    "region_decay",
    "mean_contour_accuracy",
    "contour_recall",
    "contour_decay",
)


def square(x, side=8):
    mask = np.zeros(SHAPE, bool)
    mask[6 : 6 + side, x : x + side] = True
    return mask


class TrueMasks:
    """Ground-truth masks of a static square, with a list of the requested frames."""

    def __init__(self, unknown=(), empty=()):
        self.unknown, self.empty, self.requested = unknown, empty, []

    def __call__(self, frame):
        self.requested.append(frame)
        if frame in self.unknown:
            return None
        return square(4, 0 if frame in self.empty else 8)


def segmenting(mask_of_call):
    """Return a tracker class whose mask in call number i, from 1, is `mask_of_call(i)`."""

    class Segmenting:
        def __init__(self, seed):
            self.calls = 0

        def init(self, image, box, mask=None):
            self.box = box

        def update(self, image):
            self.calls += 1
            return Estimate(self.box, mask=mask_of_call(self.calls))

    return Segmenting


@pytest.fixture
def make(make_sequence):
    """Return a function that makes a sequence with masks and its `TrueMasks`."""

    def with_masks(n=6, absent=(), unknown=(), empty=()):
        masks = TrueMasks(unknown, empty)
        return make_sequence(n, absent, masks=masks), masks

    return with_masks


def test_frames_after_the_first_are_compared(make):
    sequence, _ = make(n=7, absent=(0,))
    segmentation = evaluate_run(segmenting(lambda call: square(3 + call)), sequence).segmentation
    expected = [region_similarity(square(3 + call), square(4)) for call in range(1, 6)]
    assert np.isnan(segmentation.region_similarity[:2]).all()
    assert segmentation.region_similarity[2:].tolist() == expected
    accuracy = [contour_accuracy(square(3 + call), square(4)) for call in range(1, 6)]
    assert np.isnan(segmentation.contour_accuracy[:2]).all()
    assert segmentation.contour_accuracy[2:].tolist() == accuracy
    assert len(set(expected)) == 5
    assert expected[0] == accuracy[0] == 1.0


def test_true_mask_is_read_once_and_only_if_needed(make):
    sequence, masks = make(n=4)
    evaluate_run("static", sequence)
    assert masks.requested == [0]
    masks.requested.clear()
    entries = [(parse_tracker("static"), 0)]
    entries += [(parse_tracker(segmenting(lambda call: square(4))), r) for r in range(3)]
    runs = run_protocol(entries, sequence).runs
    assert masks.requested == [0, 1, 2, 3]
    assert [run.segmentation is None for run in runs] == [True, False, False, False]


def test_empty_or_missing_mask_has_lost_the_target(make):
    masks = {1: None, 2: square(4), 3: square(4, 0), 4: None, 5: square(4)}
    sequence, _ = make()
    run = evaluate_run(segmenting(masks.get), sequence)
    for values in vars(run.segmentation).values():
        np.testing.assert_array_equal(values, [np.nan, np.nan, 1, 0, 0, 1])
    assert tm.score(run, sequence)["mean_region_similarity"] == 0.5


def test_frame_without_true_mask_is_not_compared(make, make_sequence):
    maker = segmenting(lambda call: square(4))
    segmentation = evaluate_run(maker, make(unknown=(2, 4))[0]).segmentation
    np.testing.assert_array_equal(np.isnan(segmentation.region_similarity), [1, 0, 1, 0, 1, 0])
    sequence = make_sequence()
    run = evaluate_run(maker, sequence)
    assert run.segmentation is None
    assert not set(NAMES) & tm.score(run, sequence).keys()


def test_empty_mask_is_right_if_the_target_is_absent(make):
    sequence, _ = make(empty=(2, 3), absent=(2, 3))
    run = evaluate_run(segmenting(lambda call: square(4, 8 * (call != 2))), sequence)
    np.testing.assert_array_equal(run.segmentation.region_similarity, [np.nan, 1, 1, 0, 1, 1])


def test_masks_are_never_compared_in_timing_runs(make):
    sequence, masks = make(n=16)
    entries = [(parse_tracker(segmenting(lambda call: square(4))), 0)]
    (run,) = run_protocol(entries, sequence, TIMING).runs
    assert run.failure == ""
    assert run.segmentation is None
    assert set(masks.requested) == {0}


def test_segmentation_is_stored_with_the_run(make, tmp_path):
    run = evaluate_run(segmenting(lambda call: square(3 + call)), make()[0])
    for name, stored in (("with", run), ("without", replace(run, segmentation=None))):
        results = RunStore(tmp_path / name)
        assert results.add(stored)
        back = results.read(run_key(run.identity)).segmentation
        if stored.segmentation is None:
            assert back is None
        else:
            for column, values in vars(run.segmentation).items():
                np.testing.assert_array_equal(vars(back)[column], values)


SEGMENTER = '''
"""Says that the target is where it began, box and pixels."""
from trackmark.trackers.base.interface import Estimate, TrackerPlugin


class Segmenter(TrackerPlugin):
    """Segments."""

    def init(self, image, box, mask=None):
        self.box, self.mask = box, mask

    def update(self, image):
        return Estimate(self.box, mask=self.mask)
'''
SEQUENCES = [f"plain/target:length=12:scene={scene}" for scene in (0, 1)]


@pytest.fixture(scope="module")
def stored(tmp_path_factory, run_trial):
    """Return results of a tracker with masks and a tracker without."""
    folder = tmp_path_factory.mktemp("segmentation")
    (folder / "segmenter.py").write_text(SEGMENTER)
    return run_trial(folder, ("static", f"{folder}/segmenter.py:Segmenter"), SEQUENCES)


def test_stored_scores_equal_scores_of_the_masks(stored):
    runs = Runs.open(stored).table.set_index("tracker_name")
    assert runs.loc["static", list(NAMES)].isna().all(axis=None)
    segmented = runs.drop(index="static")
    assert len(segmented) == 2
    for row in segmented.itertuples():
        sequence = datasets.load(row.sequence)
        masks = [sequence.mask(frame) for frame in range(12)]
        similarity = np.array([region_similarity(masks[0], mask) for mask in masks[1:]])
        accuracy = np.array([contour_accuracy(masks[0], mask) for mask in masks[1:]])
        assert row.mean_region_similarity == pytest.approx(similarity.mean())
        assert row.region_recall == pytest.approx((similarity > 0.5).mean())
        assert row.mean_contour_accuracy == pytest.approx(accuracy.mean())
        assert row.contour_recall == pytest.approx((accuracy > 0.5).mean())


def test_tables_have_columns_of_masks(stored):
    tables_by_name = {table.name: table for table in tables(Runs.open(stored))}
    assert list(tables_by_name) == ["summary", "sequences", "segmentation"]
    assert "DAVIS" in tables_by_name["segmentation"].caption
    scores = Runs.open(stored).table.set_index("tracker_name").drop(index="static")
    for column, name in (
        ("region similarity J", "mean_region_similarity"),
        ("contour accuracy F", "mean_contour_accuracy"),
    ):
        values = [scores[name].mean(), *scores[name]]
        texts = []
        for table in (tables_by_name["summary"], tables_by_name["sequences"]):
            texts += [row[table.headings.index(column)].text for row in table.rows]
        assert texts == [text for value in values for text in ("—", f"{value:.3f}")]
    _, last = tables_by_name["segmentation"].rows  # only the tracker with masks has a row
    assert last[2].text == f"{scores['mean_region_similarity'].iloc[1]:.3f}"
    assert last[-1].text == f"{scores['contour_decay'].iloc[1]:.3f}"
