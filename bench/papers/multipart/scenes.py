"""Measure of scenes without stored runs: the choice of Eq. 7 in the first frame."""

from functools import partial

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.multipart.first_frame import right_choice_rate
from trackmark.bench.papers.multipart.measures import PERSON
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_values import scene_values
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.trackers.histograms.bins import LuvBins


@measure("share")
def right_choice(scene: str, tracker: str) -> float:
    """Return 1 if Eq. 7 selects the right representation for most jittered rectangles, else 0.

    The right representation has two parts for a two-coloured target and one part for a plain one.
    """
    sequence = datasets.load(scene)
    name = parse_text(scene)[0].rpartition("/")[2]
    first = sequence.first_frame
    share = right_choice_rate(
        sequence[first],
        sequence.regions[PERSON][first],
        DESIGNS[name].two_coloured,
        _histogram_bins(tracker),
    )
    return float(share > 0.5)


def _histogram_bins(tracker: str) -> LuvBins:
    """Return the histogram bins of a tracker."""
    parameters = parse_tracker(tracker).parameters
    return LuvBins(parameters["binning"], parameters["uv_range"])


def _right_choices(context: Context, setting: str, *, two_coloured: bool) -> str:
    """Return in how many scenes with such targets the representation is right, as text."""
    values, tracker = list[float](), context.paper.spec("proposed", setting)
    for name, design in DESIGNS.items():
        if design.two_coloured == two_coloured:
            scenes = [scene for (scene,) in context.paper.sequences[name].scenes(context.n_scenes)]
            values += [*scene_values(right_choice, scenes, [tracker], context.folder, context.jobs)]
    return f"{sum(values):.0f} of {len(values)}"


right_choice_two_colours = partial(_right_choices, two_coloured=True)
right_choice_plain = partial(_right_choices, two_coloured=False)
