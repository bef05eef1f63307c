"""Sequences of a paper on fusing cues that depend on one another.

They imitate the paper's own recordings and its synthetic ellipse. They follow only its text: the
videos differ from the originals and are new in every scene. All have exact masks of the visible
part of the target.
"""

from pathlib import Path

from trackmark.datasets.synthetic.knobs import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.moreno2005"

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            "moreno2005/ellipse",
            seeded("trajectory, shape, colours, clutter and noise"),
            f"{MODULE}.ellipse",
            100,
            (320, 240),
        ),
        SequenceEntry(
            "moreno2005/octopus",
            seeded("animal, trajectory, floor, light and noise"),
            f"{MODULE}.octopus",
            100,
            (320, 240),
        ),
        SequenceEntry(
            "moreno2005/book",
            seeded("book, bending, trajectory, room and noise"),
            f"{MODULE}.book",
            100,
            (320, 240),
        ),
        SequenceEntry(
            "moreno2005/leaf",
            seeded("leaf, wind, foliage, sun and noise"),
            f"{MODULE}.leaf",
            100,
            (320, 240),
        ),
    ],
)
