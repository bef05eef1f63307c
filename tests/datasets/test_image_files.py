"""Decoding of image files."""

import re
import struct
import zlib
from io import BytesIO
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage

from trackmark.datasets import SequenceError
from trackmark.datasets.image_files import ImageFiles, decode_image, image_files, image_size

SMOOTH = cv2.GaussianBlur(
    np.random.default_rng(0).integers(0, 255, (40, 60, 3), dtype=np.uint8), (0, 0), 3
)


def encoded(suffix, image=SMOOTH):
    return cv2.imencode(suffix, image)[1].tobytes()


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".ppm", ".tif"])
def test_lossless_format_is_decoded_as_8_bits_without_alpha(suffix):
    np.testing.assert_array_equal(decode_image(encoded(suffix)), SMOOTH)
    if suffix in (".png", ".tif"):
        grey = decode_image(encoded(suffix, SMOOTH[..., 0]))
        np.testing.assert_array_equal(grey, np.dstack([SMOOTH[..., 0]] * 3))
        image = decode_image(encoded(suffix, SMOOTH.astype(np.uint16) * 256 + 77))
        np.testing.assert_array_equal(image, SMOOTH)
        transparent = np.dstack([SMOOTH, np.zeros((40, 60), np.uint8)])
        np.testing.assert_array_equal(decode_image(encoded(suffix, transparent)), SMOOTH)


def test_jpeg_is_decoded_as_by_opencv():
    data = encoded(".jpg")
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(decode_image(data), expected)
    grey = decode_image(encoded(".jpg", SMOOTH[..., 0]))
    assert grey.shape == (40, 60, 3)
    assert (grey == grey[..., :1]).all()


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".ppm", ".tif"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.95])
def test_truncated_file_is_refused(suffix, share):
    data = encoded(suffix)
    with pytest.raises(ValueError, match=r"\w"):
        decode_image(data[: int(len(data) * share)])


def test_image_files_are_in_natural_order(tmp_path, write_images):
    write_images(tmp_path, ["img10.png", "img9.png", "img1.JPG", "img09b.bmp", "a2b10.png"])
    for other in ("notes.txt", "._img1.png", "Thumbs.db"):
        (tmp_path / other).write_text("")
    names = [file.name for file in image_files(tmp_path)]
    assert names == ["a2b10.png", "img1.JPG", "img9.png", "img09b.bmp", "img10.png"]


def test_damaged_and_missing_images_are_named(tmp_path, write_images):
    images = write_images(tmp_path, ["1.png", "2.jpg", "3.png"])
    data = (tmp_path / "2.jpg").read_bytes()
    (tmp_path / "2.jpg").write_bytes(data[: len(data) // 2])
    frames = ImageFiles(image_files(tmp_path))
    with pytest.raises(SequenceError, match=r"2\.jpg: frame 1 cannot be read .* Download the file"):
        frames[1]
    np.testing.assert_array_equal(frames[2], images[2])
    (tmp_path / "1.png").unlink()
    with pytest.raises(SequenceError, match=r"1\.png: frame 0 cannot be read"):
        frames[0]


def claiming(suffix, width, height):
    """Return an image whose header states another size."""
    data = bytearray(encoded(suffix))
    if suffix == ".png":
        head = b"IHDR" + struct.pack(">II", width, height) + bytes(data[24:29])
        data[12:33] = head + struct.pack(">I", zlib.crc32(head))
    elif suffix == ".bmp":
        data[18:26] = struct.pack("<ii", width, height)
    elif suffix == ".ppm":
        data = data.replace(b"60 40", f"{width} {height}".encode())
    elif suffix == ".jpg":
        start = data.index(b"\xff\xc0")
        data[start + 5 : start + 9] = struct.pack(">HH", height, width)
    else:  # two entries of the TIFF directory: tag, type, count, value
        for tag, value in ((256, width), (257, height)):
            entry = re.search(struct.pack("<H", tag) + b"[\3\4]\0\1\0\0\0", data)
            data[entry.start() + 2 : entry.start() + 12] = struct.pack("<HII", 4, 1, value)
    return bytes(data)


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".ppm", ".tif"])
def test_header_with_too_many_pixels_is_refused(tmp_path, suffix, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", lambda *args: pytest.fail("decoded"))
    monkeypatch.setattr("simplejpeg.decode_jpeg", lambda *args: pytest.fail("decoded"))
    (tmp_path / f"1{suffix}").write_bytes(claiming(suffix, 60000, 60000))
    frames = ImageFiles(image_files(tmp_path))
    with pytest.raises(SequenceError, match=r"1\.\w+: frame 0 .*60000x60000 .*MOST_PIXELS"):
        frames[0]


def with_long_chunk(data):
    """Return a PNG file with a chunk that claims a length of 1 GiB."""
    return data[:-12] + struct.pack(">I", 1 << 30) + b"tEXt" + data[-12:]


def with_many_bits(data):
    """Return a PNG file that claims the maximum number of pixels with four 16-bit channels."""
    head = b"IHDR" + struct.pack(">IIBB", 10_000, 10_000, 16, 6) + bytes(data[26:29])
    return data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]


@pytest.mark.parametrize(
    ("suffix", "change", "message"),
    [
        (".png", with_long_chunk, "longer than the file"),
        (".png", lambda data: data[:12] + b"NONE" + data[16:], "not an image"),
        (
            ".png",
            with_many_bits,
            "10000x10000 pixels with up to 8 bytes each; the maximum is 600000000 bytes",
        ),
        (".tif", lambda data: claiming(".tif", 9000, 9000), "up to 32 bytes"),
        (".png", lambda data: b"", "not an image"),
    ],
)
def test_small_file_that_needs_much_memory_is_refused(suffix, change, message, monkeypatch):
    data = encoded(suffix)
    assert decode_image(data).shape == (40, 60, 3)
    monkeypatch.setattr(cv2, "imdecode", lambda *args: pytest.fail("decoded"))
    with pytest.raises(ValueError, match=message):
        decode_image(change(data))


def test_pixel_limit_is_a_variable(monkeypatch):
    data = encoded(".png")
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "2400")
    assert decode_image(data).shape == (40, 60, 3)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "2399")
    with pytest.raises(ValueError, match="60x40 pixels; the maximum is 2399"):
        decode_image(data)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "many")
    with pytest.raises(SequenceError, match="TRACKMARK_MOST_PIXELS is 'many'"):
        decode_image(data)


def test_lack_of_memory_names_the_file(tmp_path, write_images, monkeypatch):
    write_images(tmp_path, ["1.png", "2.jpg"])
    no_memory = cv2.error("Failed to allocate 99 bytes")
    no_memory.code = cv2.Error.StsNoMem
    monkeypatch.setattr(cv2, "imdecode", Mock(side_effect=no_memory))
    monkeypatch.setattr("simplejpeg.decode_jpeg", Mock(side_effect=MemoryError))
    frames = ImageFiles(image_files(tmp_path))
    for i in range(2):
        with pytest.raises(
            SequenceError, match=rf"{i + 1}\.\w+: frame {i} .*more memory than is available"
        ):
            frames[i]


def test_programming_error_is_not_reported_as_damage(tmp_path, write_images, monkeypatch):
    write_images(tmp_path, ["0.jpg"])
    monkeypatch.setattr("simplejpeg.decode_jpeg_header", Mock(side_effect=TypeError("keyword")))
    with pytest.raises(TypeError, match="keyword"):
        ImageFiles(image_files(tmp_path))[0]


def tiff(values, orientation, *, big_tiff=False):
    """Return TIFF data of RGB or grey pixels with an orientation tag."""
    buffer = BytesIO()
    image = PillowImage.fromarray(values)
    image.save(buffer, "TIFF", tiffinfo={274: orientation}, big_tiff=big_tiff)
    return buffer.getvalue()


@pytest.mark.parametrize("orientation", range(1, 9))
def test_tiff_is_decoded_as_stored(orientation):
    colour = tiff(SMOOTH[..., ::-1], orientation)
    grey, grey_16 = SMOOTH[..., 0], SMOOTH[..., 0].astype(np.uint16) * 256
    three_channels = np.dstack([grey] * 3)
    assert image_size(colour) == (60, 40)
    np.testing.assert_array_equal(decode_image(colour), SMOOTH)
    np.testing.assert_array_equal(decode_image(tiff(grey, orientation)), three_channels)
    np.testing.assert_array_equal(decode_image(tiff(grey_16, orientation)), three_channels)
    in_big_endian = tiff(grey_16.astype(">u2"), orientation)
    assert in_big_endian.startswith(b"MM")
    np.testing.assert_array_equal(decode_image(in_big_endian), three_channels)
    big_tiff = tiff(SMOOTH[..., ::-1], orientation, big_tiff=True)
    assert big_tiff[2] == 43
    assert image_size(big_tiff) == (60, 40)
    np.testing.assert_array_equal(decode_image(big_tiff), SMOOTH)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_not_applied(suffix, orientation):
    buffer = BytesIO()
    exif = PillowImage.Exif()
    exif[274] = orientation
    kind = "JPEG" if suffix == ".jpg" else "PNG"
    PillowImage.fromarray(SMOOTH[..., ::-1]).save(buffer, kind, exif=exif.tobytes(), quality=95)
    image = decode_image(buffer.getvalue())
    assert image.shape == SMOOTH.shape
    assert np.abs(image.astype(int) - SMOOTH).mean() < 4
