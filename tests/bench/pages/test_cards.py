"""Cards of a report page as HTML: their values and links, and hostile names."""

import re
from dataclasses import replace
from math import nan

import pytest

from trackmark.bench.pages.card_types import (
    FailureCard,
    Fold,
    HeatRow,
    HeatTable,
    Leaderboard,
    LeaderRow,
    Loop,
    PairCell,
    PairMatrix,
    SequenceFold,
    Still,
)
from trackmark.bench.pages.page import card_html
from trackmark.reports.charts import Chart, Line, PlayerPosition

HOSTILE = '<script>"&\x1b'
PLACE = PlayerPosition(0, 1, 0, 7)
LINK = 'href="#0.1.0.7"'
STILL = Still(b"RIFF", (4, 3), [0, 0, 2, 1], [(1, 1, [1, 1, 2, 1])], "frame 7")
PAIR = PairCell("better", 0.181, 2, 1, "a minus b: +0.181", PLACE)
CHART = Chart("t", "overlap", "y", [Line("a", 0, [0, 1], [1, 0.25])], "w", top=1.0, figure="f")

# Card, and parts of its HTML in which * is a marker.
PARTS = [
    (
        Leaderboard(
            [
                LeaderRow(
                    1, "b", 0.8, (0.7, 0.9), "91 %", "3.1 px", "24", "42", PLACE, marked=True
                ),
                LeaderRow(0, "a", nan, None, "—", "—", "—", "—", note="2 of 2 runs failed"),
            ],
            "8 sequences",
        ),
        [
            f'<li class="marked" data-k="1"><a class="row" {LINK}><span class="who">* <span><b>b<',
            '<span class="fill c1" style="width:80.0%">',
            '<i class="interval" style="left:70.0%;width:20.0%"></i>',
            "<b>0.80</b> <small>[0.70, 0.90]</small>",
            "<i>success </i>91 %</span><span><i>error </i>3.1 px</span><span><i>ms/frame </i>24<",
            '<li data-k="0"><div class="row"><span class="who">* <span><b>a</b> <small>2 of 2 runs',
            '<span class="track"></span><span class="value"><b>—</b></span>',
        ],
    ),
    (
        [Loop("s", 0, 8, STILL, [(1, "b", 0.12)], PLACE)],
        [
            f'<a class="loop" {LINK} data-loop="0,0,8">',
            "<b>s</b><small>frame 7</small>",
            '<span title="b">* <i>b</i> <b>0.12</b></span>',
            '<svg class="still" viewBox="0 0 4 3" role="img" aria-label="frame 7"><image href="'
            'data:image/webp;base64,UklGRg==" width="4" height="3"',
            '<path class="box c1" d="M1.0,1.0h2.0v1.0h-2.0Z" stroke-dasharray="7 4"/>',
        ],
    ),
    (
        [replace(CHART, title="One"), replace(CHART, percent=True, reference=0.9, caption="c")],
        [
            '<button aria-pressed="true" data-plot="plot-0">One</button>',
            '<div id="plot-1" class="plot"><figure class="chart" id="f" data-x="overlap"',
            '<figcaption>c</figcaption><svg viewBox="0 0 440 270"',
            '<li class="at">At overlap 0.9:</li><li>* a <b data-k="0">25 %</b></li>',
        ],
    ),
    (
        HeatTable(
            [(0, "a"), (1, "b")],
            [
                HeatRow("s", b"", [0.5, 0.25], [PLACE, None]),
                HeatRow("t", b"", [nan, 1.0], [None] * 2),
            ],
            [nan, 0.625],
            1,
        ),
        [
            f'<td style="--share:0.5"><a class="win" {LINK}>0.50<span class="hidden"> highest<',
            '<td style="--share:0.25"><span class="cell">0.25</span></td></tr><tr class="extra">',
            '<td><span class="cell">—</span></td>',
            "Show all 2 sequences</button>",
        ],
    ),
    (
        PairMatrix([(0, "a"), (1, "b")], [[None, PAIR], [replace(PAIR, answer=""), None]]),
        [
            '<td class="self" aria-label="same tracker">–</td><td class="better" data-column="b">',
            f'data-tip="a minus b: +0.181" {LINK}><b>better</b> +0.18<small>2 won, 1 lost</small>',
            f"{LINK}>+0.18<small>",  # too few sequences: no answer
        ],
    ),
    (
        [FailureCard("b", "s", "lost at frame 7", STILL, PLACE)],
        [f"<li><a {LINK}><svg", "<span>* <b>b</b> on s<br><small>lost at frame 7</small></span>"],
    ),
    (
        SequenceFold("k", "s", b"", "highest: b, 0.50", [(1, "b", 0.5)], None, None, "#x", "why"),
        [
            '<details class="fold" id="k"><summary><span class="result"><b>s</b> <small>highest: b',
            '<i class="fill c1" title="b 0.50" style="height:13.0px"></i>',
            '<p class="note">why</p><p><a class="open" href="#x">Open in the player</a>',
        ],
    ),
    (
        Fold("k", "Title", "result", ["`code`"], commands=["x"]),
        [
            '<details class="fold" id="k"><summary><span class="result"><b>Title</b> <small>result',
            '<p><code>code</code></p><p class="command"><code tabindex="0">x</code><button',
        ],
    ),
]


@pytest.mark.parametrize(("card", "parts"), PARTS, ids=lambda card: type(card).__name__)
def test_card_has_its_values_and_links(card, parts):
    text = re.sub(r"(?<=>)\s{2,}(?=<)|\s*\n\s*", "", card_html(card))
    text = re.sub(r'<svg class="dot".*?</svg>', "*", text)
    for part in parts:
        assert part in text


@pytest.mark.parametrize(
    "card",
    [
        Leaderboard([LeaderRow(0, HOSTILE, 0.5, None, "", "", "", "", note=HOSTILE)], HOSTILE),
        [Loop(HOSTILE, 0, 1, replace(STILL, words=HOSTILE), [(0, HOSTILE, 0.5)], PLACE)],
        HeatTable([(0, HOSTILE)], [HeatRow(HOSTILE, b"", [0.5], [None])], [0.5], 12),
        PairMatrix([(0, HOSTILE)], [[PairCell("", 0, 0, 0, HOSTILE, PLACE)]], HOSTILE),
        [FailureCard(HOSTILE, HOSTILE, HOSTILE, STILL, PLACE)],
        SequenceFold("k", HOSTILE, b"", HOSTILE, [(0, HOSTILE, 0.5)], None, None, "#", HOSTILE),
        Fold("k", HOSTILE, HOSTILE, [HOSTILE], commands=[HOSTILE]),
        Chart(HOSTILE, HOSTILE, "y", [Line(HOSTILE, 0, [0, 1], [0, 1])], HOSTILE, figure="f"),
    ],
    ids=lambda card: type(card).__name__,
)
def test_hostile_names_are_text(card):
    text = card_html(card)
    assert "<script" not in text
    assert "\x1b" not in text
    assert "&lt;script&gt;" in text
