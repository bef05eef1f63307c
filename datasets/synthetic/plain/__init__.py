"""Plain scenes, each with one difficulty.

`plain/target` shows a two-coloured target that moves over a textured ground. With default
parameters it is easy; each parameter adds one difficulty.
"""

from pathlib import Path

from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            "plain/target",
            TargetParameters,
            "trackmark.datasets.synthetic.plain.scene:TargetScene",
            120,
            (320, 240),
        )
    ],
)
