"""Time of a rendered frame; `make bench` prints it."""

from time import thread_time

import numpy as np
import pytest
import simplejpeg

from trackmark import datasets

LARGE = "plain/target:width=640:height=480"
HARD = "occlusion=0.7:blur=0.5:clutter=10:speed=5:pan=3:light=0.5:scale=1.5:scene=2"
SEQUENCES = ["plain/target", LARGE, f"plain/target:{HARD}", f"{LARGE}:{HARD}"]
SEQUENCES += ["multipart/1:light=dappled", "multipart/6:light=dappled", "stress/twin"]


@pytest.mark.parametrize("text", SEQUENCES)
def test_rendering_time(benchmark, text):
    sequence = datasets.load(text)
    middle = len(sequence) // 2
    sequence[middle]  # create textures
    assert benchmark(lambda: sequence[middle]).shape == (*sequence.image_size[::-1], 3)


def test_rendering_takes_less_than_decoding_three_jpegs():
    sequence = datasets.load(LARGE)
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
