"""The walking sequences of a paper on single- and multi-part colour histograms.

Eight analogues of the eight videos that the paper describes, drawn from its words alone
(`walking/designs.py`): other videos, new in every scene.
"""

from pathlib import Path

from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.walking.designs import DESIGNS
from datasets.synthetic.walking.knobs import WalkingKnobs

__all__ = ["SUITE"]

SUITE = Suite(
    [
        Entry(f"multipart/{number}", WalkingKnobs, "datasets.synthetic.walking.street", (number,))
        for number in DESIGNS
    ],
    Path(__file__).with_name("golden") / "multipart.json",
)
