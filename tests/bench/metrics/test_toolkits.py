"""Our presets against recorded scores of vot-toolkit, to 1e-9.

`tests/bench/exchange/test_toolkit_files.py` compares scores of other protocols.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.bench.metrics import toolkits
from trackmark.bench import metrics
from trackmark.bench.metrics.interface import GroundTruthArrays, RunEstimates
from trackmark.bench.metrics.region_overlap import raster_overlap

SEQUENCES = range(3)
HERE = Path(toolkits.__file__).parent
SAME = 1e-9


def recorded(name):
    return json.loads((HERE / "recorded_vot.json").read_text())[name]


def close(value):
    return pytest.approx(value, abs=SAME, rel=0)


def test_vot_anchor_equals_scores_of_vot_toolkit():
    expected = recorded("anchors")
    preset = metrics.find_metrics("vot-anchor")
    runs = []
    for i in SEQUENCES:
        truth, boxes = toolkits.truth(i), toolkits.estimate(i)
        runs.append(
            [
                preset.score(
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


@pytest.mark.parametrize("kind", ["boxes", "polygons", "convex"])
def test_raster_overlap_equals_overlap_of_vot_toolkit(kind):
    boxes, others, *shapes = toolkits.pairs()
    outlines = {"boxes": None, "polygons": shapes[0], "convex": shapes[1]}[kind]
    theirs, cut = (np.array(recorded(kind + suffix)) for suffix in ("", " cut"))
    size = toolkits.SMALL
    np.testing.assert_allclose(raster_overlap(boxes, others, size, outlines), cut, atol=SAME)
    # Without clipping, the toolkit omits parts of boxes that are left of or above the image.
    corners = [others[:, :2], boxes[:, :2] if outlines is None else outlines.min(axis=1)]
    inside = (np.minimum(*corners) >= 0).all(axis=1)
    ours = raster_overlap(boxes, others, None, outlines)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=SAME)
    assert not np.allclose(ours, theirs, atol=1e-2)
