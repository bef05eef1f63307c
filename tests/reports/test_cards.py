"""Cards of a report page as HTML: one golden text each, and hostile names."""

import re
from dataclasses import replace
from math import nan

import pytest

from trackmark.reports.page.cards import (
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
from trackmark.reports.page.content import Chart, Line, PlayerPosition
from trackmark.reports.page.page import card_html

HOSTILE = '<script>"&\x1b'
PLACE = PlayerPosition(0, 1, 0, 7)
LINK = 'href="#0.1.0.7"'
STILL = Still(b"RIFF", (4, 3), [0, 0, 2, 1], [(1, 1, [1, 1, 2, 1])], "frame 7")


def html(card):
    """Return a card without white space between elements, markers and tooltips."""
    text = re.sub(r"(?<=>)\s{2,}(?=<)|\s*\n\s*", "", card_html(card))
    text = re.sub(r'<svg class="dot".*?</svg>', "*", text)
    text = re.sub(r'<svg class="still".*?</svg>', "IMAGE", text)
    return re.sub(r'<button class="term".*?>(.*?)</button>', r"\1", text)


def test_leaderboard():
    rows = [
        LeaderRow(1, "b", 0.8, (0.7, 0.9), "91 %", "3.1 px", "24 ms", PLACE, marked=True),
        LeaderRow(0, "a", nan, None, "—", "—", "—", note="2 of 2 runs failed"),
    ]
    text = html(Leaderboard(rows, "8 sequences"))
    assert (
        f'<li class="marked" data-k="1"><a class="row" {LINK}><span class="who">* '
        '<span><b>b</b></span></span><span class="track"><span class="fill c1" style="width:80.0%">'
        '</span><i class="interval" style="left:70.0%;width:20.0%"></i></span><span class="value">'
        "<b>0.80</b> <small>[0.70, 0.90]</small></span><span><i>success </i>91 %</span><span><i>"
        "error </i>3.1 px</span><span><i>time </i>24 ms</span></a></li>"
    ) in text
    assert (
        '<li data-k="0"><div class="row"><span class="who">* <span><b>a</b> <small>'
        '2 of 2 runs failed</small></span></span><span class="track"></span><span class="value">'
        "<b>—</b></span>"
    ) in text
    assert "thin line: 95 % interval" in text
    assert "interval" not in html(Leaderboard([replace(rows[0], interval=None)], "3 sequences"))


def test_loops():
    loop = Loop("s", 0, 8, STILL, [(1, "b", 0.12)], PLACE)
    assert html([loop]).endswith(
        f'<a class="loop" {LINK} data-loop="0,0,8"><span class="screen">IMAGE</span><span '
        'class="headrow"><b>s</b><small>frame 7</small></span><span class="chips"><span title="b">'
        "* <i>b</i> <b>0.12</b></span></span></a></div>"
    )
    still = re.sub(r"\s*\n\s*", "", card_html([loop]))
    assert (
        '<svg class="still" viewBox="0 0 4 3" role="img" aria-label="frame 7"><image href="data:'
        'image/webp;base64,UklGRg==" width="4" height="3" preserveAspectRatio="none"/><path '
        'class="rim" d="M1.0,1.0h2.0v1.0h-2.0Z"/><path class="box c1" d="M1.0,1.0h2.0v1.0h-2.0Z" '
        'stroke-dasharray="7 4"/>'
    ) in still


def test_charts_with_a_switch():
    chart = Chart("t", "overlap", "y", [Line("a", 0, [0, 1], [1, 0.25])], "w", top=1.0, figure="f")
    chart = replace(chart, percent=True, reference=0.9, caption="c")
    text = html([replace(chart, title="One"), chart])
    assert '<button aria-pressed="true" data-plot="plot-0">One</button>' in text
    assert '<div id="plot-1" class="plot"><figure class="chart" id="f" data-x="overlap"' in text
    assert '<figcaption>c</figcaption><svg viewBox="0 0 440 270"' in text
    assert '<li class="at">At overlap 0.9:</li><li>* a <b data-k="0">25 %</b></li>' in text


def test_heat_table():
    rows = [
        HeatRow("s", b"", [0.5, 0.25], [PLACE, None]),
        HeatRow("t", b"", [nan, 1.0], [None] * 2),
    ]
    text = html(HeatTable([(0, "a"), (1, "b")], rows, [nan, 0.625], 1))
    assert (
        '<tr><th scope="row"><span>s</span></th><td style="--share:0.5"><a '
        f'class="win" {LINK}>0.50<span class="hidden"> highest</span></a></td><td'
        ' style="--share:0.25"><span class="cell">0.25</span></td></tr><tr class="extra">'
    ) in text
    assert '<td><span class="cell">—</span></td>' in text
    assert text.endswith("Show all 2 sequences</button></p>")


def test_pair_matrix():
    cell = PairCell("better", 0.181, 2, 1, "a minus b: +0.181", PLACE)
    text = html(PairMatrix([(0, "a"), (1, "b")], [[None, cell], [replace(cell, answer=""), None]]))
    assert (
        '<td class="self" aria-label="same tracker">–</td><td class="better" data-column="b">'
        f'<a class="cell" data-tip="a minus b: +0.181" {LINK}><b>better</b> '
        "+0.18<small>2 won, 1 lost</small></a></td>"
    ) in text
    assert f"{LINK}>+0.18<small>" in text  # too few sequences: no answer
    assert "limit" not in text


def test_failures():
    card = FailureCard("b", "s", "lost at frame 7", STILL, PLACE)
    assert html([card]) == (
        f'<ul class="failures"><li><a {LINK}>IMAGE<span>* <b>b</b> on s<br><small>lost at frame 7'
        "</small></span></a></li></ul>"
    )


def test_sequence_fold():
    fold = SequenceFold("k", "s", b"", "highest: b, 0.50", [(1, "b", 0.5)], None, None, "#x", "why")
    assert html(fold) == (
        '<details class="fold" id="k"><summary><span class="result"><b>s</b> <small>highest: b, '
        '0.50</small></span><span class="bars" aria-hidden="true"><i class="fill c1" title="b 0.50"'
        ' style="height:13.0px"></i></span></summary><div><p class="note">why</p><p>'
        '<a class="open" href="#x">Open in the player</a></p></div></details>'
    )


def test_fold():
    assert html(Fold("k", "Title", "result", ["`code`"], commands=["x"])) == (
        '<details class="fold" id="k"><summary><span class="result"><b>Title</b> <small>result'
        '</small></span></summary><div><p><code>code</code></p><p class="command"><code tabindex='
        '"0">x</code><button class="copy">Copy</button></p></div></details>'
    )


@pytest.mark.parametrize(
    "card",
    [
        Leaderboard([LeaderRow(0, HOSTILE, 0.5, None, "", "", "", note=HOSTILE)], HOSTILE),
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
