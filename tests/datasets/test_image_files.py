"""Images in files."""

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
def test_lossless_files_give_their_pixels_back(suffix):
    np.testing.assert_array_equal(decode_image(encoded(suffix)), SMOOTH)


def test_a_jpeg_is_decoded_as_opencv_decodes_it():
    data = encoded(".jpg")
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(decode_image(data), expected)


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".tif"])
def test_grey_images_get_three_equal_channels(suffix):
    image = decode_image(encoded(suffix, SMOOTH[..., 0]))
    assert image.shape == (40, 60, 3)
    assert (image == image[..., :1]).all()


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_of_16_bits_the_upper_eight_are_kept(suffix):
    image = decode_image(encoded(suffix, SMOOTH.astype(np.uint16) * 256 + 77))
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, SMOOTH)


def test_alpha_is_dropped():
    transparent = np.dstack([SMOOTH, np.zeros((40, 60), np.uint8)])
    np.testing.assert_array_equal(decode_image(encoded(".png", transparent)), SMOOTH)


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".ppm", ".tif"])
@pytest.mark.parametrize("kept", [0.0, 0.3, 0.6, 0.95])
def test_a_file_cut_short_is_an_error(suffix, kept):
    data = encoded(suffix)
    with pytest.raises(ValueError, match=r"\w"):
        decode_image(data[: int(len(data) * kept)])


def test_names_are_in_natural_order_and_others_are_left_out(tmp_path, write_images):
    write_images(tmp_path, ["img10.png", "img9.png", "img1.JPG", "img09b.bmp", "a2b10.png"])
    for other in ("notes.txt", "._img1.png", "Thumbs.db"):
        (tmp_path / other).write_text("")
    names = [file.name for file in image_files(tmp_path)]
    assert names == ["a2b10.png", "img1.JPG", "img9.png", "img09b.bmp", "img10.png"]


def test_a_folder_of_bare_numbers_is_in_the_order_of_the_numbers(tmp_path, write_images):
    write_images(tmp_path, [f"{i}.png" for i in range(12)])
    assert [int(file.stem) for file in image_files(tmp_path)] == list(range(12))


def test_a_damaged_image_is_named_with_its_frame_and_the_others_can_be_read(tmp_path, write_images):
    images = write_images(tmp_path, ["1.png", "2.jpg", "3.png"])
    data = (tmp_path / "2.jpg").read_bytes()
    (tmp_path / "2.jpg").write_bytes(data[: len(data) // 2])
    frames = ImageFiles(image_files(tmp_path))
    with pytest.raises(SequenceError, match=r"2\.jpg: frame 1 can't be read .* Get the file anew"):
        frames[1]
    np.testing.assert_array_equal(frames[2], images[2])


def test_a_file_that_went_away_is_named(tmp_path, write_images):
    write_images(tmp_path, ["1.png", "2.png"])
    frames = ImageFiles(image_files(tmp_path))
    (tmp_path / "2.png").unlink()
    with pytest.raises(SequenceError, match=r"2\.png: frame 1 can't be read"):
        frames[1]


def claiming(suffix, width, height):
    """An image whose header claims another size."""
    data = bytearray(encoded(suffix))
    if suffix == ".png":
        head = b"IHDR" + struct.pack(">II", width, height) + bytes(data[24:29])
        data[12:33] = head + struct.pack(">I", zlib.crc32(head))
    elif suffix == ".bmp":
        data[18:26] = struct.pack("<ii", width, height)
    elif suffix == ".ppm":
        data = data.replace(b"60 40", f"{width} {height}".encode())
    elif suffix == ".jpg":
        at = data.index(b"\xff\xc0")
        data[at + 5 : at + 9] = struct.pack(">HH", height, width)
    else:  # two entries of TIFF's directory: tag, type, count, value
        for tag, value in ((256, width), (257, height)):
            entry = re.search(struct.pack("<H", tag) + b"[\3\4]\0\1\0\0\0", data)
            data[entry.start() + 2 : entry.start() + 12] = struct.pack("<HII", 4, 1, value)
    return bytes(data)


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".ppm", ".tif"])
def test_an_image_that_claims_too_many_pixels_is_refused_by_its_header(
    tmp_path, suffix, monkeypatch
):
    monkeypatch.setattr(cv2, "imdecode", lambda *args: pytest.fail("it was decoded"))
    monkeypatch.setattr("simplejpeg.decode_jpeg", lambda *args: pytest.fail("it was decoded"))
    (tmp_path / f"1{suffix}").write_bytes(claiming(suffix, 60000, 60000))
    frames = ImageFiles(image_files(tmp_path))
    with pytest.raises(SequenceError, match=r"1\.\w+: frame 0 .*60000x60000 .*MOST_PIXELS"):
        frames[0]


def long_part(data):
    """A PNG file with a part before its end that says to be of a gigabyte."""
    return data[:-12] + struct.pack(">I", 1 << 30) + b"tEXt" + data[-12:]


def without_head(data):
    return data[:12] + b"NONE" + data[16:]


def of_many_bits(data):
    """A PNG file that claims as many pixels as may be, of four samples of 16 bits."""
    head = b"IHDR" + struct.pack(">IIBB", 10_000, 10_000, 16, 6) + bytes(data[26:29])
    return data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]


@pytest.mark.parametrize(
    ("suffix", "harm", "words"),
    [
        (".png", long_part, "longer than the file"),
        (".png", without_head, "not an image"),
        (".png", of_many_bits, "10000x10000 pixels, too many where one may have 8 bytes"),
        (".tif", lambda data: claiming(".tif", 9000, 9000), "may have 32 bytes"),
        (".png", lambda data: b"", "not an image"),
    ],
)
def test_no_room_is_made_for_what_a_small_file_claims(suffix, harm, words, monkeypatch):
    data = encoded(suffix)
    assert decode_image(data).shape == (40, 60, 3)
    monkeypatch.setattr(cv2, "imdecode", lambda *args: pytest.fail("it was decoded"))
    with pytest.raises(ValueError, match=words):
        decode_image(harm(data))


def test_how_many_pixels_are_decoded_is_a_parameter(monkeypatch):
    data = encoded(".png")
    assert decode_image(data, most_pixels=2400).shape == (40, 60, 3)
    with pytest.raises(ValueError, match="60x40 pixels, more than the 2399"):
        decode_image(data, most_pixels=2399)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "2399")
    with pytest.raises(ValueError, match="60x40 pixels, more than the 2399"):
        decode_image(data)
    monkeypatch.setenv("TRACKMARK_MOST_PIXELS", "many")
    with pytest.raises(SequenceError, match="TRACKMARK_MOST_PIXELS is 'many'"):
        decode_image(data)


def test_a_lack_of_memory_is_told_in_the_name_of_the_file(tmp_path, write_images, monkeypatch):
    write_images(tmp_path, ["1.png", "2.jpg"])
    no_memory = cv2.error("Failed to allocate 99 bytes")
    no_memory.code = cv2.Error.StsNoMem
    monkeypatch.setattr(cv2, "imdecode", Mock(side_effect=no_memory))
    monkeypatch.setattr("simplejpeg.decode_jpeg", Mock(side_effect=MemoryError))
    frames = ImageFiles(image_files(tmp_path))
    for i in range(2):
        with pytest.raises(
            SequenceError, match=rf"{i + 1}\.\w+: frame {i} .*more memory than there is"
        ):
            frames[i]


def test_error_of_our_own_code_is_not_reported_as_damage(tmp_path, write_images, monkeypatch):
    write_images(tmp_path, ["0.jpg"])
    monkeypatch.setattr("simplejpeg.decode_jpeg_header", Mock(side_effect=TypeError("keyword")))
    with pytest.raises(TypeError, match="keyword"):
        ImageFiles(image_files(tmp_path))[0]


def tiff(values, orientation, *, big_tiff=False):
    """Encode pixels in RGB order, or grey values, with an orientation tag."""
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
