"""Plain scenes: one difficulty at a time.

`plain/target` is a two-coloured target that moves over a textured ground. By default
nothing is hard about it; each knob makes one thing hard.
"""

from pathlib import Path

from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.target.knobs import TargetKnobs

__all__ = ["SUITE"]

SUITE = Suite(
    [Entry("plain/target", TargetKnobs, "datasets.synthetic.target.scene")],
    Path(__file__).with_name("golden") / "plain.json",
)
