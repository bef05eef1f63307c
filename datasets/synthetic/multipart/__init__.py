"""People who walk in a street: of a paper on single- and multi-part colour histograms, and ours.

`multipart/1` to `multipart/8` are analogues of the eight videos that the paper describes, drawn
from its words alone (`designs.py`): other videos, new in every scene. Two more put one weakness of
a tracker to the test each. In `stress/pillar` the target of 5 or 7 passes behind a pillar, which
hides nearly all of him. In `stress/twin` a second person comes near the target in the same clothes,
or in others.
"""

from pathlib import Path

from datasets.synthetic.multipart.designs import (
    DESIGNS,
    TWIN_FRAMES,
    PillarKnobs,
    TwinKnobs,
    WalkingKnobs,
)
from datasets.synthetic.render.views import SIZE
from datasets.synthetic.suite import Entry, Suite

__all__ = ["SUITE"]

MODULE = "datasets.synthetic.multipart"

SUITE = Suite(
    Path(__file__).parent,
    [
        Entry(
            "stress/pillar",
            PillarKnobs,
            f"{MODULE}.scene",
            DESIGNS["5"].length,
            SIZE,
            first_name="multipart/{number}",
        ),
        Entry("stress/twin", TwinKnobs, f"{MODULE}.scene", TWIN_FRAMES, SIZE),
        *(
            Entry(
                f"multipart/{number}",
                WalkingKnobs,
                f"{MODULE}.scene",
                design.length,
                SIZE,
                (number,),
            )
            for number, design in DESIGNS.items()
        ),
    ],
)
