"""Synthetic sequences after Moreno-Noguer, Sanfeliu and Samaras (2005), on dependent cues.

The sequences imitate the paper's own recordings and its synthetic ellipse. They follow the text of
the paper and use none of its images. Every scene number gives a different video. All sequences have
exact masks of the visible part of the target.
"""

from pathlib import Path

from trackmark.datasets.synthetic.parameters import seeded
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
