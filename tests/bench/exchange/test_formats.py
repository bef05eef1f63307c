"""Round trips and messages of every result format."""

import json
import struct

import numpy as np
import pytest

from tests.bench.exchange.import_builder import import_runs
from trackmark.bench import exchange
from trackmark.bench.exchange.importing import parse_imported_tracker
from trackmark.bench.exchange.result_format import ExchangeError, ResultRows
from trackmark.bench.metrics.interface import FrameState

FRAMES = 12


def digit_boxes(seed=0):
    """Return boxes with many digits, some of them outside of the image."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-9, 90, (FRAMES, 2))
    return np.column_stack([corners, random.uniform(1, 40, (FRAMES, 2))])


def write_results(kind, folder, rows, sequence="Some-one_1", repetition=0):
    texts = exchange.find_format(kind).write(folder, sequence, repetition, rows)
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return list(texts)


def import_tracker(kind, folder, truth, target, messages=None, first_pixel=0):
    on_message = [].append if messages is None else messages.append
    return import_runs(kind, folder, ("Some-one_1", truth), target, on_message, first_pixel)


every_format = pytest.mark.parametrize("kind", exchange.FORMATS)


@every_format
@pytest.mark.parametrize("origin", [0, 1])
def test_round_trip_keeps_boxes_and_format_is_detected(kind, origin, tmp_path):
    boxes, result_format = digit_boxes(), exchange.find_format(kind)
    assert "SEQ" in result_format.expects
    shift = np.array([origin, origin, 0, 0])
    theirs = tmp_path / "theirs"
    write_results(kind, theirs, ResultRows(boxes + shift, update_seconds=0.01))
    messages = []
    (run,) = import_tracker(kind, theirs, boxes, tmp_path / "results", messages, origin)
    expected = result_format.round_boxes(boxes + shift) - shift
    np.testing.assert_array_equal(run.boxes[0], boxes[0])
    np.testing.assert_allclose(run.boxes[1:], expected[1:], rtol=0, atol=1e-9)
    assert not messages
    assert run.metadata["source"] == "/data/Some-one_1"
    # The texts of pysot look like those of OTB.
    assert parse_imported_tracker(f"theirs={theirs}").format == ("otb" if kind == "pysot" else kind)
    assert parse_imported_tracker(f"theirs={kind}:{theirs}").format == kind


TOOLKIT_READERS = {
    # STVIR/pysot, toolkit/datasets/video.py
    "pysot": lambda file: [
        list(map(float, line.strip().split(","))) for line in file.read_text().splitlines()
    ],
    # visionml/pytracking, pytracking/utils/load_text.py
    "pytracking": lambda file: np.loadtxt(file, delimiter="\t", dtype=np.float64),
    # jwlim/tracker_benchmark, scripts/bscripts.py
    "otb-json": lambda file: json.loads(file.read_text())[0]["res"],
}


@pytest.mark.parametrize("kind", TOOLKIT_READERS)
def test_toolkit_code_reads_exported_files(kind, tmp_path):
    (file, *_) = write_results(kind, tmp_path, ResultRows(digit_boxes()))
    expected = exchange.find_format(kind).round_boxes(digit_boxes())
    np.testing.assert_allclose(TOOLKIT_READERS[kind](file), expected, rtol=0, atol=1e-12)


CONFIDENCE = np.r_[np.nan, np.linspace(-3, 7, FRAMES - 1)]


def test_pytracking_truncates_and_got10k_has_one_time_file(tmp_path):
    truncated = exchange.find_format("pytracking").round_boxes(np.array([[1.9, -1.9, 2.5, np.nan]]))
    assert truncated.tolist() == [[1, -1, 2, 0]]
    rows = ResultRows(digit_boxes())
    n_files = [len(write_results("got10k", tmp_path, rows, repetition=k)) for k in (0, 1)]
    assert n_files == [2, 1]


@pytest.mark.parametrize(("kind", "place"), [("pysot", "."), ("vot", "unsupervised")])
def test_one_folder_holds_runs_with_and_without_confidences(kind, place, tmp_path):
    paths = []
    for name, confidence in (("with", CONFIDENCE), ("without", None)):
        write_results(kind, tmp_path / name, ResultRows(digit_boxes(), confidence))
        folder = tmp_path / name / place
        paths.append({path.relative_to(folder) for path in folder.rglob("*")})
    assert paths[1] <= paths[0]
    assert not (tmp_path / "without" / "longterm").exists()
    (file,) = (tmp_path / "with").glob("longterm/*/*_001_confidence.value")
    values = [float(line.strip()) for line in file.read_text().splitlines()[1:]]
    np.testing.assert_array_equal(values, CONFIDENCE[1:])


@pytest.mark.parametrize("kind", ["pysot", "pytracking", "vot"])
def test_confidences_are_imported_unchanged(kind, tmp_path):
    write_results(kind, tmp_path / "theirs", ResultRows(digit_boxes(), CONFIDENCE))
    (run,) = import_tracker(kind, tmp_path / "theirs", digit_boxes(), tmp_path / "results")
    np.testing.assert_array_equal(run.confidence, CONFIDENCE)


@pytest.mark.parametrize("kind", ["pysot", "vot"])
def test_states_of_supervised_runs_are_imported_unchanged(kind, tmp_path):
    states = np.full(FRAMES, FrameState.TRACKED)
    states[[0, 8]], states[3], states[4:8] = (
        FrameState.INITIALISED,
        FrameState.FAILED,
        FrameState.SKIPPED,
    )
    write_results(kind, tmp_path / "theirs", ResultRows(digit_boxes(), states=states))
    (run,) = import_tracker(kind, tmp_path / "theirs", digit_boxes(), tmp_path / "results")
    np.testing.assert_array_equal(run.states, states)
    np.testing.assert_array_equal(np.isfinite(run.boxes[1:, 0]), states[1:] == FrameState.TRACKED)


@pytest.mark.parametrize("kind", ["otb", "vot"])
def test_each_repetition_has_a_file_if_the_format_allows(kind, tmp_path):
    for number in range(2):
        write_results(kind, tmp_path / "theirs", ResultRows(digit_boxes(number)), repetition=number)
    runs = import_tracker(kind, tmp_path / "theirs", digit_boxes(), tmp_path / "results")
    assert len(runs) == (2 if exchange.find_format(kind).has_repetitions else 1)
    assert [run.identity.repetition for run in runs] == list(range(len(runs)))


@pytest.mark.parametrize("kind", ["otb", "vot"])
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda text: text.replace("\n", "\n\n\n", 1), "line 2"),
        (lambda text: text.replace("5", "five"), "five"),
        (lambda text: text.replace("5", "5_0", 3), "5_0"),
        (lambda text: text.partition("\n")[2] * 2, "22 rows for the 12 frames of Some-one_1"),
        (lambda text: "".join(text.splitlines(keepends=True)[:-2]), "ends after line 10"),
    ],
)
def test_damaged_file_is_reported_by_name_and_line(kind, harm, words, tmp_path):
    (file, *_) = write_results(kind, tmp_path / "theirs", ResultRows(digit_boxes()))
    file.write_text(harm(file.read_text()))
    with pytest.raises(ExchangeError) as raised:
        import_tracker(kind, tmp_path / "theirs", digit_boxes(), tmp_path / "results")
    message = str(raised.value)
    assert str(file) in message
    assert "line" in message
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize("kind", ["otb", "otb-json", "vot"])
@pytest.mark.parametrize("tries", [300, pytest.param(10_000, marks=pytest.mark.weekly)])
def test_damaged_bytes_give_boxes_or_an_error(kind, tries, tmp_path):
    (file, *_) = write_results(kind, tmp_path, ResultRows(digit_boxes()))
    whole, random = file.read_bytes(), np.random.default_rng(0)
    refused = []
    for _ in range(tries):
        content = bytearray(whole)
        for place in random.integers(0, len(content), random.integers(1, 4)):
            content[place] = random.choice([*b'\n\t ,.-e0m[]{}"', random.integers(256)])
        file.write_bytes(bytes(content))
        try:
            rows = exchange.find_format(kind).read(file)
        except ExchangeError as error:
            refused.append(str(error))
        else:
            assert rows.boxes.ndim == 2
            assert rows.boxes.shape[1] == 4
    assert tries / 6 < len(refused) < tries
    assert all(str(file) in line and "\n" not in line for line in refused)


def test_missing_sequence_is_reported_with_those_present(tmp_path):
    write_results("otb", tmp_path / "theirs", ResultRows(digit_boxes()), sequence="Other")
    with pytest.raises(ExchangeError, match=r"no results on Some-one_1.*Results exist on Other"):
        import_tracker("otb", tmp_path / "theirs", digit_boxes(), tmp_path / "results")


def test_sequence_names_have_several_spellings(tmp_path):
    theirs, messages = tmp_path / "theirs", []
    for number in range(2):  # changed results replace imported ones
        write_results("otb", theirs, ResultRows(digit_boxes(number)), sequence="some.one-1")
        (run,) = import_tracker("otb", theirs, digit_boxes(), tmp_path / "results", messages)
        assert run.identity.sequence == "Some-one_1"
        np.testing.assert_allclose(run.boxes[5, 2:], digit_boxes(number)[5, 2:], atol=1e-4)
    assert "some.one-1 is read as the results on Some-one_1." in messages
    write_results("otb", theirs, ResultRows(digit_boxes(1)), sequence="Other")
    import_tracker("otb", theirs, digit_boxes(), tmp_path / "results", messages)
    unused = f"{theirs}: results on sequences that were not requested are not imported: Other."
    assert unused in messages


def region_file(folder, line):
    """Write a file in the format of VOT with the same region in every frame after the first."""
    file = folder / "unsupervised" / "Some-one_1" / "Some-one_1_001.txt"
    file.parent.mkdir(parents=True)
    file.write_text("1\n" + f"{line}\n" * (FRAMES - 1))


@pytest.mark.parametrize(
    ("region", "box"),
    [
        ("2.0,3,9,3,9,8,2,8", [2, 3, 7, 5]),
        ("m4,5,3,3,4,1,4", [5, 6, 1, 1]),  # the middle of three by three
        ("m4,5,3,3,2,2,5", [4, 5, 3, 2]),  # the end of a row and the beginning of the next
        ("m4,5,3,3,9", [np.nan] * 4),
        ("0", [np.nan] * 4),
    ],
)
def test_regions_of_vot_are_read_as_bounding_boxes(region, box, tmp_path):
    messages = []
    region_file(tmp_path / "theirs", region)
    theirs, target = tmp_path / "theirs", tmp_path / "results"
    (run,) = import_tracker("vot", theirs, digit_boxes(), target, messages)
    np.testing.assert_array_equal(run.boxes[1:], [box] * (FRAMES - 1))
    assert bool(messages) == ("," in region)


def binary(rows):
    """Pack rows of a text file into a binary file as `region/io.py` of vot-toolkit does."""
    packed = [struct.pack("<hI", 1, len(rows))]
    for row in rows:
        if row.startswith("m"):
            x, y, width, height, *runs = (int(word) for word in row[1:].split(","))
            head = struct.pack("<BhhHHH", 3, x, y, width, height, len(runs))
            packed.append(head + struct.pack(f"<{len(runs)}H", *runs))
            continue
        numbers = [float(word) for word in row.split(",")]
        if len(numbers) == 1:
            packed.append(struct.pack("<BI", 0, int(numbers[0])))
        elif len(numbers) == 4:
            packed.append(struct.pack("<Bffff", 1, *numbers))
        else:
            head = struct.pack("<BH", 2, len(numbers) // 2)
            packed.append(head + struct.pack(f"<{len(numbers)}f", *numbers))
    return b"".join(packed)


ROWS = ["1", "2,3,9.5,4", "2.0,3,9,3,9,8,2,8", "m4,5,3,3,2,2,5", "0", "2", "-3.25,1,2,2"]


def test_binary_files_of_vot_equal_texts(tmp_path):
    text = tmp_path / "baseline" / "bag" / "bag_001.txt"
    text.parent.mkdir(parents=True)
    text.write_text("".join(f"{row}\n" for row in ROWS))
    file = text.with_suffix(".bin")
    file.write_bytes(binary(ROWS))
    vot = exchange.find_format("vot")
    for column in ("boxes", "states"):
        np.testing.assert_array_equal(*(getattr(vot.read(each), column) for each in (text, file)))
    assert vot.files(tmp_path) == {"bag": [text]}
    text.unlink()
    assert vot.files(tmp_path) == {"bag": [file]}
    assert parse_imported_tracker(f"theirs={tmp_path}").format == "vot"


def test_damaged_binary_files_give_boxes_or_an_error(tmp_path):
    file = tmp_path / "bag_001.bin"
    vot, whole, random = exchange.find_format("vot"), binary(ROWS * 3), np.random.default_rng(0)
    refused = []
    for number in range(1000):
        content = bytearray(whole[: None if number % 3 else random.integers(len(whole))])
        for place in random.integers(0, max(1, len(content)), random.integers(1, 4)):
            content[place : place + 1] = random.bytes(random.integers(0, 3))
        file.write_bytes(content)
        try:
            assert vot.read(file).boxes.shape[1] == 4
        except ExchangeError as error:
            refused.append(str(error))
    assert len(refused) > 500
    assert all(line.startswith(str(file)) and "\n" not in line for line in refused)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("3", "a region, 0, 1 or 2"),
        ("1,2", "2 numbers. Expected: a region"),
        ("m0,0,2", "not a mask"),
        ("m0,0,2,2,3,9", "more pixels than 2x2"),
        ("m0,0,1e9,nan,3,9", "not a mask"),
        ("nan", "a region"),
        ("m0,0,inf,inf,3,9", "more pixels"),
    ],
)
def test_invalid_region_is_refused(line, words, tmp_path):
    region_file(tmp_path, line)
    with pytest.raises(ExchangeError, match=f"line 2.*{words}"):
        import_tracker("vot", tmp_path, digit_boxes(), tmp_path / "results")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[]]", "Expected: an object"),
        ('{"res": [[1, 2, 3]]}', "box 1"),
        ('{"res": [[1, 2, 3, "4"]]}', "box 1"),
        ('{"res": [[1, 2, 3, true]]}', "box 1"),
        ('{"res": [], "resType": "ivtAff"}', "ivtAff, OPE"),
        ('{"res": [], "evalType": "TRE"}', "0 rows. Expected: 1 to 12"),
        ('{"res": [], "evalType": "XRE"}', "rect, XRE"),
        ("[" * 100_000, "JSON|deeply"),
        ("{", "line 1"),
        ("1" * 5000, "line 1"),
        ('{"res": [[1, 2, 3, 4]]}', "1 rows for the 12 frames .*: ends after box 1"),
    ],
)
def test_invalid_json_is_refused(text, words, tmp_path):
    (tmp_path / "Some-one_1.json").write_text(text)
    with pytest.raises(ExchangeError, match=words):
        import_tracker("otb-json", tmp_path, digit_boxes(), tmp_path / "results")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("STRUCK", "NAME=PATH"),
        ("=nowhere", "NAME=PATH"),
        ("STRUCK=nowhere", "not a folder"),
        ("STRUCK=otb:nowhere", "not a folder"),
        ("STRUCK=.", "unknown result format"),
    ],
)
def test_invalid_tracker_text_is_refused(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExchangeError, match=words):
        parse_imported_tracker(text)


def test_several_experiments_are_refused(tmp_path):
    for kind in ("baseline", "realtime"):
        (tmp_path / kind).mkdir()
    with pytest.raises(ExchangeError, match=r"several experiments.*Add its name"):
        parse_imported_tracker(f"theirs={tmp_path}")
