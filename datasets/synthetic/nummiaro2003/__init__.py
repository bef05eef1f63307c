"""Synthetic sequences after Nummiaro, Koller-Meier and Van Gool (2003), on colour features.

The sequences imitate the five videos of the paper. They follow the text of the paper and use none
of its images. Every scene number gives a different video.
"""

from pathlib import Path

from trackmark.datasets.synthetic.parameters import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.nummiaro2003"

SIZE = 640, 480

WALKING = seeded("all random properties: surroundings, clothes, paths, camera")
DRIVING = seeded("all random properties: surroundings, cars, paths, camera")
WORKING = seeded("all random properties: worker, movements, machines")

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry("nummiaro2003/person", WALKING, f"{MODULE}.campus.person:scene", 250, SIZE),
        SequenceEntry("nummiaro2003/car", DRIVING, f"{MODULE}.driving.parking:scene", 400, SIZE),
        SequenceEntry(
            "nummiaro2003/students", WALKING, f"{MODULE}.campus.students:scene", 242, SIZE
        ),
        SequenceEntry(
            "nummiaro2003/traffic", DRIVING, f"{MODULE}.driving.traffic:scene", 330, SIZE
        ),
        SequenceEntry("nummiaro2003/head", WORKING, f"{MODULE}.head:HeadScene", 450, SIZE),
    ],
)
