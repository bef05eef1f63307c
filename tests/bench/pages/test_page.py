"""Data for the player of a page against plain definitions."""

import re
import zlib
from base64 import b64decode
from pathlib import Path

import cv2
import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.reports.contrast import contrast, rgb
from trackmark.bench.pages import page as pages
from trackmark.bench.pages.content import Page, PageSection, PageTable, PlayerSequence, player_link
from trackmark.bench.pages.page import card, write_page
from trackmark.bench.pages.player_frames import ABSENT, encode_images, pack_boxes, quantise
from trackmark.reports.charts import Chart, Line
from trackmark.reports.tables import Cell, Table

BOXES = arrays(
    np.float64,
    st.tuples(st.integers(1, 3), st.integers(1, 9), st.just(4)),
    elements=st.one_of(st.floats(-1e7, 1e7), st.just(np.nan), st.floats(allow_nan=True)),
)


def unpacked(text, rows):
    """Decode boxes as the player does, number by number."""
    content = zlib.decompress(b64decode(text))
    n = len(content) // 4
    steps = [sum(content[k * n + i] << 8 * k for k in range(4)) for i in range(n)]
    values = []
    for i, step in enumerate(steps):
        before = 0 if i % (n // rows) < 4 else values[i - 4]
        values.append((before + step) % 2**32)
    return [value - 2**32 if value >= 2**31 else value for value in values]


@settings(deadline=None)
@given(BOXES)
@example(np.full((1, 1, 4), np.finfo(float).max))
def test_boxes_come_back_to_a_fiftieth_of_a_pixel(boxes):
    whole = np.stack([quantise(row) for row in boxes])
    assert unpacked(pack_boxes(whole), len(boxes)) == whole.ravel().tolist()
    finite = np.isfinite(boxes).all(axis=2)
    assert (whole[~finite] == ABSENT).all()
    assert (whole[finite] != ABSENT).all()
    near = finite & (np.abs(boxes) < 1e7).all(axis=2)
    np.testing.assert_allclose(whole[near] / 50, boxes[near], atol=0.0101)


def test_page_can_contain_texts_only(tmp_path):
    (path,) = write_page(
        tmp_path / "a.html", Page("T", [PageSection("a", "A", lists_sequences=True, caption="<b>")])
    )
    text = path.read_text()
    assert "&lt;b&gt;" in text
    assert 'id="player"' not in text.partition("</style>")[2].partition("<script")[0]


def test_gaps_and_infinities_are_left_out(tmp_path):
    chart = Chart("c", "x", "y", [Line("l", 0, [0, 1], [np.nan, np.inf])], "words")
    table = Table("t", "", ["", "n"], 1, [[Cell("a"), Cell("—")]])
    sheet = PageTable(table, [[None]])
    cards = [card("page_table", sheet=sheet), card("chart", chart=chart)]
    (path,) = write_page(tmp_path / "a.html", Page("T", [PageSection("a", "A", cards)]))
    text = path.read_text()
    assert 'class="curve' not in text


def decoded(frame):
    return cv2.imdecode(np.frombuffer(frame, np.uint8), cv2.IMREAD_COLOR)


def test_frames_stand_in_chunks_in_order_and_are_not_enlarged():
    images = [np.full((40, 60, 3), shade, np.uint8) for shade in range(0, 250, 5)]
    frames = [frame for chunk in encode_images(iter(images), height=160) for frame in chunk]
    assert [decoded(frame).shape for frame in frames] == [(40, 60, 3)] * 50
    assert all(
        abs(decoded(frame).mean() - shade) < 2
        for frame, shade in zip(frames, range(0, 250, 5), strict=True)
    )
    assert [decoded(frame).shape for (frame,) in encode_images(images[:1], height=20)] == [
        (20, 30, 3)
    ]


def test_address_contains_names_unchanged():
    sequence = PlayerSequence("a&b=ц#", (4, 3), np.zeros((9, 4)), [])
    address = player_link(sequence, 7, tracker="x y")
    assert address == "#sequence=a%26b%3D%D1%86%23&frame=7&tracker=x+y"


def test_words_stand_out_from_their_ground_in_light_and_dark():
    style = (Path(pages.__file__).parent / "templates" / "page.css").read_text()
    light, dark, *_ = re.findall(r":root \{(.*?)\n *\}", style, re.DOTALL)
    for theme in (light, dark):
        named = dict(re.findall(r"--([\w-]+): (#\w+)", theme))
        assert {"paper", "panel", "ink", "faint", "accent", "shade"} <= named.keys()
        colours = {
            name: np.array(rgb(code if len(code) == 7 else "".join(2 * sign for sign in code[1:])))
            for name, code in named.items()
        }
        for words in colours.keys() & {"ink", "faint", "accent", "bad", "good"}:
            for ground in ("page", "paper", "panel"):
                assert contrast(colours[words], colours[ground]) >= 4.5, (words, ground)
        for name in ("good", "bad", "open"):
            assert contrast(colours[name], colours[f"{name}-ground"]) >= 4.5
        most = int(re.search(r"--share, 0\) \* (\d+)%\), var\(--paper", style)[1]) / 100
        darkest = most * colours["shade"] + (1 - most) * colours["paper"]  # of the heat map
        assert contrast(colours["ink"], darkest) >= 4.5
