"""Synthetic sequences after Wang and Tang (2010), on CamShift inside a particle filter.

The sequences imitate the three videos of the paper. They follow the text of the paper and use none
of its images. Every scene number gives a different video. The paper counts frames from 1; its frame
k is frame k - 1 here.
"""

from pathlib import Path

from trackmark.datasets.synthetic.parameters import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.wang2010"

TABLE_TENNIS = seeded("all random properties: wall, player, light, motion, noise")
HAND = seeded("all random properties: person, room, hand, path, noise")
CUP = seeded("all random properties: cup, hand, path, kitchen, noise")

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            "wang2010/table-tennis",
            TABLE_TENNIS,
            f"{MODULE}.table_tennis:TableTennisScene",
            50,
            (142, 115),
        ),
        SequenceEntry("wang2010/hand", HAND, f"{MODULE}.hand:HandScene", 100, (160, 120)),
        SequenceEntry("wang2010/cup", CUP, f"{MODULE}.cup:CupScene", 80, (108, 85)),
    ],
)
