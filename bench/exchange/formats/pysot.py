"""A text a sequence, `SEQ.txt`, and beside it `longterm/SEQ/SEQ_001.txt` with confidences: pysot's.

Its data sets for one pass (OTB, LaSOT, UAV, NFS) read the first, its VOT-LT the second.
Its texts look like OTB's, and its long-term files are VOT's: neither is told from these.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from trackmark.bench.exchange.formats import otb, vot
from trackmark.bench.exchange.result_format import Layout, Said, boxes_from


def files(folder: Path) -> Mapping[str, Sequence[Path]]:
    """Return the texts by sequence, or the long-term files if there is a folder of them."""
    return vot.LAYOUT.files(folder) or otb.LAYOUT.files(folder)


def read(file: Path) -> Said:
    """Read boxes, and confidences of long-term files."""
    return vot.LAYOUT.read(file) if file.parent.parent.name in vot.EXPERIMENTS else boxes_from(file)


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the text of a run, and VOT's long-term files if it has confidences.

    A supervised run has only VOT's files.
    """
    if said.states is not None:
        return vot.LAYOUT.write(folder, sequence, repetition, said)
    made = dict(otb.LAYOUT.write(folder, sequence, repetition, said))
    if said.confidence is not None:
        made |= vot.written(folder / vot.LONG_TERM, sequence, repetition, said)
    return made


LAYOUT = Layout(
    expects="SEQ.txt, or longterm/SEQ/SEQ_001.txt",
    holds="boxes to 4 decimals; confidence, in files as of VOT's longterm beside; no times",
    origin=1,
    files=files,
    fits=None,
    read=read,
    write=write,
    held=otb.LAYOUT.held,
    parts=vot.LAYOUT.parts,
    frames=vot.LAYOUT.frames,
)
