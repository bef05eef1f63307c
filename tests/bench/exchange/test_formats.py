"""Round trips and messages of every result format."""

import json
import struct

import numpy as np
import pytest

from trackmark.bench import exchange
from trackmark.bench.exchange.importing import Guest, On, guest, import_results
from trackmark.bench.exchange.result_format import ExchangeError, Said
from trackmark.bench.metrics.preset import State
from trackmark.bench.store.results import Results

FRAMES = 12


def walked(seed=0):
    """Boxes with many digits, some beyond the image's border."""
    random = np.random.default_rng(seed)
    place = random.uniform(-9, 90, (FRAMES, 2))
    return np.column_stack([place, random.uniform(1, 40, (FRAMES, 2))])


def written(kind, folder, said, sequence="Some-one_1", repetition=0):
    made = exchange.layout(kind).write(folder, sequence, repetition, said)
    for path, text in made.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return list(made)


def on(boxes, name="Some-one_1"):
    return On(name, f"fingerprint {name}", boxes, f"/data/{name}")


def imported(kind, folder, truth, target, told=None):
    tell = [].append if told is None else told.append
    import_results([Guest("theirs", kind, folder)], [on(truth)], target, tell)
    results = Results(target)
    return [results.read(path) for path in results.cells()]


every_layout = pytest.mark.parametrize("kind", exchange.names())


@every_layout
@pytest.mark.parametrize("origin", [0, 1])
def test_round_trip_keeps_boxes_and_layout_is_recognised(kind, origin, tmp_path):
    boxes, form = walked(), exchange.layout(kind)
    assert "SEQ" in form.expects
    shift = np.array([origin, origin, 0, 0])
    theirs = tmp_path / "theirs"
    written(kind, theirs, Said(boxes + shift, seconds=np.full(FRAMES, 0.01)))
    told = []
    # In VOT's files a special code stands for the first box, and shows no origin.
    start = form.origin if kind == "vot" else origin
    (run,) = imported(kind, theirs, boxes, tmp_path / "results", told)
    kept = form.held(boxes + shift) - [start, start, 0, 0]
    np.testing.assert_array_equal(run.boxes[0], boxes[0])
    np.testing.assert_allclose(run.boxes[1:], kept[1:], rtol=0, atol=1e-9)
    assert not told
    assert run.circumstances["source"] == "/data/Some-one_1"
    # The texts of pysot look like those of OTB.
    assert guest(f"theirs={theirs}").layout == ("otb" if kind == "pysot" else kind)
    assert guest(f"theirs={kind}:{theirs}").layout == kind


THEIRS = {
    # got10k, experiments/otb.py and got10k.py
    "otb": lambda file: np.loadtxt(file, delimiter=","),
    "got10k": lambda file: np.loadtxt(file, delimiter=","),
    # STVIR/pysot, toolkit/datasets/video.py
    "pysot": lambda file: [
        list(map(float, line.strip().split(","))) for line in file.read_text().splitlines()
    ],
    # visionml/pytracking, pytracking/utils/load_text.py
    "pytracking": lambda file: np.loadtxt(file, delimiter="\t", dtype=np.float64),
    # jwlim/tracker_benchmark, scripts/bscripts.py
    "otb-json": lambda file: json.loads(file.read_text())[0]["res"],
}


@pytest.mark.parametrize("kind", THEIRS)
def test_files_are_read_by_code_of_the_toolkits(kind, tmp_path):
    (file, *_) = written(kind, tmp_path, Said(walked()))
    kept = exchange.layout(kind).held(walked())
    np.testing.assert_allclose(THEIRS[kind](file), kept, rtol=0, atol=1e-12)


CONFIDENCE = np.r_[np.nan, np.linspace(-3, 7, FRAMES - 1)]


def test_pytracking_truncates_and_got10k_has_one_time_file(tmp_path):
    held = exchange.layout("pytracking").held(np.array([[1.9, -1.9, 2.5, np.nan]]))
    assert held.tolist() == [[1, -1, 2, 0]]
    files = [len(written("got10k", tmp_path, Said(walked()), repetition=k)) for k in (0, 1)]
    assert files == [2, 1]


@pytest.mark.parametrize(("kind", "place"), [("pysot", "."), ("vot", "unsupervised")])
def test_one_folder_holds_runs_with_and_without_confidences(kind, place, tmp_path):
    paths = []
    for name, confidence in (("with", CONFIDENCE), ("without", None)):
        written(kind, tmp_path / name, Said(walked(), confidence))
        folder = tmp_path / name / place
        paths.append({path.relative_to(folder) for path in folder.rglob("*")})
    assert paths[1] <= paths[0]
    assert not (tmp_path / "without" / "longterm").exists()
    (file,) = (tmp_path / "with").glob("longterm/*/*_001_confidence.value")
    values = [float(line.strip()) for line in file.read_text().splitlines()[1:]]
    np.testing.assert_array_equal(values, CONFIDENCE[1:])


@pytest.mark.parametrize("kind", ["pysot", "pytracking", "vot"])
def test_confidences_make_the_round_trip(kind, tmp_path):
    written(kind, tmp_path / "theirs", Said(walked(), CONFIDENCE))
    (run,) = imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    np.testing.assert_array_equal(run.confidence, CONFIDENCE)


@pytest.mark.parametrize("kind", ["pysot", "vot"])
def test_states_of_supervised_runs_make_the_round_trip(kind, tmp_path):
    states = np.full(FRAMES, State.TRACKED)
    states[[0, 8]], states[3], states[4:8] = State.INITIALISED, State.FAILED, State.SKIPPED
    written(kind, tmp_path / "theirs", Said(walked(), states=states))
    (run,) = imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    np.testing.assert_array_equal(run.states, states)
    np.testing.assert_array_equal(np.isfinite(run.boxes[1:, 0]), states[1:] == State.TRACKED)


@every_layout
def test_repetitions_have_a_file_each_if_there_is_room(kind, tmp_path):
    for number in range(2):
        written(kind, tmp_path / "theirs", Said(walked(number)), repetition=number)
    runs = imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    assert len(runs) == (2 if exchange.layout(kind).repeats else 1)
    assert [run.identity.repetition for run in runs] == list(range(len(runs)))


@pytest.mark.parametrize("kind", sorted({*exchange.names()} - {"otb-json"}))
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda text: text.replace("\n", "\n\n\n", 1), "line 2"),
        (lambda text: text.replace("5", "five"), "five"),
        (lambda text: text.replace("5", "5_0", 3), "5_0"),
        (lambda text: text + text, "24 rows for the 12 frames of Some-one_1: line 13 is one"),
        (lambda text: text.rpartition("\n")[0].rpartition("\n")[0] + "\n", "ends after line 11"),
    ],
)
def test_damaged_file_is_reported_by_name_and_line(kind, harm, words, tmp_path):
    (file, *_) = written(kind, tmp_path / "theirs", Said(walked()))
    file.write_text(harm(file.read_text()))
    with pytest.raises(ExchangeError) as raised:
        imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    said = str(raised.value)
    assert str(file) in said
    assert "line" in said
    assert words in said
    assert "\n" not in said


@every_layout
@pytest.mark.parametrize("tries", [300, pytest.param(10_000, marks=pytest.mark.weekly)])
def test_damaged_bytes_give_boxes_or_an_error(kind, tries, tmp_path):
    (file, *_) = written(kind, tmp_path, Said(walked()))
    whole, random = file.read_bytes(), np.random.default_rng(0)
    refused = []
    for _ in range(tries):
        content = bytearray(whole)
        for place in random.integers(0, len(content), random.integers(1, 4)):
            content[place] = random.choice([*b'\n\t ,.-e0m[]{}"', random.integers(256)])
        file.write_bytes(bytes(content))
        try:
            said = exchange.layout(kind).read(file)
        except ExchangeError as error:
            refused.append(str(error))
        else:
            assert said.boxes.ndim == 2
            assert said.boxes.shape[1] == 4
    assert tries / 6 < len(refused) < tries
    assert all(str(file) in line and "\n" not in line for line in refused)


@every_layout
def test_missing_sequence_is_reported_with_those_present(kind, tmp_path):
    written(kind, tmp_path / "theirs", Said(walked()), sequence="Other")
    with pytest.raises(ExchangeError, match=r"no results on Some-one_1.*there are Other"):
        imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")


def test_sequence_names_are_compared_by_letters(tmp_path):
    theirs, told = tmp_path / "theirs", []
    for number in range(2):  # changed results replace imported ones
        written("otb", theirs, Said(walked(number)), sequence="some.one-1")
        (run,) = imported("otb", theirs, walked(), tmp_path / "results", told)
        assert run.identity.sequence == "Some-one_1"
        np.testing.assert_allclose(run.boxes[5, 2:], walked(number)[5, 2:], atol=1e-4)
    assert "taken to count from 1" in told[-1]
    written("otb", theirs, Said(walked(1)), sequence="Other")
    imported("otb", theirs, walked(), tmp_path / "results", told)
    assert told[-1] == f"{theirs}: not taken, as their sequences are not asked for: Other."


def region_file(folder, line):
    """Write a file of VOT with the same region in every frame after the first."""
    file = folder / "unsupervised" / "Some-one_1" / "Some-one_1_001.txt"
    file.parent.mkdir(parents=True)
    file.write_text("1\n" + f"{line}\n" * (FRAMES - 1))


@pytest.mark.parametrize(
    ("region", "box"),
    [
        ("2,3,9,3,9,8,2,8", [2, 3, 7, 5]),
        ("m4,5,3,3,4,1,4", [5, 6, 1, 1]),  # the middle of three by three
        ("m4,5,3,3,2,2,5", [4, 5, 3, 2]),  # the end of a row and the beginning of the next
        ("m4,5,3,3,9", [np.nan] * 4),
        ("0", [np.nan] * 4),
    ],
)
def test_regions_of_vot_count_as_the_boxes_around_them(region, box, tmp_path):
    told = []
    region_file(tmp_path / "theirs", region)
    (run,) = imported("vot", tmp_path / "theirs", walked(), tmp_path / "results", told)
    np.testing.assert_array_equal(run.boxes[1:], [box] * (FRAMES - 1))
    assert bool(told) == ("," in region)


def binary(rows):
    """A file of vot-toolkit's, as its `region/io.py` packs it, of rows as its texts have them."""
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


ROWS = ["1", "2,3,9.5,4", "2,3,9,3,9,8,2,8", "m4,5,3,3,2,2,5", "0", "2", "-3.25,1,2,2"]


def test_binary_files_of_vot_equal_texts(tmp_path):
    text = tmp_path / "baseline" / "bag" / "bag_001.txt"
    text.parent.mkdir(parents=True)
    text.write_text("".join(f"{row}\n" for row in ROWS))
    file = text.with_suffix(".bin")
    file.write_bytes(binary(ROWS))
    vot = exchange.layout("vot")
    for column in ("boxes", "states"):
        np.testing.assert_array_equal(*(getattr(vot.read(each), column) for each in (text, file)))
    assert vot.files(tmp_path) == {"bag": [text]}
    text.unlink()
    assert vot.files(tmp_path) == {"bag": [file]}
    assert guest(f"theirs={tmp_path}").layout == "vot"


def test_damaged_binary_files_give_boxes_or_an_error(tmp_path):
    file = tmp_path / "bag_001.bin"
    vot, whole, random = exchange.layout("vot"), binary(ROWS * 3), np.random.default_rng(0)
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
        ("1,2", "2 numbers are no region"),
        ("m0,0,2", "no mask"),
        ("m0,0,2,2,3,9", "more pixels than 2x2"),
        ("m0,0,1e9,nan,3,9", "no mask"),
        ("nan", "a region"),
        ("m0,0,inf,inf,3,9", "more pixels"),
    ],
)
def test_invalid_region_is_refused(line, words, tmp_path):
    region_file(tmp_path, line)
    with pytest.raises(ExchangeError, match=f"line 2.*{words}"):
        imported("vot", tmp_path, walked(), tmp_path / "results")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[]]", "expected is an object"),
        ('{"res": [[1, 2, 3]]}', "box 1"),
        ('{"res": [[1, 2, 3, "4"]]}', "box 1"),
        ('{"res": [[1, 2, 3, true]]}', "box 1"),
        ('{"res": [], "resType": "ivtAff"}', "ivtAff of OPE"),
        ('{"res": [], "evalType": "TRE"}', "0 rows. Expected: 1 to 12"),
        ('{"res": [], "evalType": "XRE"}', "rect of XRE"),
        ("[" * 100_000, "JSON|deeply"),
        ("{", "line 1"),
        ("1" * 5000, "line 1"),
        ('{"res": [[1, 2, 3, 4]]}', "1 rows for the 12 frames .*: ends after box 1"),
    ],
)
def test_invalid_json_is_refused(text, words, tmp_path):
    (tmp_path / "Some-one_1.json").write_text(text)
    with pytest.raises(ExchangeError, match=words):
        imported("otb-json", tmp_path, walked(), tmp_path / "results")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("STRUCK", "NAME=PATH"),
        ("=nowhere", "NAME=PATH"),
        ("STRUCK=nowhere", "no folder"),
        ("STRUCK=otb:nowhere", "no folder"),
        ("STRUCK=.", "Looked for"),
    ],
)
def test_invalid_tracker_text_is_refused(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExchangeError, match=words):
        guest(text)


def test_several_experiments_are_refused(tmp_path):
    for kind in ("baseline", "realtime"):
        (tmp_path / kind).mkdir()
    with pytest.raises(ExchangeError, match="name one"):
        guest(f"theirs={tmp_path}")
