"""SVG charts: points, labels, crowded charts and hostile names."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from trackmark.reports.charts import Chart, Line, PlayerPosition
from trackmark.reports.svg import TOP, chart_svg

THRESHOLDS = np.linspace(0, 1, 51)
SVG = "{http://www.w3.org/2000/svg}"


def parsed(chart, **size):
    text = str(chart_svg(chart, **size))
    assert "nan" not in text
    return ElementTree.fromstring(text.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" '))


def elements(svg, name):
    return [node for node in svg.iter() if node.get("class", "").split()[:1] == [name]]


def texts(svg):
    return [node.text for node in svg.iter(f"{SVG}text")]


def test_golden_chart():
    chart = Chart("", "x", "y", [Line("a", 0, [0, 1], [0, 0.5])], "w", top=1.0)
    assert chart_svg(chart, 148, 156) == (
        '<svg viewBox="0 0 156 148" role="img" aria-label="w" data-scale="42 142 0 1 110 10 0 1" '
        'text-anchor="middle">'
        '<path class="grid" d="M42,110H142M42,90H142M42,70H142M42,50H142M42,30H142M42,10H142"/>'
        '<text x="36" y="114" text-anchor="end">0</text><text x="36" y="94" text-anchor="end">0.2'
        '</text><text x="36" y="74" text-anchor="end">0.4</text><text x="36" y="54" '
        'text-anchor="end">0.6</text><text x="36" y="34" text-anchor="end">0.8</text><text x="36" '
        'y="14" text-anchor="end">1</text><text x="42" y="127">0</text><text x="62" y="127">0.2'
        '</text><text x="82" y="127">0.4</text><text x="102" y="127">0.6</text><text x="122" '
        'y="127">0.8</text><text x="142" y="127">1</text><text x="92" y="144">x</text>'
        '<path class="curve c0" data-k="0" d="M42 110l100-50"/>LABEL</svg>'
    ).replace("LABEL", re.search("<text class=.*?</text>", chart_svg(chart, 148, 156))[0])


@pytest.mark.parametrize(("low", "high"), [(0, 7.3), (0, 0.004), (3, 3)])
def test_axes_have_at_most_six_ticks(low, high):
    chart = Chart("", "x", "y", [Line("a", 0, [low, high], [low, high])], "w")
    numbers = [text for text in texts(parsed(chart)) if re.fullmatch(r"[\d.e+-]+", text)]
    assert 4 <= len(numbers) <= 12


def test_names_of_lines_overlap_no_other_name_and_stay_inside():
    lines = [Line(f"tracker-{n}", n, THRESHOLDS, (1 - THRESHOLDS) ** (n + 1)) for n in range(4)]
    svg = parsed(Chart("", "overlap", "share", lines, "w", top=1.0, is_percent=True))
    names = elements(svg, "name")
    assert [node.text for node in names] == [line.label for line in lines]
    boxes = [(float(node.get("x")), float(node.get("y"))) for node in names]
    for number, (x, y) in enumerate(boxes):
        assert 42 < x < 426
        assert 10 < y < 262
        assert all(abs(y - b) >= 12 or abs(x - a) > 60 for a, b in boxes[:number])


def test_names_of_points_do_not_cross_intervals():
    """Two intervals next to each other leave room above and below only."""
    dots = [Line(f"tracker-{n}", n, [10.0 + n], [0.5], [0.3], [0.7]) for n in range(2)]
    svg = parsed(Chart("", "time", "overlap", dots, "w", "dots", True, 1.0))
    names, bars = elements(svg, "name"), elements(svg, "bar")
    assert [node.text for node in names] == ["tracker-0", "tracker-1"]
    ends = [[float(end) for end in re.findall(r"[,V]([\d.]+)", bar.get("d"))] for bar in bars]
    low, high = max(ends[0]), min(ends[0])
    sides = [node.get("text-anchor") or "middle" for node in names]
    assert all(
        side != "middle" or not high - 6 < float(node.get("y")) - 4 < low + 6
        for side, node in zip(sides, names, strict=True)
    )


def test_numbers_below_zero_have_a_true_minus_sign():
    svg = parsed(Chart("", "x", "y", [Line("a", 0, [-1, 1], [-0.5, 0.5])], "w"))
    assert {"−1", "−0.5"} <= {*texts(svg)}
    assert not any("-" in text for text in texts(svg))


def test_crowded_chart_has_colours_for_the_first_lines_only():
    lines = [Line(f"t{n}", n, [0, 1], [n / 12, 1]) for n in range(12)]
    svg = parsed(Chart("", "x", "y", lines, "w"))
    shades = [node.get("class").split()[1] for node in elements(svg, "curve")]
    assert shades[::-1] == [f"c{n}" for n in range(TOP)] + ["rest"] * (12 - TOP)
    assert len(elements(svg, "name")) == TOP


def test_gap_parts_a_line_and_a_step_keeps_its_value():
    line = Line("a", 0, [0, 1, 2, 3], [1, np.nan, 1, 0], [0, 0, 0, np.nan], [1, 1, 1, 1])
    straight, step = (parsed(Chart("", "x", "y", [line], "w", kind)) for kind in ("line", "step"))
    assert elements(straight, "curve")[0].get("d").count("M") == 2
    assert re.search(r"l[\d.]+ 0 0 [\d.]+$", elements(step, "curve")[0].get("d"))
    assert len(elements(step, "band")) == 1


def test_points_of_times_span_two_decades_and_open_frames():
    place = PlayerPosition(0, 1, 0, 7)
    dots = [Line("a<b>&\x1b", 0, [20.0], [0.5], [0.4], [0.7], [place]), Line("b", 1, [21], [0.6])]
    chart = Chart("", "time", "overlap", dots, "w", "dots", True, 1.0, reference=40.0)
    svg = parsed(chart)
    (link,) = svg.iter(f"{SVG}a")
    assert link.get("href") == "#0.1.0.7"
    assert link.get("aria-label") == "a<b>&\\u001b"
    marks = [node.get("transform") for node in elements(svg, "mark")]
    first, second = (float(re.search(r"\((.*),", mark)[1]) for mark in marks)
    assert 0 < second - first < 5  # a difference of 5 % is not stretched
    assert elements(svg, "reference")
    (bar,) = elements(svg, "bar")
    assert [10 < float(end) < 262 for end in re.findall(r"[,V]([\d.]+)", bar.get("d"))] == [
        True
    ] * 2
    assert {"1 ms", "10 ms", "100 ms"} <= {*texts(svg)}
