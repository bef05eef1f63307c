"""The sequences of a paper on template tracking by colour-invariant pixel features.

Analogues of the paper's own recording, and of the clips that it took from an action film, drawn
from its words alone: other videos, new in every scene. A scene of the film is a set of twenty
clips.
"""

from pathlib import Path

from datasets.synthetic.engine.suite import Entry, Suite
from datasets.synthetic.film.knobs import FilmKnobs
from datasets.synthetic.lamps.knobs import LightsKnobs

__all__ = ["SUITE"]

CLIPS = 20
"""Clips in a set."""

SUITE = Suite(
    [
        Entry("nguyen2002/lights", LightsKnobs, "datasets.synthetic.lamps.scene"),
        *(
            Entry(f"nguyen2002/clip-{clip:02}", FilmKnobs, "datasets.synthetic.film.scene", (clip,))
            for clip in range(1, CLIPS + 1)
        ),
    ],
    Path(__file__).with_name("golden") / "nguyen2002.json",
)
