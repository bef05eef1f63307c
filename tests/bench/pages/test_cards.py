"""Cards of a report page as HTML: their values and links, and hostile names."""

import re
from dataclasses import replace
from math import nan
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.pages.cards import lost_runs, subset_means
from trackmark.bench.pages.content import PlayerRun, PlayerSequence
from trackmark.bench.pages.page import card
from trackmark.reports.charts import Chart, Line, PlayerPosition

HOSTILE = '<script>"&\x1b'
POSITION = PlayerPosition(0, 1, 0, 7)
LINK = 'href="#0.1.0.7"'
MEAN = {"mean": 0.8, "low": 0.7, "high": 0.9, "marked": True}
NO_MEAN = {"mean": nan, "low": nan, "high": nan, "marked": False}
ROW = {"tracker": 1, "label": "b", "overlap": MEAN, "success": 0.91, "error": 3.1, "time": "24"}
ROW |= {"fps": "42", "position": POSITION, "note": ""}
EMPTY = {"tracker": 0, "label": "a", "overlap": NO_MEAN, "success": nan, "error": nan, "time": "—"}
EMPTY |= {"fps": "—", "position": None, "note": "2 of 2 runs failed"}
FRAME = {"image": b"RIFF", "size": (4, 3), "truth": [nan] * 4, "description": "frame 7"}
FRAME |= {"boxes": [(1, 1, [1, 1, 2, 1]), (2, 2, [nan] * 4)]}
ENTRY = {"sequence": "s", "label": "b", "frame": "", "position": POSITION}
PAIR = {"tracker": 1, "label": "b", "decision": "better", "difference": 0.181, "wins": "6 of 7"}
PAIR |= {"position": POSITION, "interval": [-0.1, 0.26], "at": [0.6, 0.55, 0.65], "tip": "same"}
FEW = PAIR | {"decision": "", "interval": None, "tip": "", "position": None}
BEST_CELL = {"text": "0.812", "interval": "[0.700, 0.900]", "position": POSITION, "is_best": True}
NO_CELL = {"text": "—", "interval": "", "position": None, "is_best": False}
CHART = Chart("t", "overlap", "y", [Line("a", 0, [0, 1], [1, 0.25])], "w", top=1.0, figure="f")
SEQUENCE = PlayerSequence("s", (4, 3), np.zeros((9, 4)), [], reason="no file")

# Card, its values, and parts of its HTML in which * is a marker.
PARTS = [
    (
        "leaderboard",
        {
            "first_rows": [ROW],
            "folded": [EMPTY],
            "metrics": " (otb)",
            "n_sequences": 8,
            "notes": [],
        },
        [
            " (otb) over 8 sequences; thin line: ",
            f'<li class="marked" data-k="1"><a class="row" {LINK}><span class="who">* <span><b>b<',
            '<span class="fill c1" style="width:80.0%">',
            '<i class="interval" style="left:70.0%;width:20.0%"></i>',
            "<b>0.80</b> <small>[0.70, 0.90]</small>",
            "<i>success </i>91 %</span><span><i>error </i>3.1 px</span><span><i>ms/frame </i>24<",
            '<li data-k="0"><div class="row"><span class="who">* <span><b>a</b> <small>2 of 2 runs',
            '<span class="track"></span><span class="value"><b>—</b></span>',
            "<b>1 more trackers</b>",
        ],
    ),
    (
        "frame_image",
        FRAME,
        [
            '<svg class="still" viewBox="0 0 4 3" role="img" aria-label="frame 7"><image href="'
            'data:image/webp;base64,UklGRg==" width="4" height="3"',
            '<path class="rim" d="M1.0,1.0h2.0v1.0h-2.0Z"/>'
            '<path class="box c1 d1" d="M1.0,1.0h2.0v1.0h-2.0Z"/>',
        ],
    ),
    (
        "worst_frames",
        {"excerpts": [ENTRY | {"first": 0, "last": 8, "overlaps": [(1, "b", 0.12)]}]},
        [
            f'<a class="loop" {LINK} data-loop="0,0,8">',
            "<b>s</b><small>frame 7</small>",
            '<span title="b">* <i>b</i> <b>0.12</b></span>',
        ],
    ),
    (
        "charts",
        {
            "height": 270,
            "charts": [CHART, replace(CHART, is_percent=True, reference=0.9, caption="c")],
        },
        [
            '<button aria-pressed="true" data-plot="plot-0">t</button>',
            '<div id="plot-1" class="plot"><figure class="chart" id="f" data-x="overlap"',
            '<figcaption>c</figcaption><svg viewBox="0 0 440 270"',
            '<li class="at">At overlap 0.9:</li><li>* a <b>25 %</b></li>',
        ],
    ),
    (
        "overlap_matrix",
        {
            "trackers": [(0, "a"), (1, "b")],
            "rows": [
                {"sequence": "s", "thumbnail": b"", "overlaps": [0.5, 0.25]}
                | {"positions": [POSITION, None]},
                {"sequence": "t", "thumbnail": b"", "overlaps": [nan, 1.0]}
                | {"positions": [None, None]},
            ],
            "means": [nan, 0.625],
            "n_shown": 1,
        },
        [
            f'<td style="--share:0.5"><a class="win" {LINK}>0.50<span class="hidden"> highest<',
            '<td style="--share:0.25"><span class="cell">0.25</span></td></tr><tr class="extra">',
            '<td><span class="cell">—</span></td>',
            "Show all 2 sequences</button>",
        ],
    ),
    (
        "subset_means",
        {"trackers": [(0, "a"), (1, "b")], "scope": "for new scenes", "has_marks": True}
        | {"rows": [{"label": "noise=30", "n_sequences": 7, "cells": [BEST_CELL, NO_CELL]}]},
        [
            "; in brackets: 95 % interval for new scenes; bold: no tracker is better.",
            '<th scope="row">noise=30</th><td>7</td>',
            f'<td class="best"><a {LINK}>0.812</a><small>[0.700, 0.900]</small></td><td>—</td>',
        ],
    ),
    (
        "pair_differences",
        {"shown": [(0, "a", [PAIR])], "folded": [(1, "c", [FEW])], "n_folded": 1, "high": 0.5}
        | {"is_decided": True, "note": ""},
        [
            '<span class="who">* <span><b>a</b> minus</span></span>',
            "<i>−0.5</i><i>0</i><i>+0.5</i>",
            f'<li class="better"><a class="row" data-tip="same" {LINK}><span class="who">* <span>',
            '<i class="interval" style="left:55.0%;width:10.0%"></i><i class="point" style="left:6',
            "+0.18 <b>better</b> <small>[−0.10, +0.26]</small></span><span><i>higher on </i>6 of 7",
            "<b>1 more pairs</b>",
            '<li class="few"><div class="row"><span class="who">',  # too few sequences: no decision
        ],
    ),
    (
        "ranking",
        {
            "rows": [
                {"tracker": None, "label": "p", "mean": 0.6, "interval": [0.5, 0.7]}
                | {"position": None},
                {"tracker": 0, "label": "a", "mean": 0.5, "interval": None, "position": POSITION},
            ],
            "title": "mean overlap",
            "n_sequences": 1,
            "source": "S",
        },
        [
            "Mean overlap on 1 sequence; thin line",
            '<li><div class="row"><small>1</small><span class="who"><span>p</span>',
            f'<li class="ours"><a class="row" {LINK}><small>2</small><span class="who">* <span>a<',
            '<span class="fill c0" style="width:50.0%"></span></span><span>0.50</span>',
            "Published scores: S.",
        ],
    ),
    (
        "lost_runs",
        {"losses": [ENTRY | {"reason": "lost at frame 7"}]},
        [f"<li><a {LINK}><span>* <b>b</b> on s<br><small>lost at frame 7</small></span></a>"],
    ),
    (
        "sequence_fold",
        {"key": "k", "sequence": SEQUENCE, "summary": "b, 0.50", "means": [(1, "b", 0.5)]}
        | {"link": "#x"},
        [
            '<details class="fold" id="k"><summary><span class="result"><b>s</b> <small>b, 0.50',
            '<i class="fill c1" title="b 0.50" style="height:13px"></i>',
            '<p class="note">no file</p><p><a class="open" href="#x">Open in the player</a>',
        ],
    ),
    (
        "fold",
        {"key": "k", "title": "Title", "summary": "result", "paragraphs": ["`code`"]}
        | {"commands": ["x"]},
        [
            '<details class="fold" id="k"><summary><span class="result"><b>Title</b> <small>result',
            '<p><code>code</code></p><p class="command"><code tabindex="0">x</code><button',
        ],
    ),
]


@pytest.mark.parametrize(("name", "values", "parts"), PARTS, ids=[name for name, *_ in PARTS])
def test_card_has_its_values_and_links(name, values, parts):
    text = re.sub(r"(?<=>)\s{2,}(?=<)|\s*\n\s*", "", card(name, **values))
    text = re.sub(r'<b class="dot.*?</b>', "*", text)
    for part in parts:
        assert part in text


def lost_run(tracker, mean_overlap):
    return PlayerRun(
        tracker=tracker, repetition=0, boxes=np.ones((9, 4)), revised=None, failure="",
        is_ellipse=False, shapes={}, maps={}, overlaps=np.zeros(9, np.float32), shares={},
        worst={("overlap", "online"): (-mean_overlap, 3), ("loss", "online"): (-3.0, 3)},
    )  # fmt: skip


def test_subset_marks_the_trackers_that_none_is_better_than():
    def cells(overlaps):
        """Return mean, interval and mark of each tracker on the six scenes with noise."""
        names = [f"s:scene={n}:noise=30" for n in range(6)] + ["s:scene=6"]
        rows = [(name, t, overlaps[t][n % 6]) for t in overlaps for n, name in enumerate(names)]
        scored = pd.DataFrame(rows, columns=["sequence", "tracker", "mean_overlap"])
        sequences = [SimpleNamespace(name=name) for name in names]
        runs = SimpleNamespace(trackers=[*overlaps], sequences=sequences)
        runs.worst_position_on = lambda *_: None
        text = subset_means(scored, {}, runs)
        row = text[text.index(">noise=30<") :]
        return re.findall(r"<td( class=.best.)?>(—|\d\.\d+)(?:<small>(.*?)</small>)?", row)[:3]

    high, near, low = (np.arange(6) / 100 + start for start in (0.8, 0.79, 0.1))
    decided = cells({"a": high, "b": near[::-1], "c": low})
    assert [bool(mark) for mark, *_ in decided] == [True, True, False]
    assert [mean for _, mean, _ in decided] == ["0.825", "0.815", "0.125"]
    assert all(re.fullmatch(r"\[0\.\d{3}, 0\.\d{3}\]", interval) for *_, interval in decided)
    undecided = cells({"a": high, "b": near[::-1], "c": np.full(6, nan)})
    assert [bool(mark) for mark, *_ in undecided] == [False] * 3
    assert undecided[2] == ("", "—", "")


def test_lost_runs_show_each_tracker_first():
    overlaps = {"s": [0.01, 0.02, 0.5, 0.3], "t": [0.03, 0.04, 0.4, 0.6]}  # by tracker
    sequences = [
        PlayerSequence(
            name, (4, 3), np.ones((9, 4)), [lost_run(*pair) for pair in enumerate(means)]
        )
        for name, means in overlaps.items()
    ]
    title, text = lost_runs(SimpleNamespace(sequences=sequences, labels=[*"abcd"]))
    assert title == "Lost and failed runs: of 8 runs, 8 lost the target"
    pairs = re.findall(r"<b>(\w)</b> on (\w)", text)
    assert pairs == [("a", "s"), ("b", "t"), ("d", "s"), ("c", "t"), ("b", "s"), ("a", "t")]


def hostile(value):
    """Return the values of a card with a hostile text in place of each text that is printed."""
    if isinstance(value, dict):
        return {key: entry if key == "key" else hostile(entry) for key, entry in value.items()}
    if isinstance(value, Chart):
        line = replace(value.lines[0], label=HOSTILE)
        return replace(value, title=HOSTILE, x=HOSTILE, description=HOSTILE, lines=[line])
    if isinstance(value, PlayerSequence):
        return replace(value, name=HOSTILE, reason=HOSTILE)
    if isinstance(value, list):
        return [*map(hostile, value)]
    if type(value) is tuple:
        return tuple(map(hostile, value))
    return HOSTILE if isinstance(value, str) else value


@pytest.mark.parametrize(("name", "values"), [entry[:2] for entry in PARTS])
def test_hostile_names_are_text(name, values):
    text = card(name, **hostile(values))
    assert "<script" not in text
    assert "\x1b" not in text
    assert "&lt;script&gt;" in text
