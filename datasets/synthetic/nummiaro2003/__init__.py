"""Synthetic sequences after Nummiaro, Koller-Meier and Van Gool (2003), on colour features.

The sequences imitate the five videos of the paper. They follow the text of the paper and use none
of its images. Every scene number gives a different video.
"""

from pathlib import Path

from trackmark.datasets.synthetic.parameters import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.nummiaro2003"

WALKING = seeded("all random properties: surroundings, clothes, paths, camera")

DRIVING = seeded("all random properties: surroundings, cars, paths, camera")

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
            seeded("all random properties: worker, movements, machines"),
            f"{MODULE}.head",
            450,
            (640, 480),
        ),
    ],
)
