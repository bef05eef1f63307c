"""A text a sequence, `SEQ.txt`, and `longterm/SEQ/SEQ_001.txt` with confidences: pysot's.

Its texts look like OTB's, and its long-term files are VOT's: neither is told from these.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bench.exchange.layout import Layout, Said, boxes_from
from bench.exchange.layouts import otb, vot

__all__ = ["LAYOUT"]


def files(folder: Path) -> Mapping[str, Sequence[Path]]:
    """Texts by sequence, or long-term ones where there is a folder of such."""
    return vot.LAYOUT.files(folder) or otb.LAYOUT.files(folder)


def read(file: Path) -> Said:
    """Boxes, and confidences of long-term files."""
    return vot.LAYOUT.read(file) if file.parent.parent.name in vot.EXPERIMENTS else boxes_from(file)


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Text of a run; in VOT's way where it has confidences or was begun again."""
    confident = said.confidence is not None and bool(np.isfinite(said.confidence).any())
    kind = vot.LAYOUT if confident or said.states is not None else otb.LAYOUT
    return kind.write(folder, sequence, repetition, said)


LAYOUT = Layout(
    expects="SEQ.txt, or longterm/SEQ/SEQ_001.txt",
    holds="boxes to 4 decimals; confidence, in files as of VOT's longterm; no times",
    origin=1,
    files=files,
    fits=None,
    read=read,
    write=write,
    held=otb.LAYOUT.held,
)
