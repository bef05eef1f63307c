"""Fig. 1, the maps of two frames, and time by the number of particles."""

from matplotlib.figure import Figure

import datasets
from bench.papers.context import Context
from bench.papers.wang2010.plain import PlainImprovedCamShift
from reports.curves import curve_plot
from reports.maps import Panel, map_plot

__all__ = ["maps", "time"]

TABLE_TENNIS = "wang2010/table-tennis:version=2"

FRAME = 12
"""Of Fig. 1, which shows it and the one before, counted from 1."""

PAPERS_NUMBERS = (60.0, 400.0)


def maps(context: Context) -> Figure:
    """Fig. 1: two frames, and the maps of the second."""
    name = TABLE_TENNIS
    sequence = datasets.load(name)
    tracker = PlainImprovedCamShift()
    tracker.init(sequence[0], sequence.boxes[0])
    for index in range(1, FRAME):
        tracker.update(sequence[index])
    maps, box = tracker.maps, sequence.boxes[FRAME - 1]
    panels = [
        Panel(f"frame {FRAME - 1}", sequence[FRAME - 2], sequence.boxes[FRAME - 2]),
        Panel(f"frame {FRAME}", sequence[FRAME - 1], box),
        Panel("B: what moves", maps.moving.astype(float), box),
        Panel("colour, I_c", maps.colour, box),
        Panel("motion, I_m = B I_c", maps.moving * maps.colour, box),
        Panel("both, P", maps.joint, box),
    ]
    title = (
        f"Fig. 1, {name}: frames, and maps of frame {FRAME} (black: 0, white: 1), with the true box"
    )
    return map_plot(panels, title, 3)


def time(context: Context) -> Figure | None:
    """Time a frame against the number of particles; None without times."""
    times = context.tables.get("particle_times")
    if times is None:
        return None
    milliseconds = times.assign(value=1e3 * times["seconds"])
    found = milliseconds.groupby(["implementation", "method", "particles"], sort=False)["value"]
    points = found.agg(value="median", low="min", high="max").reset_index()
    columns = {"implementation": "panel", "method": "label", "particles": "setting"}
    return curve_plot(
        points.rename(columns=columns).replace({"label": {"particle_filter": "particle filter"}}),
        f"CPU time a frame by the number of particles, on {TABLE_TENNIS}",
        "particles",
        "time [ms]",
        ["proposed", "particle filter"],
        heading="medians and ranges over rounds",
        marks=PAPERS_NUMBERS,
        logarithmic=True,
    )
