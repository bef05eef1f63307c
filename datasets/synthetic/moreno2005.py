"""The sequences of a paper on fusing cues that depend on one another.

Analogues of the paper's own recordings, and of its synthetic ellipse, drawn from its words alone:
other videos, new in every scene. All have exact masks of what is seen of the target.
"""

from pathlib import Path

from datasets.synthetic.bending_book.knobs import BookKnobs
from datasets.synthetic.ellipse.knobs import EllipseKnobs
from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.foliage.knobs import LeafKnobs
from datasets.synthetic.seabed.knobs import OctopusKnobs

__all__ = ["SUITE"]

SUITE = Suite(
    [
        Entry("moreno2005/ellipse", EllipseKnobs, "datasets.synthetic.ellipse.scene"),
        Entry("moreno2005/octopus", OctopusKnobs, "datasets.synthetic.seabed.scene"),
        Entry("moreno2005/book", BookKnobs, "datasets.synthetic.bending_book.scene"),
        Entry("moreno2005/leaf", LeafKnobs, "datasets.synthetic.foliage.scene"),
    ],
    Path(__file__).with_name("golden") / "moreno2005.json",
)
