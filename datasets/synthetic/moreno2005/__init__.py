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

RANDOM = {
    "ellipse": "trajectory, shape, colours, clutter and noise",
    "octopus": "animal, trajectory, floor, light and noise",
    "book": "book, bending, trajectory, room and noise",
    "leaf": "leaf, wind, foliage, sun and noise",
}
"""Random properties of each sequence."""

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            f"moreno2005/{name}",
            seeded(properties),
            f"{MODULE}.{name}:{name.title()}Scene",
            length=100,
            size=(320, 240),
        )
        for name, properties in RANDOM.items()
    ],
)
