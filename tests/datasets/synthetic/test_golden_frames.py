"""Frames as they were when they were last looked at.

A change here changes every result on these sequences. If it is meant, look at the pictures
and write the file anew: `python tests/datasets/synthetic/test_golden_frames.py`.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import datasets

FILE = Path(__file__).with_name("golden_frames.json")
SEQUENCES = (
    "plain/target",
    "plain/target:height=480:scene=1:width=640",
    "plain/target:noise=0:scene=2",
    "plain/target:light=0.6:scene=3",
    "plain/target:clutter=5:scene=4:speed=5",
    "plain/target:occlusion=0.7:scene=5",
    "plain/target:absence=20:blur=0.8:pan=6:scene=6:speed=9",
    "plain/target:scale=2.5:scene=7",
    "plain/target:blur=0.5:scale=0.4:scene=8",
    "multipart/1",
    "multipart/3:light=dappled:scene=1",
    "multipart/5",
    "multipart/7:light=dappled:scene=2",
    "stress/twin:distance=1:twin=other",
    "nummiaro2003/person",
    "nummiaro2003/person:light=dappled:scene=2:start=empty",
    "nummiaro2003/car",
    "nummiaro2003/car:light=dappled:scene=1",
    "nummiaro2003/students",
    "nummiaro2003/students:light=dappled:scene=1:tree=3",
    "nummiaro2003/traffic",
    "nummiaro2003/traffic:light=dappled:scene=1",
    "nummiaro2003/head",
    "nummiaro2003/head:light=lamps:scene=1",
    "wang2010/table-tennis",
    "wang2010/table-tennis:scene=3",
    "wang2010/hand",
    "wang2010/hand:background=plain:scene=1",
    "wang2010/cup",
    "wang2010/cup:background=plain:scene=1",
    "nguyen2002/clip-01",
    "nguyen2002/clip-04",
    "nguyen2002/clip-05:scene=1",
    "nguyen2002/clip-17:scene=2",
    "nguyen2002/lights",
    "nguyen2002/lights:lamps=coloured:scene=1",
    "moreno2005/ellipse",
    "moreno2005/ellipse:clutter=moderate",
    "moreno2005/ellipse:light=jump:scene=1",
    "moreno2005/ellipse:light=repeated:scene=2",
    "moreno2005/ellipse:light=shadow:scene=3",
    "moreno2005/octopus",
    "moreno2005/octopus:scene=1",
    "moreno2005/book",
    "moreno2005/book:illuminant=constant:scene=1:shadow=none",
    "moreno2005/leaf",
    "moreno2005/leaf:jump=middle:scene=1",
)
SLOW = {
    name
    for name in SEQUENCES
    if ":" in name and name.partition("/")[0] in ("nummiaro2003", "wang2010", "nguyen2002")
} | {
    "moreno2005/book:illuminant=constant:scene=1:shadow=none",
    "moreno2005/octopus:scene=1",
    "nguyen2002/lights",
}
"""Further scenes of what is tested every day by one."""


def digest(sequence):
    """Checksum of images and masks, and of the truth."""
    n = len(sequence)
    frames = (0, 41, 60, 119) if n == 120 else (0, n // 2, n - 1)
    images = hashlib.sha256()
    for frame in frames:
        images.update(sequence[frame].tobytes() + sequence.mask(frame).tobytes())
    columns = [sequence.boxes, sequence.visibility, *sequence.regions.values()]
    truth = np.column_stack(columns).round(6) + 0.0
    return {
        "images": images.hexdigest()[:32],
        "truth": hashlib.sha256(truth.tobytes()).hexdigest()[:32],
        "thumbnails": [thumbnail(sequence[frame]).tolist() for frame in frames],
    }


def thumbnail(image):
    """Mean colours of 4 x 4 tiles: tells a changed picture from a changed last bit."""
    height, width = (side // 4 for side in image.shape[:2])
    tiles = image[: 4 * height, : 4 * width].reshape(4, height, 4, width, 3).mean(axis=(1, 3))
    return tiles.round(1).reshape(-1)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in SEQUENCES],
)
def test_frames_and_truth_are_those_that_were_stored(name):
    stored, found = json.loads(FILE.read_text())[name], digest(datasets.load(name))
    difference = np.abs(np.subtract(stored["thumbnails"], found["thumbnails"])).max()
    assert difference < 0.5, f"the pictures changed, tiles by up to {difference:.1f} grey levels"
    assert found["truth"] == stored["truth"], "the truth changed, though the pictures look alike"
    assert found["images"] == stored["images"], (
        "the pictures look alike but differ in their bytes: another platform's arithmetic, or a "
        "small change of the renderer"
    )


def test_the_stored_names_are_canonical_and_all_are_tested():
    assert [datasets.load(name).name for name in SEQUENCES] == list(SEQUENCES)
    assert list(json.loads(FILE.read_text())) == list(SEQUENCES)


if __name__ == "__main__":
    golden = {name: digest(datasets.load(name)) for name in SEQUENCES}
    FILE.write_text(
        "{\n" + ",\n".join(f'"{k}": {json.dumps(v)}' for k, v in golden.items()) + "\n}\n"
    )
