"""The sequences of a paper on an adaptive colour-based particle filter.

Analogues of the five videos that the paper shows, drawn from its words alone: other videos,
new in every scene.
"""

from pathlib import Path

from trackmark.datasets.synthetic.nummiaro2003.knobs import DrivingKnobs, HeadKnobs, WalkingKnobs
from trackmark.datasets.synthetic.suite import Entry, Suite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.nummiaro2003"

SUITE = Suite(
    Path(__file__).parent,
    [
        Entry("nummiaro2003/person", WalkingKnobs, f"{MODULE}.campus.person", 250, (640, 480)),
        Entry("nummiaro2003/car", DrivingKnobs, f"{MODULE}.driving.parking", 400, (640, 480)),
        Entry("nummiaro2003/students", WalkingKnobs, f"{MODULE}.campus.students", 242, (640, 480)),
        Entry("nummiaro2003/traffic", DrivingKnobs, f"{MODULE}.driving.traffic", 330, (640, 480)),
        Entry("nummiaro2003/head", HeadKnobs, f"{MODULE}.factory.scene", 450, (640, 480)),
    ],
)
