"""Format of pysot: `SEQ.txt`, and `longterm/SEQ/SEQ_001.txt` with confidences.

Its data sets for one-pass evaluation (OTB, LaSOT, UAV, NFS) use files of the first kind, VOT-LT
uses the second kind. The user must name this format, because its files are also valid in `otb` and
`vot`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from trackmark.bench.exchange.formats import otb, vot
from trackmark.bench.exchange.result_format import ResultFormat, ResultRows, read_boxes


def files(folder: Path) -> Mapping[str, Sequence[Path]]:
    """Return the long-term files by sequence; without such files, the text files."""
    return vot.FORMAT.files(folder) or otb.FORMAT.files(folder)


def read(file: Path) -> ResultRows:
    """Read boxes, and the confidences of long-term files."""
    return vot.FORMAT.read(file) if file.parent.parent.name in vot.EXPERIMENTS else read_boxes(file)


def write(folder: Path, sequence: str, repetition: int, rows: ResultRows) -> Mapping[Path, str]:
    """Return the text of a run, and long-term files of VOT if it has confidences.

    A supervised run has only files of VOT.
    """
    if rows.states is not None:
        return vot.FORMAT.write(folder, sequence, repetition, rows)
    texts = dict(otb.FORMAT.write(folder, sequence, repetition, rows))
    if rows.confidence is not None:
        texts |= vot.experiment_texts(folder / vot.LONG_TERM, sequence, repetition, rows)
    return texts


FORMAT = ResultFormat(
    expects="SEQ.txt, or longterm/SEQ/SEQ_001.txt",
    exports="boxes to 4 decimals; confidence, in files of VOT's longterm; no times",
    files=files,
    fits=None,
    read=read,
    write=write,
    rounding=otb.FORMAT.rounding,
    parts=vot.FORMAT.parts,
    frames=vot.FORMAT.frames,
)
