"""What others' tools say of files that we export: recorded once, compared ever after.

Made-up boxes are imported on made-up copies of GOT-10k, OTB and a VOT workspace, exported, and read
by the tools with their own readers of data and results. To record anew, with the tools installed as
`tests/bench/metrics/toolkits.py` says, from the folder of the repository:

    python -m tests.bench.exchange.fed FOLDER
    PYTHON-3.10 -m tests.bench.exchange.fed FOLDER got10k
    PYTHON-3.7 -m tests.bench.exchange.fed FOLDER vot

The first writes copies and exports into FOLDER, the others a file each beside this one.
"""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.bench.metrics import toolkits

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT = toolkits.SIZE
SEQUENCES = range(3)
TRACKER = "made"
CORNERS = np.array([[0.2, 0], [1, 0.3], [0.8, 1], [0, 0.7]])
"""Of a polygon in its box, as shares of that: what the target of VOT's last sequence is."""
STACK = """
title: made up
experiments:
  baseline:
    type: supervised
    repetitions: 2
    skip_initialize: 5
    analyses:
      - type: supervised_average_ar
        sensitivity: 30
      - type: supervised_eao_score
        low: 100
        high: 356
  longterm:
    type: unsupervised
    repetitions: 1
    analyses:
      - type: pr_curve
      - type: f_curve
      - type: average_tpr
        name: average_tpr
"""


def digest(folder):
    """Of the exported files of a tracker that the tools read here.

    Not of times, nor of an experiment that `STACK` doesn't have.
    """
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        read = "unsupervised" not in path.parts and not path.name.endswith("_time.txt")
        if path.is_file() and read:
            found.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return found.hexdigest()


def text(rows):
    return "".join(",".join(f"{value:.2f}" for value in row) + "\n" for row in rows)


def copies(folder, picture):
    """Copies of the benchmarks, whose images are all the same picture: the bytes of a JPEG."""
    from_one = np.array([1, 1, 0, 0])
    for i in SEQUENCES:
        n = toolkits.LENGTHS[i]
        name = f"GOT-10k_Val_{i + 1:06}"
        there = folder / "GOT-10k" / "val" / name
        laid(there, picture, n, 8)
        (there / "groundtruth.txt").write_text(text(toolkits.truth(i, absent=False) + from_one))
        (there / "meta_info.ini").write_text(f"[METAINFO]\nresolution: ({WIDTH}, {HEIGHT})\n")
        (there / "cover.label").write_text("".join(f"{part}\n" for part in toolkits.cover(i)))
        for flag in ("absence", "cut_by_image"):
            (there / f"{flag}.label").write_text("0\n" * n)
        with (there.parent / "list.txt").open("a") as file:
            file.write(f"{name}\n")

        there = folder / "OTB" / f"Made{i}"
        laid(there / "img", picture, n, 4)
        (there / "groundtruth_rect.txt").write_text(
            text(toolkits.truth(i, absent=False) + from_one)
        )

        there = folder / "vot" / "sequences" / f"made{i}"
        laid(there / "color", picture, n, 8)
        (there / "groundtruth.txt").write_text(text(regions(i)))
        (there / "sequence").write_text(
            f"name=made{i}\nfps=25\nformat=default\nchannels.color=color/%08d.jpg\n"
        )
        with (there.parent / "list.txt").open("a") as file:
            file.write(f"made{i}\n")
    (folder / "vot" / "stack.yaml").write_text(STACK)
    (folder / "vot" / "config.yaml").write_text("registry:\n- .\nstack: stack.yaml\n")
    told = "label = made up\nprotocol = traxpython\ncommand = none\n"
    (folder / "vot" / "trackers.ini").write_text(f"[{TRACKER}]\n{told}")


def laid(folder, picture, n, digits):
    """Images called numbers from 1."""
    folder.mkdir(parents=True)
    for number in range(1, n + 1):
        (folder / f"{number:0{digits}}.jpg").write_bytes(picture)


def regions(i):
    """Rows of VOT's truth: boxes with an absence, or polygons."""
    boxes = toolkits.truth(i)
    if i < 2:
        return boxes
    points = boxes[:, None, :2] + CORNERS * boxes[:, None, 2:]
    return np.round(points.reshape(len(points), -1), 2)


def record_got10k(folder):
    """What got10k reports on the files for GOT-10k and OTB."""
    import matplotlib as mpl

    mpl.use("Agg")
    from got10k.datasets import OTB
    from got10k.experiments import ExperimentGOT10k, ExperimentOTB

    names = [f"Made{i}" for i in SEQUENCES]
    OTB._OTB__version_dict = {"made": names}
    where = {"result_dir": str(folder / "results"), "report_dir": str(folder / "reports")}
    experiments = {
        "got10k": ExperimentGOT10k(str(folder / "GOT-10k"), subset="val", **where),
        "otb": ExperimentOTB(str(folder / "OTB"), version="made", **where),
    }
    return {
        name: experiment.report([TRACKER])[TRACKER]
        | {"files": digest(Path(experiment.result_dir, TRACKER))}
        for name, experiment in experiments.items()
    }


def record_vot(folder):
    """What the command `vot analysis` writes down."""
    asked = ["analysis", "--workspace", str(folder / "vot"), "--format", "json", "--name", "fed"]
    subprocess.run([sys.executable, "-m", "vot", *asked, TRACKER], check=True)
    told = json.loads((folder / "vot" / "analysis" / "fed.json").read_text())["results"]
    (accuracy, failures, (robustness, _), _), *_ = told["baseline"]["results"][0]
    precision, recall, f = told["longterm"]["results"][2][0]
    return {
        "files": digest(folder / "vot" / "results" / TRACKER),
        "baseline": {"accuracy": accuracy, "failures": failures, "robustness": robustness},
        "eao": told["baseline"]["results"][1][0][0],
        "longterm": {"precision": precision, "recall": recall, "f": f},
    }


PLACES = {
    "got10k": ("got10k", "", "GOT-10k", "results/GOT-10k"),
    "otb": ("otb", "", "OTB", "results/OTBmade"),
    "baseline": ("vot", "baseline", "vot/sequences", "vot/results"),
    "longterm": ("vot", "longterm", "vot/sequences", "vot/results"),
}
"""By experiment the layout, the folder in a tracker's, the data, and where it is exported to."""


def export(folder, trackmark):
    """Import made-up boxes on the copies, and export them, as users do, by `trackmark(*words)`."""
    from trackmark.bench import exchange
    from trackmark.bench.exchange.result_format import Said

    def given(kind, name, repetition, said, inside=""):
        into = folder / "given" / kind / inside
        for path, words in exchange.layout(kind).write(into, name, repetition, said).items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(words)

    from_one = np.array([1, 1, 0, 0])
    for i in SEQUENCES:
        for run in range(2):
            boxes = toolkits.estimate(i, run)
            given("got10k", f"GOT-10k_Val_{i + 1:06}", run, Said(boxes + from_one))
            given("vot", f"made{i}", run, Said(boxes, states=toolkits.states(i, run)))
        given("otb", f"Made{i}", 0, Said(toolkits.estimate(i) + from_one))
        confidence = np.r_[np.nan, toolkits.confidence(i)[1:]]
        given("vot", f"made{i}", 0, Said(toolkits.estimate(i), confidence))
    for name, (kind, inside, data, into) in PLACES.items():
        results = f"{TRACKER}={kind}:{folder / 'given' / kind / inside}"
        where = ("--sequences", folder / data, "--name", name, "--output", folder / "stored")
        trackmark("results", "import", results, *where)
        how = ["--protocol", "supervised"] if name == "baseline" else []
        trackmark("results", "export", folder / "stored" / name, folder / into, "--as", kind, *how)


def picture():
    """A JPEG of one colour and the images' size."""
    import cv2

    return cv2.imencode(".jpg", np.zeros((HEIGHT, WIDTH, 3), np.uint8))[1].tobytes()


def main(folder, tool=""):
    """Make the files, or record what a tool says of them."""
    folder = Path(folder).resolve()
    if not tool:
        program = Path(sys.executable).with_name("trackmark")
        copies(folder, picture())
        export(folder, lambda *words: subprocess.run([program, *map(str, words)], check=True))
        return
    found = record_got10k(folder) if tool == "got10k" else record_vot(folder)
    words = json.dumps(found, default=float, sort_keys=True)
    (HERE / f"fed_{tool}.json").write_text(f"{words}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
