"""Estimates of trackers without a base class: equal results for all ways in."""

import sys
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

import trackmark
from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.external.definition import open_external

pytestmark = pytest.mark.usefixtures("folder")

TRACKER = """
import numpy as np
class Tracker:
    def init(self, image, box):
        self.box, self.frame = box, 0
    def update(self, image):
        self.frame += 1
        self.box = np.array(self.box) + 1
        return ANSWER if self.frame == 4 else self.box
"""
WAYS_IN = {
    "class": "tracker.py",
    "python": f"tracker.py:python={sys.executable}",
    "table": "trackers.toml:table",
}


def runs(folder, answer):
    """Return the run of a tracker whose fourth estimate is the answer, by each way in."""
    (folder / "tracker.py").write_text(TRACKER.replace("ANSWER", answer))
    (folder / "trackers.toml").write_text('[table]\nfile = "tracker.py"\n')
    results = {way: evaluate_run(text, "Noise") for way, text in WAYS_IN.items()}
    namespace = {}
    exec((folder / "tracker.py").read_text(), namespace)  # a class without a file
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of failed runs
        (results["evaluate"],) = trackmark.evaluate(namespace["Tracker"], "Noise").values()
    return results


@pytest.mark.parametrize("answer", ["None", "{'box': [0, 0, 0, 0], 'visible': True}"])
def test_frame_without_a_box_is_not_visible(folder, answer):
    for way, run in runs(folder, answer).items():
        assert not run.failure, way
        assert run.visible.tolist() == [True] * 4 + [False] + [True] * 3
        assert run.boxes[4].tolist() == run.boxes[3].tolist()
        assert run.boxes[5].tolist() == (run.boxes[3] + 2).tolist()


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("(True, self.box)", "This looks like (ok, box)"),
        ("{'box': self.box, 'details': {'map': np.zeros((5, 5))}}", "details['map'] is an array"),
        ("{'box': self.box, 'mask': np.full((24, 32), 255, 'u1')}", "the mask is uint8 of shape"),
    ],
)
def test_malformed_estimate_fails_equally(folder, answer, reason):
    for way, run in runs(folder, answer).items():
        first = run.failure.partition("\n")[0]
        assert first.startswith("0005.png: "), way
        assert reason in first, way


ZEROS = """
print('@@TRAX:hello "trax.version=3" "trax.image=path" "trax.region=rectangle"', flush=True)
import sys
n = 0
for line in sys.stdin:
    if line.startswith("@@TRAX:initialize"):
        region = line.split('"')[3]
    if "quit" in line:
        break
    print('@@TRAX:state "' + (ANSWER if n == 4 else region) + '"', flush=True)
    n += 1
"""


@pytest.mark.parametrize("answer", ["0.0000,0.0000,0.0000,0.0000", "0"])
def test_empty_region_of_vot_is_not_visible(folder, answer):
    (folder / "zeros.py").write_text(ZEROS.replace("ANSWER", repr(answer)))
    run = evaluate_run(f"trax:command={sys.executable} zeros.py:as=mine", "Noise")
    assert not run.failure
    assert run.visible.tolist() == [True] * 4 + [False] + [True] * 3
    assert (run.boxes == run.boxes[0]).all()


SEEING = """
class Seeing:
    def init(self, image, box): self.box = box
    def update(self, image):
        pixel = image[0, 0].tolist() if image.ndim == 3 else [int(image[0, 0])] * 3
        return {"box": self.box, "details": dict(zip("abc", pixel))}
"""


@pytest.mark.parametrize("images", ["rgb", "grey"])
def test_images_have_the_channels_of_the_definition(folder, images):
    (folder / "seeing.py").write_text(SEEING)
    (folder / "declared.py").write_text(SEEING.replace(":", f":\n    images = {images!r}", 1))
    (folder / "trackers.toml").write_text(f'[mine]\nfile = "seeing.py"\nimages = "{images}"\n')
    sequence = datasets.load("Noise")
    code = cv2.COLOR_BGR2RGB if images == "rgb" else cv2.COLOR_BGR2GRAY
    expected = np.resize(cv2.cvtColor(sequence[1], code)[0, 0], 3).tolist()
    option = f":images={images}"
    python = f":python={sys.executable}"
    labels = {
        f"seeing.py:images={images}": f"seeing.py:Seeing{option}",
        f"seeing.py{python}:images={images}": f"seeing.py:Seeing{option}",
        "declared.py": "declared.py:Seeing",
        f"declared.py{python}": "declared.py:Seeing",
        "trackers.toml:mine": f"mine{option}",
    }
    for text, label in labels.items():
        run = evaluate_run(text, "Noise")
        assert run.identity.tracker == label
        assert [run.details[name][1] for name in "abc"] == expected, text


def test_images_of_a_trax_tracker_are_refused(folder):
    table = "command = python3 plain.py\nprotocol = trax\nimages = rgb\n"
    Path("trackers.ini").write_text(f"[mine]\n{table}")
    Path("trackers.toml").write_text('[mine]\ntrax = "python3 plain.py"\nimages = "rgb"\n')
    texts = ["trackers.ini:mine", "trackers.toml:mine"]
    for text in texts:
        with pytest.raises(trackmark.trackers.TrackerError, match="Omit images, and convert"):
            open_external(text, {})


def test_empty_command_is_an_error():
    Path("trackers.toml").write_text('[mine]\ntrax = "  "\n')
    with pytest.raises(trackmark.trackers.TrackerError, match="names no program"):
        open_external("trackers.toml:mine", {})
