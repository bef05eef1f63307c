"""Time of a rendered frame; `make bench` prints it."""

from time import thread_time

import numpy as np
import pytest
import simplejpeg

from trackmark import datasets
from trackmark.datasets.synthetic import plain

KNOBS = {
    "default": {},
    "occluded, blurred": {"occlusion": "0.7", "blur": "0.5", "scene": "1"},
    "everything": {
        "occlusion": "0.7",
        "blur": "0.5",
        "clutter": "10",
        "speed": "5",
        "pan": "3",
        "light": "0.5",
        "scale": "1.5",
        "scene": "2",
    },
}
WALKING = ["multipart/1:light=dappled", "multipart/6:light=dappled", "stress/twin"]
SIZES = {"320x240": {}, "640x480": {"width": "640", "height": "480"}}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("parameters", KNOBS)
def test_a_frame_is_rendered(benchmark, parameters, size):
    sequence = plain.SUITE.load("plain/target", {**KNOBS[parameters], **SIZES[size]})
    sequence[0]  # textures are made once
    assert benchmark(lambda: sequence[40]).shape[0] == (480 if size == "640x480" else 240)


def test_a_rendered_frame_costs_less_than_three_decoded_ones():
    """Rendering is no reason to store images: about 1.5 times a JPEG decoder's time."""
    sequence = plain.SUITE.load("plain/target", SIZES["640x480"])
    jpeg = simplejpeg.encode_jpeg(np.ascontiguousarray(sequence[0]), 90, "BGR")
    rendered, decoded = [], []
    for frame in range(60):
        start = thread_time()
        sequence[frame]
        between = thread_time()
        simplejpeg.decode_jpeg(jpeg, "BGR")
        rendered.append(between - start)
        decoded.append(thread_time() - between)
    assert np.median(rendered) < 3 * np.median(decoded)


@pytest.mark.parametrize("name", WALKING)
def test_a_frame_of_a_walking_scene_is_rendered(benchmark, name):
    sequence = datasets.load(name)
    middle = len(sequence) // 2
    sequence[middle]  # textures are made once
    assert benchmark(lambda: sequence[middle]).shape == (480, 640, 3)
