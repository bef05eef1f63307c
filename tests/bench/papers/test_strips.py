"""Film strips: cut-outs around the target, outlines and compression."""

import io

import numpy as np
import pytest
from PIL import Image

from trackmark.bench.papers import strips
from trackmark.bench.papers.strips import Note, Strip, StripRow, draw_picture, to_webp
from trackmark.reports.palette import LIGHT, to_bgr

SIZE = 120, 160  # height and width of a frame [px]


def strip(truth, estimates, shape="box", notes=()):
    images = [np.full((*SIZE, 3), 60, np.uint8) for _ in truth]
    outlines = [{"recommended": np.array(box, float)} for box in estimates]
    row = StripRow("tracker", images, outlines, notes)
    labels = [f"frame {number}" for number in range(len(truth))]
    return Strip("scene", labels, [np.array(box, float) for box in truth], [row], shape)


def test_cut_outs_are_equally_large_and_around_the_target():
    boxes = [[60, 50, 28, 20], [0, 0, 30, 30], [140, 100, 20, 20]]
    windows = strip(boxes, boxes).windows
    # The widest target has 30 * 160 / 120 = 40 px at the shape of the frame; three times that.
    assert windows == [(14, 15, 120, 90), (0, 0, 120, 90), (40, 30, 120, 90)]
    (small,) = strip([[80, 60, 4, 4]], [[80, 60, 4, 4]]).windows
    assert small == (46, 35, 72, 54)
    first, absent = strip([[60, 50, 20, 20], [np.nan] * 4], boxes).windows
    assert absent == first
    parts = [[40, 40], [50, 40], [50, 50], [np.nan, np.nan], [60, 60], [70, 60], [70, 70]]
    (contour,) = strip([parts], [parts], "contour").windows
    assert contour == (0, 10, 120, 90)  # three times 30 px at the shape of the frame


def test_estimate_is_drawn_where_it_is_in_the_frame():
    one_frame = strip([[60, 40, 40, 40]], [[60, 40, 40, 40]])
    x, _, width, _ = one_frame.windows[0]
    tile = one_frame.tile(one_frame.rows[0], 0)
    blue = np.abs(tile.astype(int) - to_bgr(LIGHT[0])).sum(axis=2) < 60
    columns = np.flatnonzero(blue.any(axis=0)) * width / tile.shape[1] + x
    assert columns.min() == pytest.approx(60, abs=1.5)
    assert columns.max() == pytest.approx(100, abs=1.5)


def test_dot_at_the_edge_marks_an_estimate_outside():
    one_frame = strip([[10, 10, 20, 20]], [[130, 15, 20, 20]])
    tile = one_frame.tile(one_frame.rows[0], 0)
    blue = (tile == to_bgr(LIGHT[0])).all(axis=2)
    rows, columns = np.nonzero(blue)
    assert columns.min() > tile.shape[1] - 20
    assert rows.mean() == pytest.approx(25 * tile.shape[1] / one_frame.windows[0][2], abs=1)


def test_picture_has_a_tile_per_frame_and_the_state_in_the_paper():
    boxes = [[60, 40, 40, 40]] * 3
    notes = [[Note("paper", "lost")], [], []]
    plain, noted = (draw_picture(strip(boxes, boxes, notes=text)) for text in ((), notes))
    tile, gap = strips.TILE_WIDTH, strips.GAP
    assert plain.size == (3 * tile + 2 * gap, 30 + tile * 3 // 4)
    differs = np.asarray(plain) != np.asarray(noted)
    assert differs[:, :tile].any()
    assert not differs[:, tile:].any()


def test_large_picture_gets_a_lower_quality(monkeypatch):
    noise = np.random.default_rng(0).integers(0, 255, (200, 300, 3), dtype=np.uint8)
    picture = Image.fromarray(noise)
    best = to_webp(picture)
    monkeypatch.setattr(strips, "MAX_BYTES", len(best) - 1)
    smaller = to_webp(picture)
    assert len(smaller) < len(best)
    assert Image.open(io.BytesIO(smaller)).size == (300, 200)
