"""Plain scenes: one difficulty at a time.

`plain/target` is a two-coloured target that moves over a textured ground. It is easy by default;
each parameter adds one difficulty.
"""

from pathlib import Path

from trackmark.datasets.synthetic.plain.knobs import TargetKnobs
from trackmark.datasets.synthetic.suite import Entry, Suite

__all__ = ["SUITE"]

SUITE = Suite(
    Path(__file__).parent,
    [
        Entry(
            "plain/target", TargetKnobs, "trackmark.datasets.synthetic.plain.scene", 120, (320, 240)
        )
    ],
)
