"""Functions of `import trackmark`: arguments, errors, seeds, results and their notebook forms."""

import base64
import gc
import importlib
import inspect
import os
import re
import shutil
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

import trackmark as tm
from tests.bench.stored_truths import add_truth_of
from trackmark import datasets
from trackmark.bench.api import evaluation
from trackmark.bench.api.run_bar import RunBar
from trackmark.bench.cli import main
from trackmark.bench.evaluation.sequence_cache import MAX_OPEN, _opened
from trackmark.bench.store.database import ResultsError
from trackmark.datasets import SequenceError
from trackmark.trackers import TrackerError


class Plain:
    """Stays at the init box."""

    def init(self, image, box):
        self.box = box

    def update(self, image):
        return self.box


PLAIN = inspect.getsource(Plain)


class Noisy(Plain):
    def __init__(self, seed, rng, width=1.0):
        self.seed, self.rng, self.width = seed, rng, width

    def update(self, image):
        return self.box + self.rng.normal(0, self.width, 4) * [1, 1, 0, 0], 0.5


class OwnError(Exception):
    pass


class Broken(Plain):
    def update(self, image):
        raise OwnError("no model")


@pytest.fixture
def line(make_sequence):
    return make_sequence(n=6)


@pytest.fixture
def face():
    return tm.load_sequence("samples/face")


def test_object_is_used_for_one_repetition(line, make_sequence):
    results = tm.evaluate(Plain(), [line, make_sequence(n=4, name="short")])
    assert [key[1] for key in results] == ["line", "short"]
    with pytest.raises(TrackerError, match="Give the class, not an instance"):
        tm.evaluate(Plain(), line, repetitions=2)


def test_one_object_is_not_used_for_two_trackers(line):
    tracker = Plain()
    for trackers in ({"a": tracker, "b": tracker}, [tracker, tracker], [[tracker], tracker]):
        with pytest.raises(TrackerError, match="are one object, whose runs would share"):
            tm.evaluate(trackers, line)
    assert line.frames.requested == []
    equal = type("Equal", (Plain,), {"__eq__": lambda *_: True, "__hash__": None})
    with pytest.raises(TrackerError, match="two different trackers are called 'Equal'"):
        tm.evaluate([equal(), equal()], line)
    # What a function or a class returns is known when it is called.
    single = type("Single", (Plain,), {"__new__": lambda kind: tracker})
    factory = {"make": lambda self: tracker}
    bound = type("Factory", (), factory)().make
    for other in (lambda: tracker, single, bound):
        with pytest.warns(RuntimeWarning, match="1 of 2 runs failed.*'a' and 'b' are one object"):
            tm.evaluate({"a": tracker, "b": other}, line)
    assert len(tm.evaluate({"a": bound}, line)) == 1


def test_lists_and_dicts_run_every_tracker_on_every_sequence(line):
    assert [*tm.evaluate(lambda: Plain(), line)] == [("<lambda>", "line", 0)]
    trackers = ["static", {"two": Plain, "three": lambda: Plain()}]
    results = tm.evaluate(trackers, [line, "samples/f*"])
    wild = type("Wild", (Plain,), {"randomness": "process"})  # it runs alone, but not last
    runs = tm.evaluate(["static", wild, Plain], line)
    assert [tracker for tracker, *_ in runs] == ["static", "Wild", "Plain"]
    names = [key[:2] for key in results]
    assert names[:3] == [("static", "line"), ("two", "line"), ("three", "line")]
    assert {name for _, name in names} == {"line", "samples/face"}
    assert len(tm.evaluate(["camshift", "camshift:hue_bins=32"], line)) == 1
    with pytest.raises(TrackerError, match="two different trackers are called 'Plain'"):
        tm.evaluate([Plain, Plain()], line)
    for name, error in (
        ("static", "belongs to another"),
        ("a\nb", "not a valid name"),
        (1, "1 of"),
    ):
        with pytest.raises((TrackerError, TypeError), match=error):
            tm.evaluate({name: Plain}, line)


def test_unreadable_sequence_costs_only_its_own_runs(line, otb, tmp_path):
    folder = otb(tmp_path / "Cut", 5)
    (folder / "img" / "0004.png").write_bytes(b"no image")
    with pytest.warns(RuntimeWarning, match=r"0004\.png.* Its runs are missing"):
        results = tm.evaluate(["static", Plain], [str(folder), line])
    assert [key[:2] for key in results] == [("static", "line"), ("Plain", "line")]
    other = shutil.copytree(folder, tmp_path / "Other")
    with pytest.raises(tm.datasets.SequenceError, match=r"0004\.png.*None of the 2 sequences can"):
        tm.evaluate("static", [folder, other])


def test_exceptions_of_a_tracker_cost_its_own_runs(line):
    raised = [MemoryError("9 GB"), GeneratorExit("end"), SystemExit(3), BaseException("base")]
    classes = []
    for error in raised:

        def update(self, image, error=error):
            raise error

        classes.append(type(f"Raises{type(error).__name__}", (Plain,), {"update": update}))
    with pytest.warns(RuntimeWarning, match="4 of 6 runs failed"):
        results = tm.evaluate(["static", *classes, Plain], line)
    assert results.failures["error"].tolist() == [
        *("MemoryError: 9 GB", "GeneratorExit: end", "SystemExit: 3", "BaseException: base")
    ]
    assert not results["Plain", "line"].failure


def test_process_state_is_that_before_the_call(otb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    otb(tmp_path / "Small", 4)
    (tmp_path / "elsewhere").mkdir()

    class Changes(Plain):
        def init(self, image, box):
            self.box = box
            os.chdir("elsewhere")
            os.environ["TRACKMARK_TEST"] = "changed"
            np.seterr(all="raise")
            warnings.simplefilter("ignore")
            cv2.setNumThreads(3)
            sys.path.insert(0, "elsewhere")
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            sys.stdout = None
            gc.disable()

        def update(self, image):
            assert Path.cwd() == tmp_path / "elsewhere"  # it is the tracker's own
            return self.box

    class Observes(Plain):
        def update(self, image):
            assert state() == before
            return self.box

    def state():
        return (
            *(Path.cwd(), dict(os.environ), np.geterr(), list(warnings.filters)),
            *(cv2.getNumThreads(), signal.getsignal(signal.SIGTERM), sys.stdout, gc.isenabled()),
        )

    search_path, before = list(sys.path), state()
    results = tm.evaluate([Observes, Changes, "static", {"again": Observes}], "Small")
    assert results.failures.empty
    assert (state(), sys.path) == (before, search_path)


def test_score_takes_metrics_of_any_kind_of_boxes(face):
    run = tm.evaluate("static", face)["static", "face"]
    expected = tm.score(run, metrics="otb")
    assert expected == tm.score(run, "samples/face", metrics="otb")
    assert expected == tm.score(run.boxes, face, metrics="otb")
    assert set(tm.metrics.names()) >= {"native", "otb"}
    assert "Wu" in tm.metrics.describe("otb")


@pytest.mark.parametrize("name", ["opencv-mil", "nummiaro2003"])
def test_created_tracker_gives_the_boxes_of_evaluate(name, face):
    short = face[:12]
    tracker = tm.trackers.create(name, sequence=short, repetition=1)
    tracker.init(short[short.first_frame], short.boxes[short.first_frame])
    boxes = [tracker.update(image).box for image in short.frames_after_init()]
    run = tm.evaluate(name, short, repetitions=2)[name, short.name, 1]
    np.testing.assert_array_equal(boxes, run.boxes[1:])


def test_sequence_is_opened_once_until_its_file_changes(otb, tmp_path, monkeypatch):
    folder = otb(tmp_path / "data" / "Small", 5)
    sequence = tm.load_sequence(folder)
    assert tm.load_sequence(folder) is sequence
    truth = folder / "groundtruth_rect.txt"
    truth.write_text("7,6,10,12\n" * 5)
    os.utime(truth, ns=(1, 1))
    assert tm.load_sequence(folder).boxes[0, 0] == sequence.boxes[0, 0] + 2
    for number in range(MAX_OPEN + 1):
        tm.load_sequence(f"plain/target:scene={number}")
    assert len(_opened) == MAX_OPEN


def test_arrays_are_a_sequence(face):
    frames = np.stack(list(face))
    frames.flags.writeable = True
    sequence = tm.Sequence.from_arrays(frames, face.boxes, name="mine")
    runs = tm.evaluate("camshift", [sequence, face])
    np.testing.assert_array_equal(runs["camshift", "mine"].boxes, runs["camshift", "face"].boxes)
    frames[3] = 0  # the images of the caller stay writeable
    changed = tm.Sequence.from_arrays(list(frames), face.boxes, name="mine")
    assert changed.fingerprint != sequence.fingerprint
    assert len(tm.Sequence.from_arrays(frames, face.boxes[:7], name="short")) == 7


@pytest.mark.parametrize(
    ("frames", "problem"),
    [
        (np.zeros((3, 24, 32)), r"frame 0 .* float64 and shape \(24, 32\)\. Expected: .* uint8"),
        (np.zeros((3, 24, 32, 4), np.uint8), r"frame 0 .* shape \(24, 32, 4\)"),
        ([np.zeros((n, 32, 3), np.uint8) for n in (24, 24, 9)], r"frame 2 .* one size"),
        ([], "there are no images"),
    ],
)
def test_arrays_that_are_no_images_are_refused(frames, problem):
    with pytest.raises(tm.datasets.SequenceError, match=f"^mine: {problem}"):
        tm.Sequence.from_arrays(frames, np.ones((3, 4)), name="mine")


def test_evaluate_shows_its_progress_on_request_or_in_a_terminal(face, monkeypatch, capsys):
    class InstantBar(RunBar):
        def __init__(self, **options):
            super().__init__(**options)
            self._bar.delay = self._bar.mininterval = 0

    monkeypatch.setattr(evaluation, "RunBar", InstantBar)
    tm.evaluate("static", face)
    assert capsys.readouterr().err == ""
    tm.evaluate([Plain, "static"], face, progress=True)
    text = capsys.readouterr().err
    assert "[#####...............] 0/2 runs, samples/face, frame 60" in text
    assert re.search(r"\[#{14,15}\.{5,6}\] 1/2 runs, samples/face, frame 60\b", text)


def test_forms_are_one_line_of_text_and_html(face):
    results = tm.evaluate(["static", "camshift"], [face, "samples/bow-tie"])
    run = results["camshift", "face"]
    compared = tm.compare(results, "camshift")
    assert repr(results) == "<Runs of 2 trackers, 2 sequences, 4 runs in memory>"
    assert all("\n" not in repr(value) for value in (run, face, compared))
    score = f"{tm.score(run, face)['mean_overlap']:.3f}"
    html = [value._repr_html_() for value in (results, run, face, compared)]
    assert "<td>0.671</td>" in html[0]
    assert "<b>" not in html[0]  # too few sequences
    assert "4 runs, 0 failed, 0 missing" in html[0]
    assert f"mean overlap {score}" in html[1]
    for text in html[1:3]:
        jpeg = base64.b64decode(re.search(r'base64,(.*?)"', text)[1])
        assert len(jpeg) < 60_000
        assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), 1).shape[0] == 144
    assert "samples/face: 120 frames of" in html[2]
    answer, means, pairs = (html[3].index(text) for text in ("<b>", ">0.671<", "camshift - static"))
    assert answer < means < pairs
    assert "camshift" in html[3][answer : html[3].index("</b>")]


def test_print_shows_means_and_the_answer_of_a_comparison(face):
    results = tm.evaluate(["static", "camshift"], [face, "samples/bow-tie"])
    assert re.search(r"^camshift +0\.671 ", str(results), re.MULTILINE)
    lines = str(tm.compare(results)).splitlines()
    assert lines[0] == "Mean overlap on these 2 sequences: camshift 0.67, static 0.57."
    assert any(line.startswith("samples/bow-tie ") for line in lines)
    assert "Success AUC (otb) on these" in str(tm.compare(results, metrics="otb"))
    video = {"samples/face": "video", "samples/bow-tie": "video"}
    assert "on this family: camshift 0.67" in str(tm.compare(results, families=video))
    means = str(tm.compare(tm.evaluate(["static", "camshift"], face[:20])))
    assert "1 sequence: too few for intervals" in means


def test_means_leave_out_a_sequence_of_one_frame(make_sequence):
    sequences = [make_sequence(n=n, name=f"s{n}") for n in (1, 5, 6)]
    results = tm.evaluate([Plain, "static"], sequences)
    expected = tm.evaluate([Plain, "static"], sequences[1:]).means()
    assert results.means()["mean_overlap"].equals(expected["mean_overlap"])
    note = "s1; mean overlap is undefined for all trackers"
    assert note in " ".join(str(results).split())
    assert note in " ".join(results._repr_html_().split())
    results.metrics = "long-term"
    text = " ".join(str(results).split())
    assert "means over s5, s6," in text
    assert "left out: s1; precision is undefined" in text


def test_failed_run_warns_and_can_raise(line):
    wrong = type("Wrong", (Plain,), {"update": lambda tracker, image: [1, 2, -3, 4]})
    with pytest.warns(RuntimeWarning, match=r"2 of 3 runs failed.*no model \(.*test_api\.py, line"):
        results = tm.evaluate([Plain, Broken, wrong], line)
    keyed = type("Keyed", (Plain,), {"update": lambda tracker, image: {"score": 1}})
    with pytest.warns(RuntimeWarning, match=r"with the keys 'score'[^/]*runs\.failures"):
        tm.evaluate(keyed, line)  # the adapter's line is not the tracker's
    row, other = results.failures.itertuples()
    assert (row.tracker, row.frame, row.error) == ("Broken", 1, "OwnError: no model")
    assert other.error.startswith("the box [1.0, 2.0, -3.0, 4.0] is invalid")
    assert results.table["status"].tolist() == ["finished", "failed", "failed"]
    with pytest.raises(OwnError, match="no model") as raised:
        tm.evaluate(Broken, line, raise_errors=True)
    assert raised.traceback[-1].name == "update"
    assert raised.value.__notes__ == [f"Broken on {line.name}, frame 1"]


def test_runs_that_a_metric_cannot_score_are_shown_as_such(line):
    away = type("Away", (Plain,), {"update": lambda tracker, image: [0, 0, 1, 1]})
    results = tm.evaluate(away, line, metrics="vot-supervised")
    assert results.scored()["status"].tolist() == ["not scored"]
    assert "1 of 1 not scored" in str(results)


HALF = type("Half", (), {"init": Plain.init, "__call__": Plain.update})


@pytest.mark.parametrize(
    ("trackers", "options", "error", "message"),
    [
        (42, {}, TypeError, "42 is not a tracker"),
        (HALF(), {}, TypeError, "is not a tracker: it lacks update"),
        (HALF, {}, TrackerError, "'Half': it lacks update"),
        ([], {}, TrackerError, "no tracker is given"),
        ("statik", {}, TrackerError, "Did you mean 'static'"),
        (Plain, {"repetitions": 0}, ValueError, "repetitions is 0"),
        (Plain, {"seed": "a"}, ValueError, "seed is 'a'. Expected: an integer of 0"),
        (Plain, {"protocol": None}, TypeError, "protocol is None. Expected: a text, for example"),
        (np.zeros((9, 4)), {}, TypeError, r"an array of shape \(9, 4\) .* is not a tracker"),
        (Plain, {"metrics": ["otb"]}, TypeError, "metrics is .'otb'.. Expected: one name"),
        (Plain, {"metrics": "otb", "protocol": "supervised"}, ValueError, "otb cannot score"),
        (Plain, {"metrics": "otp"}, ValueError, "Unknown metrics 'otp'"),
    ],
)
def test_mistakes_of_the_caller_raise_before_the_first_frame(
    trackers, options, error, message, line
):
    with pytest.raises(error, match=message):
        tm.evaluate(trackers, line, **options)
    assert line.frames.requested == []


def test_repetitions_and_base_seed_select_random_numbers(line):
    results = tm.evaluate([Noisy, Plain], line, repetitions=2)
    assert [key[0] for key in results] == ["Noisy", "Noisy", "Plain"]
    first, again = (tm.evaluate(Noisy, line, seed=s)["Noisy", "line"] for s in (7, 7))
    np.testing.assert_array_equal(first.boxes, again.boxes)
    assert not np.array_equal(first.boxes, results["Noisy", "line"].boxes)
    assert not np.array_equal(results["Noisy", "line", 1].boxes, results["Noisy", "line"].boxes)
    assert first.confidence[1:].tolist() == [0.5] * 5
    named = tm.evaluate({"named": Noisy, "text": f"{__file__}:Noisy"}, line)
    for run in named.values():
        np.testing.assert_array_equal(run.boxes, results["Noisy", "line"].boxes)


def test_repetitions_in_another_process_share_it_and_end_it(line, tmp_path):
    file = tmp_path / "remote.py"
    code = PLAIN.replace("self.box\n", "{'box': self.box, 'details': {'pid': os.getpid()}}\n")
    file.write_text(f"import os\n{code}    randomness = 'generator'\n")
    results = tm.evaluate({"far": f"{file}:python={sys.executable}"}, line, repetitions=3)
    (process,) = {int(run.details["pid"][1]) for run in results.values()}
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    assert "python" in results["far", "line"].identity.tracker_code["libraries"]


def test_edited_class_is_not_saved_and_edited_file_is_reloaded(line, tmp_path, monkeypatch):
    file = tmp_path / "edited.py"
    file.write_text(PLAIN)
    os.utime(file, (1, 1))
    monkeypatch.syspath_prepend(tmp_path)
    tracker = importlib.import_module("edited").Plain
    tm.evaluate(tracker, line).save(tmp_path / "first")
    before = tm.evaluate(str(file), line)["edited.py:Plain", "line"]
    file.write_text(PLAIN.replace("self.box\n", "self.box + [5, 0, 0, 0]\n"))
    with pytest.raises(ResultsError, match=r"edited\.py, which has changed since"):
        tm.evaluate(tracker, line).save(tmp_path / "second")
    after = tm.evaluate(str(file), line)["edited.py:Plain", "line"]
    np.testing.assert_array_equal(after.boxes[1:] - before.boxes[1:], [[5, 0, 0, 0]] * 5)
    assert after.identity.version != before.identity.version


def test_removed_working_directory_is_named(line, tmp_path, monkeypatch):
    (tmp_path / "removed").mkdir()
    monkeypatch.chdir(tmp_path / "removed")
    (tmp_path / "removed").rmdir()
    with pytest.raises(FileNotFoundError, match="the working directory was removed"):
        tm.evaluate("static", line)
    assert len(tm.load_sequence("samples/face")) == 120  # needs no folder


def test_tracker_may_remove_its_working_directory(line, tmp_path):
    class Removing(Plain):
        def init(self, image, box):
            (tmp_path / "removed").mkdir()
            os.chdir(tmp_path / "removed")
            (tmp_path / "removed").rmdir()
            super().init(image, box)

    before = Path.cwd()
    assert tm.evaluate(Removing, line).failures.empty
    assert Path.cwd() == before


def test_arguments_of_other_types_are_rejected(line):
    runs = tm.evaluate(["static", "camshift"], line)
    for function, *arguments, message in (
        (tm.score, "boxes.txt", line, "str is neither a run nor boxes"),
        (tm.score, runs, line, "PrintedRuns is neither a run nor boxes"),
        (tm.score, line.boxes, "the sequence of the boxes is missing"),
        (tm.compare, "folder", "'folder' is not Runs. For a folder, give load_runs"),
    ):
        with pytest.raises(TypeError, match=message):
            function(*arguments)
    for families in (3, ["ab", "c"]):
        with pytest.raises(TypeError, match=r"families=.*: expected a mapping from sequences"):
            tm.compare(tm.evaluate(["static", Plain], line), families=families)


def test_key_error_lists_the_nearest_runs(line):
    results = tm.evaluate("static", line)
    with pytest.raises(KeyError, match=r"nearest ones are \('static', 'line', 0\)"):
        results["statik", "line"]
    with pytest.raises(TypeError, match=r"runs\['static'\]: expected tracker and sequence"):
        results["static"]


def test_means_follow_the_rules_of_the_report(make_sequence):
    sequences = [make_sequence(n=5 + i, name=f"s{i}") for i in range(6)]
    results = tm.evaluate([Plain, "static"], sequences)
    means = results.means()
    by_sequence = results.means(per="sequence")["mean_overlap"]
    mean = means.loc["Plain", "mean_overlap"]
    assert mean == pytest.approx(by_sequence.xs("Plain", level="tracker").mean())
    assert means.loc["Plain", "mean_overlap_low"] < mean < means.loc["Plain", "mean_overlap_high"]
    few = tm.evaluate(Plain, sequences[:5]).means()
    assert few.filter(regex="low|high").isna().all(axis=None)
    assert "success_auc" in results.means(metrics="otb")


def test_overlaps_and_errors_are_those_of_the_score(face):
    run = tm.evaluate("camshift", face)["camshift", "face"]
    later = np.arange(len(face)) != face.first_frame
    scores = tm.score(run, face)
    assert run.overlaps()[later].mean() == pytest.approx(scores["mean_overlap"])
    assert run.centre_errors(face)[later].mean() == pytest.approx(scores["centre_error"])
    with pytest.raises(ValueError, match="another sequence"):
        run.overlaps("samples/bow-tie")


def test_saved_results_equal_results_in_memory(tmp_path, capsys):
    results = tm.evaluate(["static", "camshift"], "samples/*")
    folder = results.save(tmp_path / "mine")
    loaded = tm.load_runs(folder)
    names = [name for name in loaded.table if name not in ("date", "reading_seconds")]
    assert loaded.scored()[names].equals(results.scored()[names])
    assert loaded.means().equals(results.means())
    np.testing.assert_array_equal(loaded["static", "face"].boxes, results["static", "face"].boxes)
    with pytest.raises(SystemExit, match="0"):
        main(["compare", "--results", str(folder)])
    assert "camshift" in capsys.readouterr().out
    page = tm.player(results, "samples/face").page
    for sequence in ("face", tm.load_sequence("samples/face")):
        assert page == tm.player(folder, sequence).page
    with pytest.raises(ResultsError, match="already contains results"):
        results.save(folder)


def test_file_that_starts_runs_itself_is_an_error(tmp_path, otb):
    otb(tmp_path / "Small", 4)
    code = f"{PLAIN}import trackmark as tm\ntm.run(['self.py:Plain'], 'Small', jobs=1)\n"
    (tmp_path / "self.py").write_text(code)
    home = str(Path(tm.__file__).parents[1])
    command, variables = [sys.executable, "self.py"], {**os.environ, "PYTHONPATH": home}
    done = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True)
    assert "self.py: the file cannot be imported: " in done.stderr
    assert "Put them below if __name__ == '__main__'" in done.stderr


def test_runs_of_unknown_identity_are_not_saved(line, tmp_path):
    class Local(Plain):
        pass

    namespace = {"__name__": __name__, "Plain": Plain}
    exec("class Written(Plain):\n    pass", namespace)
    for results in (
        tm.evaluate(Local, line),
        tm.evaluate(namespace["Written"], line),
        tm.evaluate(Plain(), line),
        tm.evaluate("static", line, seed=3),
    ):
        with pytest.raises(ResultsError, match="its runs are in memory only"):
            results.save(tmp_path / "mine")
    assert tm.evaluate(Plain, line).save(tmp_path / "mine") == tmp_path / "mine"


def test_run_stores_and_continues(workspace, in_this_process, monkeypatch):
    monkeypatch.chdir(workspace)
    arguments = ["static", "knob.py"], "data/Small"
    results = tm.run(*arguments, folder="results/mine", repetitions=2, jobs=1)
    assert len(results) == 3
    assert (
        repr(results) == f"<Runs of 2 trackers, 1 sequence, 3 runs in {workspace / 'results/mine'}>"
    )
    again = tm.run(*arguments, folder="results/mine", repetitions=3, jobs=1)
    assert len(again) == 4
    around = tm.run("static", "data/Small", folder="results", jobs=1)  # has other results in it
    assert len(around) == 1
    run = results["knob.py:Knob", "Small"]
    assert again["knob.py:Knob", "Small"].metadata == run.metadata
    with pytest.raises(TrackerError, match=r"test_api\.py:Plain"):
        tm.run(Plain, "data/Small")
    with pytest.raises(ValueError, match=r"jobs is 0\. Expected: an integer of 1"):
        tm.run(*arguments, jobs=0)
    assert tm.score(run) == tm.score(run, "data/Small")


def _moved(sequence, pixels, fingerprint):
    """Return a sequence of the same name and images whose boxes are moved."""
    boxes = sequence.boxes + [pixels, 0, 0, 0]
    return datasets.Sequence(sequence.name, sequence.frames, boxes, fingerprint=fingerprint)


def test_equal_fingerprints_of_different_boxes_are_refused(make_sequence):
    sequence = make_sequence()
    other = _moved(sequence, 1, sequence.fingerprint)
    with pytest.raises(SequenceError, match=r"two different sequences are called 'line'"):
        tm.evaluate("static", [sequence, other])
    results = tm.evaluate("static", [sequence, sequence])
    assert len(results) == 1
    with pytest.raises(SequenceError, match="Give each its own fingerprint"):
        tm.evaluate("static", other)
    renamed = tm.evaluate("static", _moved(sequence, 1, "another"))
    assert results["static", "line"].open_sequence() is sequence
    assert renamed["static", "line"].open_sequence().boxes[0, 0] == sequence.boxes[0, 0] + 1


def test_other_ground_truth_of_equal_fingerprint_is_not_stored(make_sequence, tmp_path):
    sequence = make_sequence()
    add_truth_of(tmp_path / "trial", sequence)
    add_truth_of(tmp_path / "trial", sequence)
    with pytest.raises(ResultsError, match="another ground truth of line"):
        add_truth_of(tmp_path / "trial", _moved(sequence, 1, sequence.fingerprint))


class ComparedAsArray(Plain):
    __hash__ = None

    def __eq__(self, other):
        return np.array([True, False])


class WithoutAttributes:
    def __getattr__(self, name):
        raise RuntimeError(f"no {name}")

    def __repr__(self):
        raise RuntimeError("no text")


def test_evaluate_accepts_objects_that_cannot_be_compared():
    trackers = [ComparedAsArray(), {"other": ComparedAsArray()}]
    results = tm.evaluate(trackers, "samples/bow-tie")
    assert [run.status for run in results.values()] == ["finished"] * 2
    with pytest.raises(TrackerError, match="the name 'static' belongs to another tracker"):
        tm.evaluate({"static": ComparedAsArray()}, "samples/bow-tie")


def test_evaluate_names_the_failing_attribute_of_an_object():
    with pytest.raises(TrackerError, match=r"type WithoutAttributes is not a tracker: .*no init"):
        tm.evaluate(WithoutAttributes(), "samples/bow-tie")
