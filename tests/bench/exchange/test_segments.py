"""Export and import of runs with segments: anchors, SRE and TRE."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.exchange.import_builder import import_runs, result_sequence
from tests.bench.exchange.test_formats import binary
from tests.bench.stored_truths import add_truth_of
from trackmark import datasets
from trackmark.bench import metrics
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.evaluation.scoring import can_score, score_run
from trackmark.bench.exchange.exporting import export_results
from trackmark.bench.exchange.importing import parse_imported_tracker
from trackmark.bench.exchange.result_format import ExchangeError
from trackmark.bench.metrics.interface import GroundTruthArrays, RunEstimates
from trackmark.bench.store.run_store import RunStore

SEQUENCE = "plain/target:length=64"
SHIFTS = ["left", "right", "up", "down", "topLeft", "topRight", "bottomLeft", "bottomRight"]
SHIFTS += ["scale_8", "scale_9", "scale_11", "scale_12"]


@pytest.fixture(scope="module", params=[SEQUENCE, f"{SEQUENCE}:absence=8"])
def sequence(request):
    """Provide two sequences; the target of the second is absent in some frames."""
    return datasets.load(request.param)


def store_run(run, sequence, folder):
    """Store a run as an experiment does."""
    key = run.identity
    results = RunStore(folder)
    cell = key.tracker, key.sequence, key.repetition, key.protocol
    results.add_requests({cell: key.version})
    add_truth_of(folder, sequence)
    results.add(run)


def import_run(kind, theirs, sequence, folder, messages=None, first_pixel=0):
    options = {"fingerprint": sequence.fingerprint, "source": sequence.name}
    on = result_sequence(sequence.name, sequence.boxes, first_pixel=first_pixel, **options)
    on_message = [].append if messages is None else messages.append
    (run,) = import_runs(kind, theirs, on, folder, on_message)
    return run


def scores(run, sequence):
    """Return the scores by all presets that can score the run's protocol."""
    presets = ("native", "otb", "lasot", "got10k", "trackingnet", "vot-anchor", "long-term")
    return {
        (preset, name): value
        for preset in presets
        if can_score(preset, run.identity.protocol)
        for name, value in score_run(run, sequence, preset).scores.items()
    }


@pytest.mark.parametrize(
    ("kind", "protocol"),
    [
        ("vot", "anchors"),
        ("vot", "anchors:spacing=20"),
        ("otb-json", "tre:starts=4"),
        ("otb-json", "sre"),
    ],
)
def test_exported_segments_are_imported_with_equal_scores(kind, protocol, sequence, tmp_path):
    run = evaluate_run("static", sequence, protocol=protocol)
    assert len(run.segments) > 1
    store_run(run, sequence, tmp_path / "first")
    export_results(tmp_path / "first", kind, tmp_path / "there", [].append, protocol=protocol)
    messages = []
    assert parse_imported_tracker(f"theirs={tmp_path / 'there' / 'static'}").format == kind
    theirs = tmp_path / "there" / "static"
    again = import_run(kind, theirs, sequence, tmp_path / "second", messages)
    assert not messages
    expected = protocol if kind == "otb-json" else "anchors"
    assert again.identity.protocol == expected
    assert len(again.segments) == len(run.segments)
    for first, second in zip(run.segments, again.segments, strict=True):
        np.testing.assert_array_equal(first, second)
    present = np.isfinite(run.boxes).all(axis=1)
    np.testing.assert_allclose(again.boxes[present], run.boxes[present], rtol=0, atol=1e-9)
    before = scores(run, sequence)
    assert ("vot-anchor", "accuracy") in before or kind != "vot"
    assert scores(again, sequence) == pytest.approx(before, abs=1e-12, nan_ok=True)


def test_segments_of_a_late_target_are_imported_unchanged(tmp_path):
    sequence = datasets.load(SEQUENCE)
    sequence.boxes = sequence.boxes.copy()
    sequence.boxes[:3] = np.nan
    for kind, protocol in (("vot", "anchors"), ("otb-json", "tre"), ("otb-json", "sre")):
        folder = tmp_path / protocol
        run = evaluate_run("static", sequence, protocol=protocol)
        store_run(run, sequence, folder / "first")
        export_results(folder / "first", kind, folder / "there", [].append, protocol=protocol)
        again = import_run(kind, folder / "there" / "static", sequence, folder / "second")
        assert scores(again, sequence) == pytest.approx(scores(run, sequence), nan_ok=True)
    files = (tmp_path / "anchors" / "there").rglob("*.txt")
    assert sorted(path.stem[-8:] for path in files) == ["00000003", "00000063"]
    (file,) = (tmp_path / "tre" / "there").rglob("*.json")
    starts = [record["startFrame"] for record in json.loads(file.read_text())]
    assert (starts[0], starts[-1]) == (1, 64 - 20 + 1)  # in numbers from 1


def test_export_counts_runs_without_a_file(tmp_path):
    first, second = datasets.load(SEQUENCE), datasets.load("plain/target:length=30")
    failed = evaluate_run("static", first)
    store_run(replace(failed, failure="frame 3: no idea"), first, tmp_path)
    store_run(evaluate_run("static", first, 1), first, tmp_path)
    store_run(evaluate_run("static", second), second, tmp_path)
    messages = []
    (file,) = export_results(tmp_path, "otb", tmp_path / "there", messages.append)
    assert file.stem == "plain_target_length=30"
    assert messages[1:] == [
        "1 failed runs are not exported.",
        "1 runs are not exported: otb stores one repetition only.",
    ]
    messages.clear()
    assert len(export_results(tmp_path, "vot", tmp_path / "vot", messages.append)) == 2
    assert messages[1:] == ["1 failed runs are not exported."]


@pytest.mark.parametrize(
    ("kind", "protocol"), [("otb", "tre"), ("vot", "sre"), ("otb-json", "sre:shift=0.2")]
)
def test_format_without_segments_names_formats_with_them(kind, protocol, sequence, tmp_path):
    store_run(evaluate_run("static", sequence, protocol=protocol), sequence, tmp_path / "first")
    with pytest.raises(
        ExchangeError,
        match=r"cannot represent runs with .*Expected: otb-json \(tre, sre.*; vot \(anchors\)",
    ):
        export_results(tmp_path / "first", kind, tmp_path / "there", print, protocol=protocol)


def write_anchor_files(folder, files):
    """Write files of VOT's multistart experiment."""
    place = folder / "theirs" / "baseline" / "bag"
    place.mkdir(parents=True)
    for name, rows in files.items():
        lines = ["1", *(",".join(f"{value:g}" for value in box) for box in rows[1:])]
        if name.endswith(".bin"):
            (place / name).write_bytes(binary(lines))
        else:
            (place / name).write_text("".join(f"{line}\n" for line in lines))
            (place / name.replace(".txt", "_time.value")).write_text("0.1\n" * len(lines))
    return folder / "theirs"


def moving_boxes(n):
    return np.column_stack([np.arange(n) * 2.0, np.arange(n) * 1.0, np.full((n, 2), 20.0)])


def import_bag(folder, truth):
    on = result_sequence("bag", truth)
    (run,) = import_runs("vot", folder, on, folder.parent / "results", pytest.fail)
    return run


def test_vot_anchors_are_read_in_both_directions(tmp_path):
    truth = moving_boxes(12)
    files = {
        "bag_00000000.txt": truth,
        "bag_00000003.bin": truth[3:],
        "bag_00000009.txt": truth[9::-1],
    }
    theirs = write_anchor_files(tmp_path / "mixed", files)
    (theirs / "baseline" / "bag" / "bag_00000003.bin").unlink()
    run = import_bag(theirs, truth)
    assert run.identity.protocol == "anchors"
    assert run.states is None
    assert [frames.tolist() for frames in run.segments] == [[*range(12)], [*range(9, -1, -1)]]
    target = GroundTruthArrays(truth, visibility=np.full(12, np.nan), image_size=(100, 100))
    assert score_run(run, target, "vot-anchor").scores["robustness"] == 1
    assert score_run(run, target, "native").scores["mean_overlap"] == 1
    binaries = write_anchor_files(tmp_path / "binary", {"bag_00000003.bin": truth[3:]})
    np.testing.assert_array_equal(import_bag(binaries, truth).boxes, truth[3:])


def test_vot_anchor_in_the_middle_has_the_direction_of_the_data(tmp_path, monkeypatch):
    truth = moving_boxes(11)
    bag = datasets.load("plain/target:length=11")
    bag.frame_values["anchor"] = np.where(np.arange(11) == 5, -1.0, 0.0)
    monkeypatch.setattr(datasets, "load", lambda *_, **__: bag)
    theirs = write_anchor_files(tmp_path / "stated", {"bag_00000005.txt": truth[5::-1]})
    assert import_bag(theirs, truth).segments[0].tolist() == [5, 4, 3, 2, 1, 0]
    del bag.frame_values["anchor"]
    theirs = write_anchor_files(tmp_path / "else", {"bag_00000005.txt": truth[5:]})
    assert import_bag(theirs, truth).segments[0].tolist() == [5, 6, 7, 8, 9, 10]


@pytest.mark.parametrize(
    ("files", "n", "words"),
    [
        (["bag_00000003.txt"], 6, "bag_00000003.txt: 6 rows from anchor 3. Expected: 9"),
        (["bag_00000000.txt", "bag_001.txt"], 12, "bag: results from anchors and over the whole"),
    ],
)
def test_vot_anchors_that_do_not_fit_are_refused(files, n, words, tmp_path):
    theirs = write_anchor_files(tmp_path, dict.fromkeys(files, moving_boxes(n)))
    with pytest.raises(ExchangeError, match=words):
        import_bag(theirs, moving_boxes(12))


def records(sequence, segments, evaluation, shifts=None):
    """Return records as OTB's Python toolkit writes them, with pixels counted from 1."""
    return [
        {
            "tracker": "theirs",
            "seqName": sequence.name,
            "startFrame": len(sequence) - len(boxes) + 1,
            "endFrame": len(sequence),
            "evalType": evaluation,
            "fps": 20.5,
            "shiftType": shifts[number] if shifts else None,
            "resType": "rect",
            "tmplsize": None,
            "res": (np.asarray(boxes) + [1, 1, 0, 0]).tolist(),
        }
        for number, boxes in enumerate(segments)
    ]


def write_json(folder, content):
    (folder / "theirs").mkdir()
    (folder / "theirs" / "plain_target_length=64.json").write_text(json.dumps(content))
    return folder / "theirs"


def drifting_boxes(sequence, start):
    boxes = sequence.boxes[start:].copy()
    boxes[:, 0] += 0.5 * np.arange(len(boxes))
    return boxes


def test_otb_tre_of_the_toolkits_starts_is_scored_as_its_mean(tmp_path):
    sequence = datasets.load(SEQUENCE)
    last = len(sequence) - 20 + 1  # the toolkit's split_seq, in numbers from 1
    starts = [int(1 + k * last / 19) - 1 for k in range(19)] + [last - 1]
    segments = [drifting_boxes(sequence, start) for start in starts]
    theirs = write_json(tmp_path, records(sequence, segments, "TRE"))
    messages = []
    run = import_run("otb-json", theirs, sequence, tmp_path / "results", messages, 1)
    assert not messages
    assert run.identity.protocol == "tre"
    assert [int(frames[0]) for frames in run.segments] == starts
    parts = score_run(run, sequence, "otb").segment_results
    assert len(parts) == 20
    for start, boxes, part in zip(starts, segments, parts, strict=True):
        alone = metrics.find_metrics("otb").score(
            GroundTruthArrays(sequence.boxes[start:]), RunEstimates(boxes)
        )
        assert part.scores == pytest.approx(alone.scores)


def test_otb_sre_is_sorted_by_its_shifts(tmp_path):
    sequence = datasets.load(SEQUENCE)
    run = evaluate_run("static", sequence, protocol="sre")
    segments = np.round(run.boxes.reshape(12, -1, 4))  # the toolkit rounds first boxes
    content = records(sequence, segments, "SRE", SHIFTS)
    theirs = write_json(tmp_path, content[::-1])
    again = import_run("otb-json", theirs, sequence, tmp_path / "results", first_pixel=1)
    assert again.identity.protocol == "sre"
    np.testing.assert_allclose(again.boxes, segments.reshape(-1, 4), atol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[:11], "11 records of SRE.*Expected: each of left"),
        (lambda rows: [{**row, "shiftType": "left"} for row in rows], "each of left, right"),
        (lambda rows: [*rows[:11], {**rows[11], "evalType": "TRE"}], "the same in all records"),
        (lambda rows: [{**row, "evalType": "OPE"} for row in rows], "12 records of OPE"),
        (lambda rows: [*rows[:11], {**rows[11], "seqName": "x"}], "record 12: seqName is 'x'"),
        (lambda rows: [*rows[:11], {**rows[11], "res": rows[11]["res"][:5]}], "record 12: "),
        (
            lambda rows: [{"evalType": "SRE", "res": row["res"][-9:]} for row in rows],
            "record 1: 9 rows. Expected: 64",
        ),
        (lambda rows: [{**row, "evalType": "TRE", "startFrame": 4} for row in rows], "Expected: 1"),
    ],
)
def test_otb_records_that_do_not_fit_are_refused(change, words, tmp_path):
    sequence = datasets.load(SEQUENCE)
    content = records(sequence, [sequence.boxes] * 12, "SRE", SHIFTS)
    theirs = write_json(tmp_path, change(content))
    with pytest.raises(ExchangeError, match=words):
        import_run("otb-json", theirs, sequence, tmp_path / "results")


def test_report_shows_imported_segments_by_their_protocol(trackmark):
    how = ("--sequences", SEQUENCE, "--protocol", "tre:starts=3")
    trackmark("run", "--trackers", "static", *how, "--name", "ours")
    trackmark("results", "export", "results/ours", "there", "--as", "otb-json", *how[2:])
    options = ("--results-of", "THEIRS=there/static", "--metrics", "otb", "--output", "report")
    trackmark("report", "results/ours", *options, "--no-pictures")
    (file,) = Path("report").glob("tre*metrics-otb.csv")
    with file.open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["measure"] == "success_auc"]
    means = {row["tracker"]: float(row["mean"]) for row in rows if row["sequence"] == SEQUENCE}
    assert means == {"static": means["static"], "THEIRS": pytest.approx(means["static"])}
