"""Scores that toolkits compute from exported files: recorded once, compared in the tests.

Random boxes are imported for small imitations of GOT-10k, OTB and a VOT workspace. They are
exported again, and the toolkits read them with their own readers of data and results. To record the
scores again, install the toolkits as described in `tests/bench/metrics/toolkits.py`. Then run, in
the folder of the repository:

    python -m tests.bench.exchange.toolkit_files FOLDER
    PYTHON-3.10 -m tests.bench.exchange.toolkit_files FOLDER got10k
    PYTHON-3.7 -m tests.bench.exchange.toolkit_files FOLDER vot

The first command writes the data sets and the exports into FOLDER. The others write one JSON file
each into the folder of this module.
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
"""Corners of the target of VOT's last sequence, a polygon, as shares of its bounding box."""
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
    """Return the digest of the exported files of a tracker that the toolkits read.

    Times are not read, nor is an experiment that is not in `STACK`.
    """
    result = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        is_read = "unsupervised" not in path.parts and not path.name.endswith("_time.txt")
        if path.is_file() and is_read:
            result.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return result.hexdigest()


def text(rows):
    return "".join(",".join(f"{value:.2f}" for value in row) + "\n" for row in rows)


def write_data_sets(folder, picture):
    """Write small imitations of the data sets; all images are `picture`, the bytes of a JPEG."""
    from_one = np.array([1, 1, 0, 0])
    for i in SEQUENCES:
        n = toolkits.LENGTHS[i]
        name = f"GOT-10k_Val_{i + 1:06}"
        target = folder / "GOT-10k" / "val" / name
        write_images(target, picture, n, 8)
        (target / "groundtruth.txt").write_text(text(toolkits.truth(i, absent=False) + from_one))
        (target / "meta_info.ini").write_text(f"[METAINFO]\nresolution: ({WIDTH}, {HEIGHT})\n")
        (target / "cover.label").write_text("".join(f"{part}\n" for part in toolkits.cover(i)))
        for flag in ("absence", "cut_by_image"):
            (target / f"{flag}.label").write_text("0\n" * n)
        with (target.parent / "list.txt").open("a") as file:
            file.write(f"{name}\n")

        target = folder / "OTB" / f"Made{i}"
        write_images(target / "img", picture, n, 4)
        (target / "groundtruth_rect.txt").write_text(
            text(toolkits.truth(i, absent=False) + from_one)
        )

        target = folder / "vot" / "sequences" / f"made{i}"
        write_images(target / "color", picture, n, 8)
        (target / "groundtruth.txt").write_text(text(regions(i)))
        (target / "sequence").write_text(
            f"name=made{i}\nfps=25\nformat=default\nchannels.color=color/%08d.jpg\n"
        )
        with (target.parent / "list.txt").open("a") as file:
            file.write(f"made{i}\n")
    (folder / "vot" / "stack.yaml").write_text(STACK)
    (folder / "vot" / "config.yaml").write_text("registry:\n- .\nstack: stack.yaml\n")
    fields = "label = made up\nprotocol = traxpython\ncommand = none\n"
    (folder / "vot" / "trackers.ini").write_text(f"[{TRACKER}]\n{fields}")


def write_images(folder, picture, n, digits):
    """Write images that are numbered from 1."""
    folder.mkdir(parents=True)
    for number in range(1, n + 1):
        (folder / f"{number:0{digits}}.jpg").write_bytes(picture)


def regions(i):
    """Return rows of VOT's ground truth: boxes with an absence, or polygons."""
    boxes = toolkits.truth(i)
    if i < 2:
        return boxes
    points = boxes[:, None, :2] + CORNERS * boxes[:, None, 2:]
    return np.round(points.reshape(len(points), -1), 2)


def record_got10k(folder):
    """Return the report of got10k on the files for GOT-10k and OTB."""
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
    """Return scores of the command `vot analysis`."""
    options = ["--workspace", str(folder / "vot"), "--format", "json", "--name", "scores"]
    subprocess.run([sys.executable, "-m", "vot", "analysis", *options, TRACKER], check=True)
    results = json.loads((folder / "vot" / "analysis" / "scores.json").read_text())["results"]
    (accuracy, failures, (robustness, _), _), *_ = results["baseline"]["results"][0]
    precision, recall, f = results["longterm"]["results"][2][0]
    return {
        "files": digest(folder / "vot" / "results" / TRACKER),
        "baseline": {"accuracy": accuracy, "failures": failures, "robustness": robustness},
        "eao": results["baseline"]["results"][1][0][0],
        "longterm": {"precision": precision, "recall": recall, "f": f},
    }


EXPERIMENTS = {
    "got10k": ("got10k", "", "GOT-10k", "results/GOT-10k"),
    "otb": ("otb", "", "OTB", "results/OTBmade"),
    "baseline": ("vot", "baseline", "vot/sequences", "vot/results"),
    "longterm": ("vot", "longterm", "vot/sequences", "vot/results"),
}
"""Format, subfolder of a tracker's folder, data and target of the export, by experiment."""


def export(folder, trackmark):
    """Import random boxes for the data sets and export them with commands, `trackmark(*words)`."""
    from trackmark.bench import exchange
    from trackmark.bench.exchange.result_format import ResultRows

    def write_input(kind, name, repetition, rows, subfolder=""):
        target = folder / "input" / kind / subfolder
        texts = exchange.find_format(kind).write(target, name, repetition, rows)
        for path, words in texts.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(words)

    from_one = np.array([1, 1, 0, 0])
    for i in SEQUENCES:
        for run in range(2):
            boxes = toolkits.estimate(i, run)
            write_input("got10k", f"GOT-10k_Val_{i + 1:06}", run, ResultRows(boxes + from_one))
            write_input("vot", f"made{i}", run, ResultRows(boxes, states=toolkits.states(i, run)))
        write_input("otb", f"Made{i}", 0, ResultRows(toolkits.estimate(i) + from_one))
        confidence = np.r_[np.nan, toolkits.confidence(i)[1:]]
        write_input("vot", f"made{i}", 0, ResultRows(toolkits.estimate(i), confidence))
    for name, (kind, subfolder, data, target) in EXPERIMENTS.items():
        results = f"{TRACKER}={kind}:{folder / 'input' / kind / subfolder}"
        where = ("--sequences", folder / data, "--name", name, "--results-root", folder / "stored")
        trackmark("results", "import", results, *where)
        how = ["--protocol", "supervised"] if name == "baseline" else []
        trackmark(
            "results", "export", folder / "stored" / name, folder / target, "--as", kind, *how
        )


def picture():
    """Return a uniform JPEG of the size of the images."""
    import cv2

    return cv2.imencode(".jpg", np.zeros((HEIGHT, WIDTH, 3), np.uint8))[1].tobytes()


def main(folder, tool=""):
    """Write the files, or record the scores that a toolkit computes from them."""
    folder = Path(folder).resolve()
    if not tool:
        program = Path(sys.executable).with_name("trackmark")
        write_data_sets(folder, picture())
        export(folder, lambda *words: subprocess.run([program, *map(str, words)], check=True))
        return
    scores = record_got10k(folder) if tool == "got10k" else record_vot(folder)
    words = json.dumps(scores, default=float, sort_keys=True)
    (HERE / f"toolkit_files_{tool}.json").write_text(f"{words}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
