"""The eight sequences of `multipart`, from the words of the paper.

Section 3 says: 640x480, outdoors, 788 to 229 frames (Table 1). "In Sequence 1-4, a walking
person is captured by a moving camera", with "target appearance changes and background changes
rapidly". "In Sequence 5-8 walking persons are captured by a fixed camera", with "background
clutters and target's occlusion". In 1, 2, 5 and 6 shirt and trousers differ in colour; in 3,
4, 7 and 8 the target is plain. "Our proposed tracker could track an object in cases of clutters
or occlusion": by Table 1 sequence 5 was tracked to its end, and 7 for nine tenths, so occlusions
are partial. All the rest is ours: drawn at random within the bounds below.

In 5 and 7 the target passes behind a post that is narrower than he. In their first version that was
a pillar which left less than 0.3 of him visible for 7 to 12 frames at each of two or three passes;
it ended most runs, which is why it was replaced. It is kept as `stress/pillar`, all else equal.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs, Seed, seed

__all__ = [
    "DESIGNS",
    "PILLARS",
    "TWIN_FRAMES",
    "Design",
    "PillarKnobs",
    "TwinKnobs",
    "WalkingKnobs",
]

TWIN_FRAMES = 150
"""Length of `stress/twin`."""


@dataclass(frozen=True)
class Design:
    """What is the same in all scenes of a sequence."""

    length: int  # [frames]
    follows: bool  # whether a camera in the hand follows the target; otherwise it is fixed
    two_coloured: bool  # whether the target's shirt and trousers differ clearly in colour and tone
    # nearest and farthest distance of the target from the camera [metres]
    depths: tuple[float, float]
    speed: float  # of the target [metres/second]
    turns: int = 0  # how often a followed target turns back on his way
    # jacket, bag: what makes the target look different from different sides: an open jacket over
    # a shirt of another colour, a bag on the back
    jacket: bool = False
    bag: bool = False
    behind: int = 0  # other people who pass, farther from the camera than the target
    before: int = 0  # other people who pass between the camera and the target, each hiding him once
    posts: int = 0  # that the target passes behind
    thickness: tuple[float, float] = (0.10, 0.14)  # of a post, as a lamp post's [metres]


DESIGNS = {
    "1": Design(788, True, True, (4.7, 8.8), 1.35, turns=1, jacket=True, behind=7),
    "2": Design(534, True, True, (5.2, 8.4), 1.35, turns=1, bag=True, behind=5),
    "3": Design(1315, True, False, (5.4, 8.6), 1.3, turns=2, behind=11),
    "4": Design(1308, True, False, (4.7, 8.9), 1.3, turns=3, behind=11),
    "5": Design(300, False, True, (6.8, 8.6), 1.05, behind=7, before=2, posts=1),
    "6": Design(269, False, True, (6.8, 8.6), 1.05, behind=7, before=3),
    "7": Design(377, False, False, (6.8, 8.6), 1.05, behind=8, before=3, posts=1),
    "8": Design(229, False, False, (6.8, 8.6), 1.05, behind=6, before=2),
}
"""By the number that the paper gives."""

PILLARS = {number: replace(DESIGNS[number], thickness=(0.35, 0.5)) for number in ("5", "7")}
"""The same with a pillar in place of the post, by that number."""


class WalkingKnobs(Knobs):
    """What can be asked of every walking scene."""

    scene: Seed = seed("all that is drawn at random: street, clothes, paths, camera")
    light: Literal["even", "dappled"] = Field(
        "even", description="even: an overcast sky; dappled: sun with the shade of trees"
    )


class PillarKnobs(WalkingKnobs):
    """What can be asked of `stress/pillar`."""

    number: Literal["5", "7"] = Field("5", description="sequence of `multipart` that it is of")


class TwinKnobs(WalkingKnobs):
    """What can be asked of `stress/twin`."""

    distance: Annotated[float, Field(ge=0, le=3)] = Field(
        0.0,
        description="between the axes of the target and the second person where they come "
        "closest in the image, sideways [widths of the target's box]",
    )
    twin: Literal["same", "other"] = Field(
        "same", description="clothes of the second person: the target's, or of other colours"
    )
