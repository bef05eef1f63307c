"""Fig. 1: frames 11 and 12 of table tennis, and the maps of frame 12."""

from matplotlib.figure import Figure

from trackmark import datasets
from trackmark.bench.papers.plots import Panel, map_plot
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.wang2010.plain import PlainImprovedCamShift

FRAME = 12  # second frame of the figure, counted from 1


def maps(context: Context) -> Figure:
    """Draw two frames, and the maps of the second frame with the ground-truth box."""
    scene = context.paper.first_scene("table-tennis")
    sequence = datasets.load(scene)
    tracker = PlainImprovedCamShift()
    tracker.init(sequence[0], sequence.boxes[0])
    for frame in range(1, FRAME):
        tracker.update(sequence[frame])
    maps_of_frame, box = tracker.maps, sequence.boxes[FRAME - 1]
    panels = [
        Panel(f"frame {FRAME - 1}", sequence[FRAME - 2], sequence.boxes[FRAME - 2]),
        Panel(f"frame {FRAME}", sequence[FRAME - 1], box),
        Panel("moving pixels B", maps_of_frame.moving.astype(float), box),
        Panel("colour map I_c", maps_of_frame.colour, box),
        Panel("motion map I_m = B I_c", maps_of_frame.moving * maps_of_frame.colour, box),
        Panel("joint map P", maps_of_frame.joint, box),
    ]
    title = f"Fig. 1, {scene}: frames, and maps of frame {FRAME} (black: 0, white: 1)"
    return map_plot(panels, title, 3)
