"""Sequences of a paper on an adaptive colour-based particle filter.

They imitate the five videos that the paper shows. They follow only its text: the videos differ from
the originals and are new in every scene.
"""

from pathlib import Path

from trackmark.datasets.synthetic.knobs import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.nummiaro2003"

WALKING = seeded("all that is drawn at random: place, clothes, paths, camera")

DRIVING = seeded("all that is drawn at random: place, cars, paths, camera")

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry("nummiaro2003/person", WALKING, f"{MODULE}.campus.person", 250, (640, 480)),
        SequenceEntry("nummiaro2003/car", DRIVING, f"{MODULE}.driving.parking", 400, (640, 480)),
        SequenceEntry(
            "nummiaro2003/students", WALKING, f"{MODULE}.campus.students", 242, (640, 480)
        ),
        SequenceEntry(
            "nummiaro2003/traffic", DRIVING, f"{MODULE}.driving.traffic", 330, (640, 480)
        ),
        SequenceEntry(
            "nummiaro2003/head",
            seeded("all that is drawn at random: worker, routine, machines"),
            f"{MODULE}.head",
            450,
            (640, 480),
        ),
    ],
)
