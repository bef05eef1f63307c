"""What holds for every layout of results: round trips, and what is said of malformed files."""

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


@pytest.mark.parametrize("kind", exchange.names())
def test_it_says_what_it_expects_and_what_it_keeps(kind):
    one = exchange.layout(kind)
    assert "SEQ" in one.expects
    assert one.holds
    assert one.origin in (0, 1)


@pytest.mark.parametrize("kind", exchange.names())
@pytest.mark.parametrize("origin", [0, 1])
def test_a_round_trip_gives_the_boxes_that_the_layout_keeps(kind, origin, tmp_path):
    boxes, one = walked(), exchange.layout(kind)
    shift = np.array([origin, origin, 0, 0])
    files = written(kind, tmp_path / "theirs", Said(boxes + shift, seconds=np.full(FRAMES, 0.01)))
    told = []
    # A special code of VOT's stands for the first box, and shows no origin.
    start = one.origin if kind == "vot" else origin
    (run,) = imported(kind, tmp_path / "theirs", boxes, tmp_path / "results", told)
    kept = one.held(boxes + shift) - [start, start, 0, 0]
    np.testing.assert_array_equal(run.boxes[0], boxes[0])
    np.testing.assert_allclose(run.boxes[1:], kept[1:], rtol=0, atol=1e-9)
    assert not told
    assert files
    assert run.circumstances["source"] == "/data/Some-one_1"


@pytest.mark.parametrize("kind", exchange.names())
def test_what_is_exported_is_known_again(kind, tmp_path):
    written(kind, tmp_path, Said(walked()))
    known = guest(f"theirs={tmp_path}").layout
    assert known == ("otb" if kind == "pysot" else kind)  # whose files look alike
    assert guest(f"theirs={kind}:{tmp_path}").layout == kind


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
def test_what_is_written_is_read_by_the_tools_own_lines(kind, tmp_path):
    (file, *_) = written(kind, tmp_path, Said(walked()))
    kept = exchange.layout(kind).held(walked())
    np.testing.assert_allclose(THEIRS[kind](file), kept, rtol=0, atol=1e-12)


def test_confidences_are_read_by_the_tools_own_lines(tmp_path):
    confidence = np.r_[np.nan, np.linspace(-3, 7, FRAMES - 1)]
    said = Said(walked(), confidence)
    (file,) = (path for path in written("pysot", tmp_path, said) if path.suffix == ".value")
    lines = file.read_text().splitlines()
    values = [float(line.strip()) for line in lines[1:]]
    np.testing.assert_array_equal(values, confidence[1:])


@pytest.mark.parametrize(("kind", "place"), [("pysot", "."), ("vot", "unsupervised")])
def test_one_folder_holds_runs_with_and_without_confidences(kind, place, tmp_path):
    confidence = np.r_[np.nan, np.linspace(-3, 7, FRAMES - 1)]
    written(kind, tmp_path / "with", Said(walked(), confidence))
    written(kind, tmp_path / "without", Said(walked()))
    ours, plain = (
        {path.relative_to(tmp_path / name / place) for path in (tmp_path / name / place).rglob("*")}
        for name in ("with", "without")
    )
    assert plain <= ours
    assert list((tmp_path / "with").glob("longterm/*/*_001.txt"))
    assert not (tmp_path / "without" / "longterm").exists()


@pytest.mark.parametrize("kind", ["pysot", "pytracking", "vot"])
def test_confidences_make_the_round_trip(kind, tmp_path):
    confidence = np.r_[np.nan, np.linspace(-3, 7, FRAMES - 1)]
    written(kind, tmp_path / "theirs", Said(walked(), confidence))
    (run,) = imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    np.testing.assert_array_equal(run.confidence, confidence)


@pytest.mark.parametrize("kind", ["pysot", "vot"])
def test_states_of_supervised_runs_make_the_round_trip(kind, tmp_path):
    states = np.full(FRAMES, State.TRACKED)
    states[[0, 8]], states[3], states[4:8] = State.INITIALISED, State.FAILED, State.SKIPPED
    written(kind, tmp_path / "theirs", Said(walked(), states=states))
    (run,) = imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    np.testing.assert_array_equal(run.states, states)
    np.testing.assert_array_equal(np.isfinite(run.boxes[1:, 0]), states[1:] == State.TRACKED)


@pytest.mark.parametrize("kind", exchange.names())
def test_repetitions_have_a_file_each_where_there_is_room(kind, tmp_path):
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
def test_damaged_files_are_one_line_that_names_file_and_line(kind, harm, words, tmp_path):
    (file, *_) = written(kind, tmp_path / "theirs", Said(walked()))
    file.write_text(harm(file.read_text()))
    with pytest.raises(ExchangeError) as raised:
        imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")
    said = str(raised.value)
    assert str(file) in said
    assert "line" in said
    assert words in said
    assert "\n" not in said


@pytest.mark.parametrize("kind", exchange.names())
@pytest.mark.parametrize("tries", [300, pytest.param(10_000, marks=pytest.mark.slow)])
def test_of_damaged_bytes_there_are_boxes_or_a_line(kind, tries, tmp_path):
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


@pytest.mark.parametrize("kind", exchange.names())
def test_a_sequence_without_results_says_what_there_is(kind, tmp_path):
    written(kind, tmp_path / "theirs", Said(walked()), sequence="Other")
    with pytest.raises(ExchangeError, match=r"no results on Some-one_1.*there are Other"):
        imported(kind, tmp_path / "theirs", walked(), tmp_path / "results")


def test_names_that_toolkits_write_differently_are_one(tmp_path):
    written("otb", tmp_path / "theirs", Said(walked()), sequence="some.one-1")
    written("otb", tmp_path / "theirs", Said(walked()), sequence="Other")
    told = []
    (run,) = imported("otb", tmp_path / "theirs", walked(), tmp_path / "results", told)
    assert run.identity.sequence == "Some-one_1"
    assert told == [
        f"{tmp_path / 'theirs'}: not taken, as their sequences are not asked for: Other."
    ]


def test_a_first_box_that_is_not_the_truths_is_told(tmp_path):
    written("otb", tmp_path / "theirs", Said(walked(1)))
    told = []
    imported("otb", tmp_path / "theirs", walked(), tmp_path / "results", told)
    assert "count from 1" in told[0]


def test_results_that_changed_replace_those_that_were_imported(tmp_path):
    for number in range(2):
        written("otb", tmp_path / "theirs", Said(walked(number)))
        (run,) = imported("otb", tmp_path / "theirs", walked(), tmp_path / "results")
        np.testing.assert_allclose(run.boxes[5, 2:], walked(number)[5, 2:], atol=1e-4)


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
    file = tmp_path / "theirs" / "unsupervised" / "Some-one_1" / "Some-one_1_001.txt"
    file.parent.mkdir(parents=True)
    file.write_text("1\n" + f"{region}\n" * (FRAMES - 1))
    told = []
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


def test_binary_files_of_vot_say_what_its_texts_do(tmp_path):
    text = tmp_path / "baseline" / "bag" / "bag_001.txt"
    text.parent.mkdir(parents=True)
    text.write_text("".join(f"{row}\n" for row in ROWS))
    file = text.with_suffix(".bin")
    file.write_bytes(binary(ROWS))
    vot = exchange.layout("vot")
    one, other = vot.read(text), vot.read(file)
    np.testing.assert_array_equal(one.boxes, other.boxes)
    np.testing.assert_array_equal(one.states, other.states)
    assert vot.files(tmp_path) == {"bag": [text]}
    text.unlink()
    assert vot.files(tmp_path) == {"bag": [file]}
    assert guest(f"theirs={tmp_path}").layout == "vot"


def test_damaged_binary_files_are_one_line(tmp_path):
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
def test_no_region_is_taken_for_one(line, words, tmp_path):
    file = tmp_path / "unsupervised" / "Some-one_1" / "Some-one_1_001.txt"
    file.parent.mkdir(parents=True)
    file.write_text("1\n" + f"{line}\n" * (FRAMES - 1))
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
def test_json_that_is_no_run_in_one_pass_is_refused(text, words, tmp_path):
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
def test_what_is_no_guest_is_told(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExchangeError, match=words):
        guest(text)


def test_several_experiments_are_refused(tmp_path):
    for kind in ("baseline", "realtime"):
        (tmp_path / kind).mkdir()
    with pytest.raises(ExchangeError, match="name one"):
        guest(f"theirs={tmp_path}")
