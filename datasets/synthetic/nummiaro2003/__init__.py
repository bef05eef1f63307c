"""The sequences of a paper on an adaptive colour-based particle filter.

Analogues of the five videos that the paper shows, drawn from its words alone: other videos,
new in every scene.
"""

from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from datasets.interface import SequenceError
from datasets.synthetic.nummiaro2003.knobs import (
    DrivingKnobs,
    HeadKnobs,
    PersonKnobs,
    StudentsKnobs,
)
from datasets.synthetic.suite import Entry, Suite
from datasets.text_form import parse_text

__all__ = ["SUITE", "entries"]

MODULE = "datasets.synthetic.nummiaro2003"

SUITE = Suite(
    Path(__file__).parent,
    [
        Entry("nummiaro2003/person", PersonKnobs, f"{MODULE}.campus.person", 250, (640, 480)),
        Entry("nummiaro2003/car", DrivingKnobs, f"{MODULE}.driving.parking", 400, (640, 480)),
        Entry("nummiaro2003/students", StudentsKnobs, f"{MODULE}.campus.students", 242, (640, 480)),
        Entry("nummiaro2003/traffic", DrivingKnobs, f"{MODULE}.driving.traffic", 330, (640, 480)),
        Entry("nummiaro2003/head", HeadKnobs, f"{MODULE}.factory.scene", 450, (640, 480)),
    ],
)


class EnteredModule(Protocol):
    """What the suite's modules offer beyond a scene."""

    def entries(self, knobs: Any) -> NDArray[np.float64]:
        """See `entries` of the suite."""
        ...


def entries(name: str) -> NDArray[np.float64]:
    """Where a target can come into the picture: doors, and stretches of its borders.

    Parameters
    ----------
    name : str
        One of the suite's with options (`nummiaro2003/person:scene=2:start=empty`).

    Returns
    -------
    ndarray of float64, shape (k, 4)
        Boxes that hold the middle of a target which is just coming into view [pixels].

    Raises
    ------
    SequenceError
        For a name that is none of the suite's, an unknown knob or a value out of its bounds.
    """
    bare, options = parse_text(name)
    if bare not in SUITE.entries:
        known = ", ".join(SUITE.names())
        raise SequenceError(f"{name!r} has no known entries. Sequences that have: {known}.")
    knobs, module = SUITE.entries[bare].opened(options)
    return cast(EnteredModule, module).entries(knobs)
