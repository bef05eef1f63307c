"""Decoding of video files."""

import av
import cv2
import numpy as np
import pytest

from trackmark.datasets import SequenceError
from trackmark.datasets.video_frames import VideoFrames

# Containers with codec, number of B-frames and options; their frame times differ.
KINDS = {
    "clip.mp4": ("libx264", 3, ()),
    "open-gop.mp4": ("libx264", 3, (("x264-params", "open-gop=1:b-pyramid=normal"),)),
    "refresh.mp4": ("libx264", 2, (("x264-params", "intra-refresh=1"),)),
    "clip.mkv": ("libx264", 2, ()),
    "no-times.avi": ("libx264", 2, ()),
    "divx.avi": ("mpeg4", 2, ()),
    "plain.avi": ("mpeg4", 0, ()),
    "clip.mpg": ("mpeg2video", 2, ()),
    "clip.webm": ("libvpx-vp9", 0, (("deadline", "realtime"), ("cpu-used", "8"))),
}


def decoded_in_order(path):
    """Decode all frames from the start of the file."""
    with av.open(path) as container:
        return [frame.to_ndarray(format="bgr24") for frame in container.decode(video=0)]


@pytest.fixture(params=KINDS)
def video(request, tmp_path, write_video):
    codec, b_frames, options = KINDS[request.param]
    return write_video(tmp_path / request.param, codec, b_frames=b_frames, options=options)


def test_frames_are_bit_identical_in_any_order(video):
    frames, expected = VideoFrames(video), decoded_in_order(video)
    assert len(frames) == len(expected) == 40
    assert frames.fps == pytest.approx(25)
    for i in [*range(40), 39, 0, 0, *np.random.default_rng(0).permutation(40)]:
        np.testing.assert_array_equal(frames[i], expected[i], err_msg=f"frame {i}")


def test_jump_decodes_from_the_last_key_frame(tmp_path, write_video, monkeypatch):
    opened = []
    open_ = av.open
    video = write_video(tmp_path / "clip.mkv", n=60)
    monkeypatch.setattr(av, "open", lambda *args, **options: opened.append(1) or open_(*args))
    frames = VideoFrames(video)
    for i in range(60):
        frames[i]
    assert len(opened) == 2  # once for the index, once for decoding
    decoded = []
    decode = frames._decode
    monkeypatch.setattr(
        frames, "_decode", lambda key: (decoded.append(1) or frame for frame in decode(key))
    )
    frames[30]
    assert 1 <= len(decoded) <= 12


def test_early_seek_is_decoded_without_reopening(tmp_path, write_video, monkeypatch):
    path = write_video(tmp_path / "clip.mkv")
    expected = decoded_in_order(path)
    opened = []

    class EarlySeek:
        """Container whose seek always ends at the start."""

        def __init__(self, path, **options):
            opened.append(path)
            self.container = open_(path)

        def __enter__(self):
            return self

        def __exit__(self, *error):
            self.container.close()

        def __getattr__(self, name):
            return getattr(self.container, name)

        def seek(self, time, stream):
            self.container.seek(0, stream=stream)

    open_ = av.open
    frames = VideoFrames(path)
    monkeypatch.setattr(av, "open", EarlySeek)
    np.testing.assert_array_equal(frames[30], expected[30])
    assert len(opened) == 1


@pytest.mark.parametrize("video", sorted(KINDS.keys() - {"no-times.avi"}), indirect=True)
def test_opening_decodes_no_frame(video, monkeypatch):
    monkeypatch.setattr(VideoFrames, "_decode", lambda *args: pytest.fail("decoded"))
    assert len(VideoFrames(video)) == 40


@pytest.mark.parametrize("rotation", [90, 180, 270])
def test_rotated_video_is_decoded_upright(tmp_path, write_video, rotation):
    path = write_video(tmp_path / "phone.mp4", rotation=rotation)
    capture = cv2.VideoCapture(str(path))
    _, expected = capture.read()
    capture.release()
    image = VideoFrames(path)[0]
    assert image.shape == expected.shape
    assert image.flags.c_contiguous
    # OpenCV and PyAV round differently in the colour conversion.
    assert np.abs(image.astype(int) - expected).mean() < 3


def overwrite_packet(path, index, byte, from_middle=False):
    """Overwrite the data of a packet, or its second half, with a byte."""
    with av.open(path) as container:
        packet = list(container.demux(video=0))[index]
        start, size = packet.pos, packet.size
    offset = size // 2 if from_middle else 0
    data = bytearray(path.read_bytes())
    data[start + offset : start + size] = byte * (size - offset)
    path.write_bytes(data)


def change_bit(path, index):
    """Change a bit in the first half of a packet."""
    with av.open(path) as container:
        packet = bytes(list(container.demux(video=0))[index])
    data = bytearray(path.read_bytes())
    data[data.find(packet) + len(packet) // 3] ^= 4
    path.write_bytes(data)


def test_damaged_frame_is_refused_up_to_the_next_key_frame(tmp_path, write_video):
    path = write_video(tmp_path / "clip.mp4", b_frames=0)
    expected = decoded_in_order(path)
    overwrite_packet(path, 20, b"\0")
    frames = VideoFrames(path)
    for i in range(20):
        np.testing.assert_array_equal(frames[i], expected[i])
    message = r"clip\.mp4: frame 20 cannot be decoded \(.*\)\. Download the file again"
    with pytest.raises(SequenceError, match=message):
        frames[20]
    for i in (0, 19, 39):  # frame 39 depends on a later key frame
        np.testing.assert_array_equal(frames[i], expected[i])
    with pytest.raises(SequenceError, match="frame 21 cannot be decoded"):
        VideoFrames(path)[21]


@pytest.mark.parametrize(
    ("b_frames", "hit", "filling"),
    [(0, 18, b"\0"), (0, 20, b"\xff"), (2, 18, b"\x5a"), (2, 19, b"\0"), (2, 20, b"\xff")],
)
def test_damaged_frame_is_never_returned(tmp_path, write_video, b_frames, hit, filling):
    path = write_video(tmp_path / "clip.avi", "mpeg4", b_frames=b_frames)
    expected = decoded_in_order(path)
    overwrite_packet(path, hit, filling, from_middle=True)
    frames = VideoFrames(path)
    refused = 0
    for i in range(40):
        try:
            image = frames[i]
        except SequenceError:
            refused += 1
        else:
            np.testing.assert_array_equal(image, expected[i], err_msg=f"frame {i}")
    assert 0 < refused < 20


@pytest.mark.parametrize(
    ("name", "codec", "options"),
    [
        ("checksums.mkv", "ffv1", {}),  # FFmpeg logs a wrong checksum and returns the frame
        ("hashes.mp4", "libx265", {"x265-params": "hash=1:log-level=none"}),
    ],
)
def test_damage_that_a_checksum_shows_is_refused(tmp_path, write_video, name, codec, options):
    path = write_video(tmp_path / name, codec, n=15, b_frames=0, options=options)
    expected = decoded_in_order(path)
    np.testing.assert_array_equal(VideoFrames(path)[14], expected[14])
    change_bit(path, 13)
    frames = VideoFrames(path)
    np.testing.assert_array_equal(frames[12], expected[12])
    for _ in range(2):  # FFmpeg does not log the same error twice, unless told to
        with pytest.raises(SequenceError, match=r"frame 13 cannot be decoded"):
            frames[13]


@pytest.mark.parametrize("hit", [21, 24, 35])
def test_damaged_file_without_times_is_refused(tmp_path, write_video, hit):
    path = write_video(tmp_path / "no-times.avi")
    overwrite_packet(path, hit, b"\xff", from_middle=True)
    with pytest.raises(SequenceError, match=r"no-times\.avi: cannot be read as video"):
        VideoFrames(path)


def test_file_without_first_key_frame_starts_at_the_next(tmp_path, write_video):
    whole = write_video(tmp_path / "whole.mkv", b_frames=0)
    expected = decoded_in_order(whole)
    with av.open(whole) as source, av.open(tmp_path / "cut.mkv", "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for i, packet in enumerate(source.demux(video=0)):
            if i >= 5 and packet.size:
                packet.stream = stream
                target.mux(packet)
    frames = VideoFrames(tmp_path / "cut.mkv")
    assert len(frames) == 35
    with pytest.raises(SequenceError, match="frame 2 cannot be decoded"):
        frames[2]
    np.testing.assert_array_equal(frames[34], expected[39])


def test_truncated_file_has_the_remaining_frames(tmp_path, write_video):
    path = write_video(tmp_path / "clip.mkv")
    expected = decoded_in_order(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    frames = VideoFrames(path)
    assert 5 < len(frames) < 40
    np.testing.assert_array_equal(frames[5], expected[5])


@pytest.mark.parametrize("content", [b"", b"not a video", bytes(5000)])
def test_file_without_video_data_is_refused(tmp_path, content):
    path = tmp_path / "clip.mp4"
    path.write_bytes(content)
    with pytest.raises(SequenceError, match=r"clip\.mp4: cannot be read as video"):
        VideoFrames(path)


def test_file_with_only_sound_is_refused(tmp_path):
    path = tmp_path / "sound.mkv"
    with av.open(path, "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), "s16", "mono")
        frame.rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(SequenceError, match=r"sound\.mkv: the file contains no video"):
        VideoFrames(path)


def test_title_in_latin_1_is_accepted(tmp_path, write_video):
    path = write_video(tmp_path / "clip.avi", "mpeg4", n=3, title="Caf~ du port")
    expected = decoded_in_order(path)
    path.write_bytes(path.read_bytes().replace(b"Caf~", "Café".encode("latin-1")))
    np.testing.assert_array_equal(VideoFrames(path)[2], expected[2])


def test_video_opens_without_keywords_since_pyav_19(tmp_path, write_video, monkeypatch):
    path = write_video(tmp_path / "clip.mp4", n=3)
    open_ = av.open
    monkeypatch.setattr(av, "__version__", "19.0.0")
    monkeypatch.setattr(av, "open", lambda file: open_(file))
    assert len(VideoFrames(path)) == 3
    monkeypatch.setattr(av, "__version__", "18.0.0")
    with pytest.raises(TypeError, match="unexpected keyword"):  # not reported as damage
        VideoFrames(path)


def test_unknown_codec_is_refused_with_a_remedy(tmp_path, write_video):
    path = write_video(tmp_path / "clip.avi", "mpeg4", n=3)
    path.write_bytes(path.read_bytes().replace(b"FMP4", b"ZZZZ"))
    with pytest.raises(SequenceError, match=r"clip\.avi: there is no decoder .* Convert the video"):
        VideoFrames(path)


def test_video_with_too_many_pixels_is_not_decoded(tmp_path, write_video, monkeypatch):
    path = write_video(tmp_path / "clip.mp4", n=3)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", str(128 * 64))
    assert VideoFrames(path)[0].shape == (64, 96, 3)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "6143")
    monkeypatch.setattr(VideoFrames, "_decode", lambda *args: pytest.fail("decoded"))
    with pytest.raises(SequenceError, match=r"clip\.mp4: .* 96x64 pixels; the maximum is 6143"):
        VideoFrames(path)
