"""Measure of scenes without stored runs: the choice of Eq. 7 in the first frame."""

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.multipart.first_frame import right_choice_rate
from trackmark.bench.papers.multipart.measures import PERSON
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.trackers.histograms.bins import LuvBins


@measure("share")
def right_choice(scene: str, tracker: str) -> float:
    """Return 1 if Eq. 7 selects the right representation for most jittered rectangles, else 0.

    The right representation has two parts for a two-coloured target and one part for a plain one.
    """
    sequence, parameters = datasets.load(scene), parse_tracker(tracker).parameters
    name = parse_text(scene)[0].rpartition("/")[2]
    first = sequence.first_frame
    share = right_choice_rate(
        sequence[first],
        sequence.regions[PERSON][first],
        DESIGNS[name].two_coloured,
        LuvBins(parameters["binning"], parameters["uv_range"]),
    )
    return float(share > 0.5)
