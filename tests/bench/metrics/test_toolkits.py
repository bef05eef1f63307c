"""Our presets against recorded scores of toolkits, to 1e-9."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.bench.metrics import toolkits
from trackmark.bench import metrics
from trackmark.bench.metrics.preset import GroundTruthArrays, RunEstimates
from trackmark.bench.metrics.region_overlap import exact_overlap, raster_overlap

SEQUENCES = range(3)
HERE = Path(toolkits.__file__).parent
SAME = 1e-9


def recorded(toolkit):
    return json.loads((HERE / f"recorded_{toolkit}.json").read_text())


def close(value):
    return pytest.approx(value, abs=SAME, rel=0)


def target(i, absent=True, visibility=np.nan):
    return GroundTruthArrays(
        toolkits.truth(i, absent), image_size=toolkits.SIZE, visibility=visibility
    )


def judged(name, answer, runs=(0,), **suffix):
    """Compute the scores of runs on every sequence."""
    preset = metrics.preset(name)
    return [[preset.judge(target(i, **suffix), answer(i, run)) for run in runs] for i in SEQUENCES]


def test_otb_equals_scores_of_got10k():
    expected = recorded("got10k")["otb"]
    runs = judged("otb", lambda i, run: RunEstimates(toolkits.estimate(i, run)), absent=False)
    for i in SEQUENCES:
        (run,), theirs = runs[i], expected["seq_wise"][str(i)]
        assert run.scores["success_auc"] == close(theirs["success_score"])
        assert run.scores["precision"] == close(theirs["precision_score"])
        assert run.scores["success_rate"] == close(theirs["success_rate"])
        np.testing.assert_allclose(run.curves["success"][:, 1], theirs["success_curve"], atol=SAME)
    overall, theirs = metrics.preset("otb").overall(runs), expected["overall"]
    assert overall.scores["success_auc"] == close(theirs["success_score"])
    np.testing.assert_allclose(
        overall.curves["precision"][:, 1], theirs["precision_curve"], atol=SAME
    )


def test_got10k_equals_scores_of_got10k():
    expected = recorded("got10k")["got10k"]
    preset = metrics.preset("got10k")
    runs = [
        [
            preset.judge(
                target(i, absent=False, visibility=toolkits.cover(i) / 8),
                RunEstimates(toolkits.estimate(i, run)),
            )
            for run in (0, 1)
        ]
        for i in SEQUENCES
    ]
    for i in SEQUENCES:
        theirs = expected["seq_wise"][str(i)]
        ours = preset.overall([runs[i]]).scores
        assert (ours["ao"], ours["sr50"]) == (close(theirs["ao"]), close(theirs["sr"]))
    overall, theirs = preset.overall(runs), expected["overall"]
    assert overall.scores["ao"] == close(theirs["ao"])
    assert overall.scores["sr75"] == close(theirs["succ_curve"][75])
    np.testing.assert_allclose(overall.curves["success"][:, 1], theirs["succ_curve"], atol=SAME)


def test_vot_supervised_equals_scores_of_vot_toolkit():
    expected = recorded("vot")["supervised"]
    runs = judged(
        "vot-supervised",
        lambda i, run: RunEstimates(toolkits.estimate(i, run), states=toolkits.states(i, run)),
        runs=(0, 1),
    )
    preset = metrics.preset("vot-supervised")
    for i in SEQUENCES:
        ours = preset.overall([runs[i]]).scores
        theirs = dict(
            zip(("accuracy", "failures", "robustness"), expected["sequences"][i], strict=True)
        )
        assert {key: ours[key] for key in theirs} == {key: close(theirs[key]) for key in theirs}
    overall = preset.overall(runs)
    for key in "accuracy", "failures", "robustness":
        assert overall.scores[key] == close(expected[key])
    # The toolkit adds up in single precision.
    np.testing.assert_allclose(overall.curves["eao"][:, 1], expected["curve"], atol=1e-6)
    assert overall.scores["eao"] == pytest.approx(np.mean(expected["curve"][100:357]), abs=1e-6)
    assert overall.scores["eao_lengths"] == max(toolkits.LENGTHS) - 100


def test_vot_anchor_equals_scores_of_vot_toolkit():
    expected = recorded("vot")["anchors"]
    preset = metrics.preset("vot-anchor")
    runs = []
    for i in SEQUENCES:
        truth, boxes = toolkits.truth(i), toolkits.estimate(i)
        runs.append(
            [
                preset.judge(
                    GroundTruthArrays(
                        toolkits.from_anchor(truth, anchor), image_size=toolkits.SIZE
                    ),
                    RunEstimates(toolkits.from_anchor(boxes, anchor), n_sequence_frames=len(truth)),
                )
                for anchor in toolkits.ANCHORS[i]
            ]
        )
        ours = preset.overall([runs[i]]).scores
        assert [ours["accuracy"], ours["robustness"]] == [
            close(v) for v in expected["sequences"][i]
        ]
    overall = preset.overall(runs)
    for key in "accuracy", "robustness":
        assert overall.scores[key] == close(expected[key])
    lengths, ours = overall.curves["eao"].T
    np.testing.assert_allclose(ours, np.array(expected["curve"])[lengths.astype(int)], atol=SAME)


def test_long_term_equals_scores_of_vot_toolkit():
    expected = recorded("vot")["longterm"]
    runs = judged(
        "long-term",
        lambda i, run: RunEstimates(toolkits.estimate(i), confidence=toolkits.confidence(i)),
    )
    overall = metrics.preset("long-term").overall(runs)
    for key in "precision", "recall", "f":
        assert overall.scores[key] == close(expected[key])
    np.testing.assert_allclose(overall.curves["precision_recall"], expected["curve"], atol=SAME)


@pytest.mark.parametrize("kind", ["boxes", "polygons", "convex"])
def test_raster_overlap_equals_overlap_of_vot_toolkit(kind):
    boxes, others, *shapes = toolkits.pairs()
    outlines = {"boxes": None, "polygons": shapes[0], "convex": shapes[1]}[kind]
    theirs, cut = (np.array(recorded("vot")[kind + suffix]) for suffix in ("", " cut"))
    size = toolkits.SMALL
    np.testing.assert_allclose(raster_overlap(boxes, others, size, outlines), cut, atol=SAME)
    # Where nothing is cut off the toolkit loses what boxes have left of or above the image.
    corners = [others[:, :2], boxes[:, :2] if outlines is None else outlines.min(axis=1)]
    inside = (np.minimum(*corners) >= 0).all(axis=1)
    ours = raster_overlap(boxes, others, None, outlines)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=SAME)
    assert not np.allclose(ours, theirs, atol=1e-2)
    assert not np.allclose(ours, exact_overlap(boxes, others, None, outlines), atol=1e-3)
