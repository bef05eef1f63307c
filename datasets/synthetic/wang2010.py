"""The sequences of a paper on an improved CamShift inside a particle filter.

Analogues of the three videos on which the paper shows its trackers, drawn from its words
alone: other videos, new in every scene. The paper counts frames from 1; its frame k is ours
k - 1.
"""

from pathlib import Path

from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.gesture.knobs import HandKnobs
from datasets.synthetic.kitchen.knobs import CupKnobs
from datasets.synthetic.table_tennis.knobs import TableTennisKnobs

__all__ = ["SUITE"]

SUITE = Suite(
    [
        Entry("wang2010/table-tennis", TableTennisKnobs, "datasets.synthetic.table_tennis.scene"),
        Entry("wang2010/hand", HandKnobs, "datasets.synthetic.gesture.scene"),
        Entry("wang2010/cup", CupKnobs, "datasets.synthetic.kitchen.scene"),
    ],
    Path(__file__).with_name("golden") / "wang2010.json",
)
