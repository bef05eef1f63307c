"""The sequences of a paper on fusing cues that depend on one another.

Analogues of the paper's own recordings, and of its synthetic ellipse, drawn from its words alone:
other videos, new in every scene. All have exact masks of what is seen of the target.
"""

from pathlib import Path

from trackmark.datasets.synthetic.moreno2005.knobs import (
    BookKnobs,
    EllipseKnobs,
    LeafKnobs,
    OctopusKnobs,
)
from trackmark.datasets.synthetic.suite import Entry, Suite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.moreno2005"

SUITE = Suite(
    Path(__file__).parent,
    [
        Entry("moreno2005/ellipse", EllipseKnobs, f"{MODULE}.ellipse", 100, (320, 240)),
        Entry("moreno2005/octopus", OctopusKnobs, f"{MODULE}.octopus.scene", 100, (320, 240)),
        Entry("moreno2005/book", BookKnobs, f"{MODULE}.book.scene", 100, (320, 240)),
        Entry("moreno2005/leaf", LeafKnobs, f"{MODULE}.leaf", 100, (320, 240)),
    ],
)
