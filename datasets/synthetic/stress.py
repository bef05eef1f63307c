"""Scenes that put one weakness of a tracker to the test.

`stress/twin`: a second person comes near the target in the same clothes, or in others.
"""

from pathlib import Path

from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.walking.knobs import TwinKnobs

__all__ = ["SUITE"]

SUITE = Suite(
    [Entry("stress/twin", TwinKnobs, "datasets.synthetic.walking.twin")],
    Path(__file__).with_name("golden") / "stress.json",
)
