"""Pedestrians in a street: `multipart/1` to `multipart/8`, `stress/pillar` and `stress/twin`.

`multipart/1` to `multipart/8` imitate the eight videos of a paper on single-part and multi-part
colour histograms. They follow the text of the paper (see `designs.py`) and use none of its images.
Other people are dressed independently of the target, unless `others=exchanged` is set.
In `stress/pillar` the target of `multipart/5` or `multipart/7` passes behind a pillar that occludes
most of it. In `stress/twin` a second person, in equal or in other clothes, approaches the target.
"""

from pathlib import Path

from trackmark.datasets.synthetic.multipart import designs
from trackmark.datasets.synthetic.render.views import SIZE
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

RENDERER = "trackmark.datasets.synthetic.multipart.scene:scene"

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry(
            "stress/pillar", designs.PillarParameters, RENDERER, designs.DESIGNS["5"].length, SIZE
        ),
        SequenceEntry("stress/twin", designs.TwinParameters, RENDERER, designs.TWIN_FRAMES, SIZE),
        *(
            SequenceEntry(
                f"multipart/{number}",
                designs.TwoColouredParameters if design.two_coloured else designs.WalkingParameters,
                RENDERER,
                design.length,
                SIZE,
                (number,),
            )
            for number, design in designs.DESIGNS.items()
        ),
    ],
)
