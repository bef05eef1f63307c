"""Designs of the eight sequences of `multipart`, from the paper's text.

Section 3 of the paper gives 640x480 pixels, outdoors, 229 to 788 frames (Table 1). "In Sequence
1-4, a walking person is captured by a moving camera", with "target appearance changes and
background changes rapidly". "In Sequence 5-8 walking persons are captured by a fixed camera", with
"background clutters and target's occlusion". In sequences 1, 2, 5 and 6 shirt and trousers differ
in colour; in 3, 4, 7 and 8 the target has one colour. In Table 1 all methods lose the target of
sequence 7 at frame 337 of 377. The conclusion names "a similar looking object" nearby as the
weakness of colours.

The paper does not describe the clothes of other people. `others=neutral` dresses them
independently of the target: people who overtake a two-coloured target as the target is dressed, all
others from a wardrobe. `others=exchanged` gives those who overtake the target its two colours, with
shirt and trousers exchanged. They show the mechanism of the paper, as a histogram of the whole
person is equal for both.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from trackmark.datasets.synthetic.parameters import Seed, SequenceParameters, seed

TWIN_FRAMES = 150  # number of frames of `stress/twin`


@dataclass(frozen=True)
class Design:
    """Properties that are equal in all scenes of a sequence."""

    length: int  # [frames]
    follows: bool  # True for a hand-held camera that follows the target, False for a fixed camera
    two_coloured: bool  # True if the target's shirt and trousers differ clearly in colour
    # minimum and maximum distance of the target from the camera [metres]
    depths: tuple[float, float]
    speed: float  # speed of the target [metres/second]
    turns: int = 0  # number of times that the target of a following camera reverses its direction
    # True if the target wears an open jacket over a darker shirt: front and back differ
    jacket: bool = False
    # True if the target carries a bag on the back: front and back differ
    bag: bool = False
    behind: int = 0  # number of passers-by behind the target
    before: int = 0  # number of passers-by in front of the target; each occludes the target once
    posts: int = 0  # number of lamp posts that the target passes behind
    # number of people in two-coloured clothes who overtake the target
    overtaking: int = 0
    pace: float = 0.9  # speed of the overtaking people relative to the target [metres/second]
    # True if a person in the target's clothes crosses in front of the target
    crossing: bool = False


# designs by the number that the paper uses
DESIGNS = {
    "1": Design(788, True, True, (5.0, 8.0), 1.35, turns=1, jacket=True, behind=7, overtaking=3),
    "2": Design(
        534, True, True, (5.2, 8.0), 1.35, turns=1, bag=True, behind=5, overtaking=2, pace=0.72
    ),
    "3": Design(1315, True, False, (5.4, 8.6), 1.3, turns=2, behind=11),
    "4": Design(1308, True, False, (4.7, 8.9), 1.3, turns=3, behind=11),
    "5": Design(
        300, False, True, (7.0, 7.8), 1.05, behind=7, before=2, posts=1, overtaking=1, pace=0.72
    ),
    "6": Design(269, False, True, (7.0, 7.8), 1.05, behind=7, before=3, overtaking=1, pace=0.72),
    "7": Design(377, False, False, (7.0, 7.8), 1.05, behind=8, before=2, posts=1, crossing=True),
    "8": Design(229, False, False, (7.0, 7.8), 1.05, behind=6, before=2),
}


class WalkingParameters(SequenceParameters):
    """Parameters of all walking scenes."""

    scene: Seed = seed("all random properties: street, clothes, paths, camera")
    light: Literal["even", "dappled"] = Field(
        "even", description="even: an overcast sky; dappled: sun with the shade of trees"
    )


Clothes = Literal["neutral", "exchanged"]


class TwoColouredParameters(WalkingParameters):
    """Parameters of the scenes whose target wears two colours."""

    others: Clothes = Field(
        "neutral",
        description="clothes of the people who overtake the target: neutral: drawn like the "
        "target's and independently of them; exchanged: in the target's colours, with shirt and "
        "trousers exchanged",
    )


class PillarParameters(WalkingParameters):
    """Parameters of `stress/pillar`."""

    number: Literal["5", "7"] = Field(
        "5", description="sequence of `multipart` in which a pillar replaces the lamp post"
    )


class TwinParameters(WalkingParameters):
    """Parameters of `stress/twin`."""

    distance: Annotated[float, Field(ge=0, le=3)] = Field(
        0.0,
        description="minimum sideways distance in the image between the axes of the target and "
        "the second person [widths of the target's box]",
    )
    twin: Literal["same", "other"] = Field(
        "same",
        description="clothes of the second person: equal to the target's, or in other colours",
    )
