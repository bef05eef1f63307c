"""Sequences of a paper on an improved CamShift inside a particle filter.

They imitate the three videos on which the paper shows its trackers. They follow only its text: the
videos differ from the originals and are new in every scene. The paper counts frames from 1; its
frame k is frame k - 1 here.
"""

from pathlib import Path

from trackmark.datasets.synthetic.knobs import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.wang2010"

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            "wang2010/table-tennis",
            seeded("all that is drawn at random: wall, player, light, motion, noise"),
            f"{MODULE}.table_tennis",
            50,
            (142, 115),
        ),
        SequenceEntry(
            "wang2010/hand",
            seeded("all that is drawn at random: person, room, hand, way, noise"),
            f"{MODULE}.hand.scene",
            100,
            (160, 120),
        ),
        SequenceEntry(
            "wang2010/cup",
            seeded("all that is drawn at random: cup, hand, way, kitchen, noise"),
            f"{MODULE}.cup",
            80,
            (108, 85),
        ),
    ],
)
