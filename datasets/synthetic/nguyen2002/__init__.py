"""Synthetic sequences after Nguyen and Smeulders (2002), on templates of colour invariants.

The sequences imitate the paper's own recording and the clips that it takes from an action film.
They follow the text of the paper and use none of its images. Every scene number gives a different
video; for the film, it gives a different set of twenty clips.
"""

from pathlib import Path

from trackmark.datasets.synthetic.parameters import seeded
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite

__all__ = ["SUITE"]

MODULE = "trackmark.datasets.synthetic.nguyen2002"
SIZE = 320, 240

# numbers of frames of the twenty clips in scene 0; they differ between scenes
LENGTHS = (
    115, 119, 143, 134, 124, 155, 180, 146, 156, 164,
    157, 166, 126, 178, 140, 148, 168, 183, 115, 183,
)  # fmt: skip

FILM = seeded("a set of 20 clips: settings, targets, occluders, paths, grain")
LIGHTS = seeded("object, path, occluders, room, noise")

SUITE = SyntheticSuite(
    Path(__file__).parent,
    [
        SequenceEntry("nguyen2002/lights", LIGHTS, f"{MODULE}.lights:LightsScene", 300, SIZE),
        *(
            SequenceEntry(
                f"nguyen2002/clip-{clip:02}",
                FILM,
                f"{MODULE}.film.scene:FilmScene",
                length,
                SIZE,
                (clip,),
            )
            for clip, length in enumerate(LENGTHS, 1)
        ),
    ],
)
