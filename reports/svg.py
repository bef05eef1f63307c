"""Charts as SVG: complete without JavaScript and in print; scripts only add a readout.

Colours are CSS variables of the page, so that charts follow its light or dark theme. Coordinates of
paths are absolute; `page.js` reads the points of a line from them.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import compress
from math import ceil, floor, isfinite, log10

import numpy as np
from markupsafe import Markup
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from trackmark.reports.charts import Chart, Line
from trackmark.reports.palette import DASHES, MARKER_PATHS, colour_index
from trackmark.reports.printable import one_line, with_minus

CROWDED = 7
"""Maximum number of lines in full colour; of more, only the first `TOP` are not grey."""

TOP = 5
_MAX_TICKS = 6
_MAX_LABEL = 24  # characters of a direct label
_LETTER = 8.0  # mean width of a letter of a label, also on a phone [px]
_COLUMNS = 80  # possible positions of a direct label along the abscissa
_DISTANCE = 11.0  # of the middle of a label from its line [px]
_HEIGHT = 13.0  # of a label [px]
_LEFT, _TOP, _BOTTOM = 42, 10, 38  # margins [px]

Array = NDArray[np.float64]

_Rectangle = tuple[float, float, float, float]  # left, top, right and bottom [px]


@dataclass(frozen=True)
class _Scale:
    """Linear or logarithmic axis: limits in data and in pixels, and ticks."""

    limits: tuple[float, float]
    pixels: tuple[float, float]
    is_logarithmic: bool = False

    def __call__(self, values: Array | float) -> Array:
        low, high = np.log10(self.limits) if self.is_logarithmic else self.limits
        shares = ((np.log10(values) if self.is_logarithmic else np.asarray(values)) - low) / (
            high - low
        )
        return np.asarray(self.pixels[0] + shares * (self.pixels[1] - self.pixels[0]))

    @property
    def ticks(self) -> list[float]:
        """At most six round values within the limits."""
        low, high = self.limits
        if self.is_logarithmic:
            powers = range(round(log10(low)), round(log10(high)) + 1)
            return [10.0**power for power in powers[:: ceil(len(powers) / _MAX_TICKS)]]
        power = 10.0 ** floor(log10((high - low) / (_MAX_TICKS - 1)))
        steps = [digit * power for digit in (1, 2, 2.5, 5, 10)]
        step = next(step for step in steps if (high - low) / step <= _MAX_TICKS - 1)
        first = ceil(low / step - 1e-9)
        count = floor((high + 1e-9 * step) / step) - first + 1
        return [round((first + n) * step, 10) for n in range(count)]


def chart_svg(chart: Chart, height: int = 300, width: int = 440) -> Markup:
    """Return a chart as an SVG element; its points open frames."""
    lines = [line for line in chart.lines if np.isfinite(np.asarray(line.y, float)).any()]
    x, y = _scales(chart, lines, width, height)
    elements = [*_axes(chart, x, y, width, height)]
    if chart.style == "dots":
        elements += _dots(lines, x, y)
    else:
        crowded = len(lines) > CROWDED
        elements += [_line(line, x, y, chart.style, crowded=crowded) for line in reversed(lines)]
        labelled = lines[:TOP] if crowded else lines
        elements += _labels(labelled, x, y) if chart.has_line_names else []
    scales = " ".join(f"{v:.10g}" for scale in (x, y) for v in (*scale.pixels, *scale.limits))
    role, description = "group" if chart.style == "dots" else "img", one_line(chart.description)
    svg = Markup(
        '<svg viewBox="0 0 {} {}" role="{}" aria-label="{}" data-scale="{}" text-anchor="middle">{}'
        "</svg>"
    )
    return svg.format(width, height, role, description, scales, Markup("").join(elements))


def dash_class(position: int) -> str:
    """Return the class of the dashes of the tracker with an index, after a space; empty for none.

    A page has a CSS rule for each class.
    """
    index = position % len(DASHES)
    return f" d{index}" if DASHES[index] else ""


def at_reference(chart: Chart, line: Line) -> str:
    """Return the value of a line at the reference of a chart, else the line's own value."""
    values = np.asarray(line.y, float)
    if chart.reference is None or not np.isfinite(values).any():
        return line.value
    value = values[np.nanargmin(np.abs(np.asarray(line.x, float) - chart.reference))]
    return f"{100 * value:.0f} %" if chart.is_percent else f"{value:.2f}"


def _scales(chart: Chart, lines: Sequence[Line], width: int, height: int) -> tuple[_Scale, _Scale]:
    xs, ys = (
        np.concatenate([[], *(np.asarray(getattr(line, name), float) for line in lines)])
        for name in ("x", "y")
    )
    xs, ys = xs[np.isfinite(xs)], ys[np.isfinite(ys)]
    across, down = (float(_LEFT), width - 14.0), (height - float(_BOTTOM), float(_TOP))
    low, high = (xs.min(), xs.max()) if len(xs) else (0.0, 1.0)
    if chart.logarithmic:
        low, high = floor(log10(max(low, 1e-9) / 1.2)), ceil(log10(max(high, 1e-9) * 1.2))
        limits = 10.0 ** (low - (high - low < 2)), 10.0**high  # two decades at least
    else:
        limits = float(min(0.0, low)), float(high if high > low else low + 1)
    top = chart.top if chart.top is not None else float(ys.max(initial=1e-9)) * 1.05
    bottom = min(0.0, float(ys.min(initial=0.0)))
    return _Scale(limits, across, chart.logarithmic), _Scale((bottom, top), down)


def _axes(chart: Chart, x: _Scale, y: _Scale, width: int, height: int) -> Iterator[Markup]:
    """Yield grid lines with their numbers, the names of the axes, and the reference line."""
    (left, right), (bottom, top) = x.pixels, y.pixels
    grid, labels = "", list[tuple[float, float, str, str]]()
    for tick in y.ticks:
        position = float(y(tick))
        unit = " %" * (tick == y.ticks[-1])
        label = f"{100 * tick:g}{unit}" if chart.is_percent else with_minus(f"{tick:g}")
        grid += f"M{left:g},{_px(position)}H{right:g}"
        labels.append((left - 6, position + 4, "end", label))
    for tick in x.ticks:
        position = float(x(tick))
        label = _time(tick) if chart.logarithmic else with_minus(f"{tick:g}")
        grid += f"M{_px(position)},{top:g}V{bottom:g}" * (chart.style == "dots")
        labels.append((position, bottom + 17, "middle", label))
    name = chart.x.replace(" [ms]", ", log scale") if chart.logarithmic else chart.x
    labels.append(((left + right) / 2, height - 4, "middle", one_line(name)))
    yield Markup('<path class="grid" d="{}"/>').format(grid)
    if chart.reference is not None and x.limits[0] <= chart.reference <= x.limits[1]:
        position = float(x(chart.reference))
        path = f"M{_px(position)},{top:g}V{bottom:g}"
        yield Markup('<path class="reference" d="{}"/>').format(path)
        if chart.reference_label:
            labels.append((position - 4, bottom - 6, "end", chart.reference_label))
    for across, down, anchor, label in labels:
        yield _label(label, across, down, anchor)


def _label(label: str, x: float, y: float, anchor: str = "middle", class_name: str = "") -> Markup:
    """Return a text at a position [px]; a chart has the anchor `middle` for all its texts."""
    named = Markup(' class="{}"').format(class_name) if class_name else ""
    anchored = Markup(' text-anchor="{}"').format(anchor) if anchor != "middle" else ""
    element = Markup('<text{} x="{}" y="{}"{}>{}</text>')
    return element.format(named, _px(x), _px(y), anchored, label)


def _px(position: float) -> str:
    """Return a coordinate, rounded to a tenth of a pixel."""
    return f"{position:.1f}".removesuffix(".0")


def _time(milliseconds: float) -> str:
    """Return a time with the unit in which it is short."""
    for factor, unit in ((1e6, "ns"), (1e3, "µs"), (1, "ms"), (1e-3, "s")):
        if 0.99 <= milliseconds * factor < 999 or unit == "s":
            return f"{milliseconds * factor:g} {unit}"
    return f"{milliseconds:g} ms"


def _line(line: Line, x: _Scale, y: _Scale, style: str, *, crowded: bool) -> Markup:
    """Return a line with its band.

    The attribute `data-positions` lists the player position that a click on each point opens.
    """
    xs, ys = np.asarray(line.x, float), np.asarray(line.y, float)
    grey = crowded and line.position >= TOP
    index = "rest" if grey else f"c{colour_index(line.position)}"
    has_position = [True] if len(line.positions) == 1 else np.isfinite(ys)
    opened = compress(line.positions, has_position)
    positions = " ".join(
        position._replace(show=()).link[1:] if position else "-" for position in opened
    )
    band = Markup("")
    if np.size(line.low) and not crowded and style == "step":
        low, high = np.asarray(line.low, float), np.asarray(line.high, float)
        finite = np.isfinite(low) & np.isfinite(high)
        upper, lower = (_corners(xs[finite], end[finite]) for end in (high, low))
        across, down = (
            np.append(ends, others[::-1]) for ends, others in zip(upper, lower, strict=True)
        )
        rim = _trace(x(across), y(down))
        band = Markup('<path class="band {}" d="{}Z"/>').format(index, rim) if rim else band
    gaps = np.flatnonzero(~np.isfinite(ys))
    path = ""
    for indices in np.split(np.arange(len(ys)), gaps):
        finite = indices[np.isfinite(ys[indices])]
        points = xs[finite], ys[finite]
        across, down = _corners(*points) if style == "step" else points
        path += _trace(x(across), y(down))
    link = Markup(' data-positions="{}"').format(positions) if positions else ""
    curve = Markup('<path class="curve {}" data-k="{}" d="{}"{}/>')
    return band + curve.format(index + dash_class(line.position), line.position, path, link)


def _corners(xs: Array, ys: Array) -> tuple[Array, Array]:
    """Return the corners of a step line, which keeps its value until the next point."""
    return np.repeat(xs, 2)[1:], np.repeat(ys, 2)[:-1]


def _trace(xs: Array, ys: Array) -> str:
    """Return the path through points [px]: a move, then relative lines; empty without points."""
    points = np.column_stack([xs, ys]).round(1)
    if not len(points):
        return ""
    steps = np.diff(points, axis=0, prepend=np.zeros((1, 2))).round(1) + 0.0  # no -0
    start, lines = (
        " ".join(f"{step:g}" for step in part.ravel()) for part in (steps[:1], steps[1:])
    )
    path = f"M{start}l{lines}".removesuffix("l")
    # Spaces before a sign and zeros before a point are not needed; paths are much of a page.
    return re.sub(r" (?=-)|(?<=[ l-])0(?=\.)", "", path)


def _dots(lines: Sequence[Line], x: _Scale, y: _Scale) -> Iterator[Markup]:
    """Yield the mark, the interval and the name of each tracker; they open its worst frame.

    A name is where it touches no mark, interval or other name; without such a place it is omitted.
    """
    frame = x.pixels[0], 0.0, x.pixels[1], y.pixels[0]
    marks, occupied = [], list[_Rectangle]()
    for line in lines:
        across, down = (
            float(scale(np.asarray(v, float))[0]) for scale, v in ((x, line.x), (y, line.y))
        )
        limits = [float(np.asarray(end, float)[0]) for end in (line.low, line.high) if np.size(end)]
        ends = [float(y(end)) for end in limits] if all(map(isfinite, limits)) else []
        marks.append((line, across, down, ends))
        occupied.append((across - 7, down - 7, across + 7, down + 7))
        occupied += [(across - 3, ends[1], across + 3, ends[0])] if ends else []
    for line, across, down, ends in marks:
        index, path = colour_index(line.position), MARKER_PATHS[line.position % len(MARKER_PATHS)]
        elements = Markup("")
        if ends:
            bar = Markup('<path class="bar c{}" d="M{:.1f},{:.1f}V{:.1f}"/>')
            elements += bar.format(index, across, *ends)
        mark = Markup('<path class="mark c{}" transform="translate({:.1f},{:.1f})" d="{}"/>')
        elements += mark.format(index, across, down, path)
        elements += _free_name(line, across, down, ends, frame, occupied)
        position = next(filter(None, line.positions), None)
        if position is None:
            yield elements
        else:
            link = Markup('<a href="{}" aria-label="{}">{}</a>')
            yield link.format(position.link, one_line(line.label), elements)


def _free_name(
    line: Line,
    across: float,
    down: float,
    ends: Sequence[float],
    frame: _Rectangle,
    occupied: list[_Rectangle],
) -> Markup:
    """Return the name of a tracker, and add its rectangle; empty without room.

    It is next to its mark, or else above or below the interval with these `ends`.
    """
    name, index = _short(line.label), colour_index(line.position)
    wide = _LETTER * len(name)
    positions = [
        position
        for shift in (0, -14, 14, -28, 28, -42, 42)
        for position in (
            (across + 10, across + 10, "start", down + shift),
            (across - 10 - wide, across - 10, "end", down + shift),
        )
    ]
    heights = min(ends, default=down) - 10, max(ends, default=down) + 10
    positions += [(across - wide / 2, across, "middle", middle) for middle in heights]
    for left, start, anchor, middle in positions:
        right, top, bottom = left + wide, middle - _HEIGHT / 2, middle + _HEIGHT / 2
        is_inside = left >= frame[0] and right <= frame[2] and frame[1] <= top < bottom <= frame[3]
        if is_inside and not any(
            left < x1 and right > x0 and top < y1 and bottom > y0 for x0, y0, x1, y1 in occupied
        ):
            occupied.append((left, top, right, bottom))
            return _label(name, start, middle + 4, anchor, f"name c{index}")
    return Markup("")


def _labels(lines: Sequence[Line], x: _Scale, y: _Scale) -> Iterator[Markup]:
    """Yield the name of each line, next to it where other lines and names are farthest."""
    grid = np.linspace(*x.pixels, _COLUMNS)
    rows = []  # heights of lines and names by column of the grid [px]; NaN where there are none
    for line in lines:
        xs, ys = np.asarray(line.x, float), np.asarray(line.y, float)
        finite = np.isfinite(ys)
        rows.append(np.interp(grid, x(xs[finite]), y(ys[finite])))
    for index, line in enumerate(lines):
        name = _short(line.label)
        wide = min(_COLUMNS, ceil(_LETTER * len(name) / (grid[1] - grid[0])) + 1)
        near = np.stack([sliding_window_view(row, wide) for row in rows])
        heights = near[index]
        middles = np.stack([heights.min(axis=1) - _DISTANCE, heights.max(axis=1) + _DISTANCE])
        gaps = np.abs(near[:, None] - middles[..., None])
        gaps[len(lines) :] -= _HEIGHT  # names must not overlap, but may cross a line
        room = np.nanmin(gaps, axis=(0, 3)).clip(max=_HEIGHT)
        room[(middles < y.pixels[1] + 8) | (middles > y.pixels[0] - 8)] = -np.inf
        score = room - np.abs(middles - heights[:, wide // 2]) / 5
        side, start = np.unravel_index(np.argmax(score), score.shape)
        if room[side, start] < 0:
            continue
        middle, columns = middles[side, start], np.arange(start, start + wide)
        rows.append(np.full(_COLUMNS, np.nan))
        rows[-1][columns] = middle
        centre = grid[columns].mean()
        colour = f"name c{colour_index(line.position)}"
        yield _label(name, float(centre), middle + 4, class_name=colour)


def _short(label: str) -> str:
    """Return a name of limited length for a chart."""
    label = one_line(label)
    return label if len(label) <= _MAX_LABEL else f"{label[: _MAX_LABEL - 1]}…"
