"""`trackmark annotate`: the ground truth that it writes, and the page for drawing boxes."""

import json
import queue
import re
import socket
import statistics
import struct
import threading
import urllib.error
import urllib.request
from _thread import interrupt_main
from contextlib import contextmanager
from itertools import pairwise
from urllib.parse import urlsplit

import click
import cv2
import numpy as np
import pytest

import trackmark as tm
from tests.bench.pages.test_page_rules import violations
from tests.browser import needs_browser
from trackmark.bench.commands import _box_picker, _drawing
from trackmark.datasets.annotation import check_marks, interpolate

BOTH = ("--box", "0:4,5,10,12", "--box", "4:8,5,10,12")


def test_annotate_writes_a_ground_truth_that_runs(trackmark, workspace):
    source = workspace / "data" / "Small" / "img"
    text = trackmark("annotate", source, *BOTH, "--output", "truth.csv").stdout
    assert "truth.csv" in text
    assert "interpolated" in (workspace / "truth.csv").read_text()
    run = ("run", "--trackers", "static", "--sequences", source, "--truth", "truth.csv")
    assert "read as " in trackmark(*run).stderr
    scores = tm.load_runs(workspace / "results").table.iloc[0]
    assert scores["centre_error"] == pytest.approx(statistics.mean([1, 2, 3, 4]))
    assert (workspace / "truth-check.png").is_file()


def test_annotating_again_reads_images_after_the_last_row(trackmark, one_line, workspace):
    source = workspace / "data" / "Small" / "img"
    trackmark("annotate", source, "--box", "0:4,5,10,12", "--box", "2:8,5,10,12")
    assert len((source / "truth.csv").read_text().splitlines()) > 3
    again = ("annotate", source, *BOTH)
    assert "--force" in one_line(trackmark(*again, status=2))
    # A wrong box is reported first.
    for box, message in (("4:1,2,3,4", "frame 4 has two boxes"), ("9:1,2,3,4", "frame 9 is out")):
        assert message in trackmark(*again, "--box", box, status=2).stderr
    trackmark(*again, "--force", "--absent", "2-3")
    assert "3 of 5 frames" in trackmark("describe", source).stdout
    assert (source.parent / "img-check.png").is_file()


def test_image_of_another_size_is_refused_before_writing(trackmark, one_line, workspace):
    source = workspace / "data" / "Small" / "img"
    cv2.imwrite(str(source / "0003.png"), np.zeros((20, 30, 3), np.uint8))
    line = one_line(trackmark("annotate", source, *BOTH, "--output", "truth.csv", status=2))
    assert "frame 2 has 30x20 pixels, other images have 50x40" in line
    assert not list(workspace.glob("truth*"))


@pytest.fixture
def user(monkeypatch):
    """Act on the page in a thread as soon as its address is printed."""
    threads, failures = [], queue.Queue()
    echo = click.echo

    def start(act):
        def acted(url):
            try:
                act(url)
            except Exception as error:  # noqa: BLE001  # raised by the fixture
                failures.put(error)
                ask(url + "finish", b'{"boxes": {"0": [1, 1, 5, 5], "1": [1, 1, 5, 5]}}')

        def heard(text="", **how):
            echo(text, **how)
            if "http://127.0.0.1:" in str(text):
                (url,) = (word for word in text.split() if word.startswith("http"))
                threads.append(threading.Thread(target=acted, args=(url,)))
                threads[-1].start()

        monkeypatch.setattr(click, "echo", heard)

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    yield start
    for thread in threads:
        thread.join()
    if not failures.empty():
        raise failures.get()


def ask(url, data=None):
    """Return status and content of an answer."""
    try:
        with urllib.request.urlopen(url, data) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read()


def rows(file):
    """Return the lines of a ground-truth file after its header."""
    return file.read_text().split("source\n")[1].splitlines()


def test_boxes_posted_by_the_page_become_the_ground_truth(trackmark, workspace, user, monkeypatch):
    source = workspace / "data" / "Small" / "img"
    seen, opened = {}, queue.Queue()
    monkeypatch.setenv("DISPLAY", ":0")  # with a display, the page is opened
    monkeypatch.setattr(_box_picker.webbrowser, "open", opened.put)

    def act(url):
        assert opened.get(timeout=300) == url
        seen["state"] = json.loads(ask(url + "state")[1])
        seen["frame"] = cv2.imdecode(np.frombuffer(ask(url + "frame/3")[1], np.uint8), 1)
        seen["missing"] = [ask(url + path)[0] for path in ("frame/5", "frame/-1", "else")]
        parts = urlsplit(url)
        seen["stranger"] = ask(f"{parts.scheme}://{parts.netloc}/state")[0]
        seen["refused"] = [
            ask(url + "save", json.dumps(drawing).encode())
            for drawing in (
                {"boxes": {"0": [4, 5, 10, 12]}},
                {"boxes": {"0": [4, 5, 10, 12], "4": [90, 5, 10, 12]}},
                {"boxes": {"0": [4, 5, 10]}},
                {"boxes": {"x": [4, 5, 10, 12]}},
                [],
            )
        ]
        seen["nothing written"] = not (workspace / "truth.csv").exists()
        drawn = {"boxes": {"0": [4, 5, 10, 12], "4": [8, 5, 10, 12.5]}, "absent": [[2, 2]]}
        seen["frame_numbers"] = ask(url + "finish", json.dumps(drawn).encode())[0]

    user(act)
    trackmark("annotate", source, "--draw", "--box", "2:1,2,3,4", "--output", "truth.csv")
    empty = {"boxes": {}, "absent": []}
    assert seen["state"]["saved"] == empty
    assert seen["state"]["drawing"] == empty | {"boxes": {"2": [1, 2, 3, 4]}}
    assert seen["frame"].shape == (40, 50, 3)
    assert seen["missing"] == [404, 404, 404]
    assert seen["stranger"] == 404
    assert [status for status, _ in seen["refused"]] == [400] * 5
    messages = b" | ".join(content for _, content in seen["refused"])
    for words in (b"two frames or more", b"frame 4: [90.0", b"[x, y, width, height] by frame"):
        assert words in messages
    assert seen["nothing written"]
    assert seen["frame_numbers"] == 200
    assert rows(workspace / "truth.csv") == [
        "0,4,5,10,12,marked",
        "1,5,5,10,12.125,interpolated",
        "2,,,,,",
        "3,7,5,10,12.375,interpolated",
        "4,8,5,10,12.5,marked",
    ]
    assert (workspace / "truth-check.png").is_file()
    assert not (workspace / "truth.csv.draft").exists()


SHOWN = "shown === frame"
BOX = "boxAt(frame) ?? null"


def drag(chromium, start, end):
    """Drag between two points of the image [pixels of the image]."""
    chromium.wait(SHOWN)
    left, top, scale = chromium.run(
        "(({ left, top }) => [left, top, scale])(paper.getBoundingClientRect())"
    )
    chromium.drag(*((left + x * scale, top + y * scale) for x, y in (start, end)))


@needs_browser
def test_browser_draws_moves_and_saves_boxes(trackmark, workspace, user, chromium, axe):
    seen = {}
    file = workspace / "truth.csv"

    def act(url):
        chromium.size(1280, 900)
        chromium.open(url)
        chromium.console.clear()
        drag(chromium, (14, 17), (4, 5))
        seen["drawn"] = chromium.run(BOX)
        seen["hint"] = chromium.run("$('hint').textContent")
        chromium.key("End")
        chromium.wait(SHOWN)
        seen["suggested"] = chromium.run(
            "[boxAt(4) ?? null, suggestedAt(4), $('kind').textContent]"
        )
        chromium.key("Enter")
        seen["accepted"] = chromium.run(BOX)
        seen["second_hint"] = chromium.run("$('hint').textContent")
        title = "[document.title, $('file').textContent, document.fonts.check('15px Inter')]"
        seen["title"] = chromium.run(f"document.fonts.ready.then(() => {title})")
        drag(chromium, (9, 11), (13.3, 11.3))  # whole pixels
        for key in (",", ","):  # the frame in the middle
            chromium.key(key)
        chromium.wait(SHOWN)
        seen["interpolated"] = chromium.run(BOX)
        seen["outline"] = chromium.run("$('outline').getAttribute('d')")
        chromium.key("ArrowRight")
        chromium.key("ArrowDown", shift=True)
        seen["nudged"] = chromium.run(BOX)
        drag(chromium, (12, 20), (13, 22))  # from inside the box
        seen["moved"] = chromium.run(BOX)
        drag(chromium, (18, 29), (20, 33))  # the lower right handle
        seen["resized"] = chromium.run(BOX)
        chromium.run("$('slider').value = 3; $('slider').dispatchEvent(new Event('input'))")
        seen["scrubbed"] = chromium.run(BOX)
        chromium.run("posts")
        seen["draft"] = json.loads((workspace / "truth.csv.draft").read_text())["boxes"]
        seen["mark"] = chromium.run("$('mark').textContent")
        chromium.open(url)  # with unsaved changes
        seen["warned"] = list(chromium.dialogs)
        chromium.wait(SHOWN)
        seen["reloaded"] = chromium.run("state.boxes")
        file.mkdir()  # now it cannot be written
        chromium.click("[data-key='Ctrl+s']")
        seen["error"] = chromium.wait(
            "$('message').className === 'bad' && $('message').textContent"
        )
        file.rmdir()
        chromium.click("[data-key='Ctrl+s']")
        seen["saved"] = chromium.wait("!$('mark').textContent && $('message').textContent")
        seen["file"] = rows(file)
        seen["console"] = [line for line in chromium.console if "asked the network" not in line]
        seen["rules"] = []
        for width, dark in ((1280, False), (390, True)):
            chromium.size(width, 844, dark=dark, mobile=width == 390)
            seen["rules"] += violations(chromium, axe)
            assert chromium.run("document.documentElement.scrollWidth") <= width
        chromium.run("actions.finish()")

    chromium.dialogs.clear()
    user(act)
    done = trackmark("annotate", workspace / "data/Small/img", "--draw", "--output", "truth.csv")
    assert seen["drawn"] == [4, 5, 10, 12]
    assert seen["hint"] == "Go on some frames (Page Down) and draw the next box"
    assert seen["second_hint"].startswith("Boxes in between are interpolated")
    assert seen["title"] == ["img, 5 frames of 50x40 px", "Boxes in truth.csv", True]
    assert seen["suggested"] == [None, [4, 5, 10, 12], "of 4: suggestion"]
    assert seen["accepted"] == [4, 5, 10, 12]
    assert seen["interpolated"] == [6, 5, 10, 12]
    assert seen["outline"] == "M6 5h10v12h-10z"
    assert seen["nudged"] == [7, 15, 10, 12]
    assert seen["moved"] == [8, 17, 10, 12]
    assert seen["resized"] == [8, 17, 12, 16]
    assert seen["scrubbed"] == [8, 11, 11, 14]
    drawn = {"0": [4, 5, 10, 12], "2": [8, 17, 12, 16], "4": [8, 5, 10, 12]}
    assert seen["draft"] == seen["reloaded"] == drawn
    assert seen["mark"] == "● unsaved"
    assert seen["warned"] == ["beforeunload"]
    assert "Not saved: " in seen["error"]
    assert "Is a directory" in seen["error"]
    assert seen["saved"] == "Saved 3 key frames to truth.csv."
    assert seen["rules"] == []
    assert [line for line in seen["console"] if "400 (Bad Request)" not in line] == []
    assert seen["file"] == rows(file) == [
        "0,4,5,10,12,marked",
        "1,6,11,11,14,interpolated",
        "2,8,17,12,16,marked",
        "3,8,11,11,14,interpolated",
        "4,8,5,10,12,marked",
    ]  # fmt: skip
    assert "3 boxes marked, 2 interpolated" in done.stdout


@needs_browser
def test_boxes_of_a_file_and_of_its_draft_are_loaded(trackmark, workspace, user, chromium):
    source = workspace / "data" / "Small" / "img"
    name = "<img src=x onerror=alert(1)>.csv"
    trackmark("annotate", source, *BOTH, "--absent", "2", "--output", name, "--note", "by hand")
    seen = []

    def act(url):
        chromium.open(url)
        chromium.wait(SHOWN)
        seen.append(chromium.run("[$('file').textContent, state, $('mark').textContent]"))
        if len(seen) == 1:
            chromium.key("ArrowUp")
            chromium.run("posts")
            interrupt_main()
        else:
            chromium.run("actions.finish()")

    chromium.dialogs.clear()
    user(act)
    trackmark("annotate", source, "--draw", "--output", name, status=130)
    trackmark("annotate", source, "--draw", "--output", name)
    boxes = {"0": [4, 5, 10, 12], "4": [8, 5, 10, 12]}
    moved = boxes | {"0": [4, 4, 10, 12]}
    assert seen == [
        [f"Boxes in {name}", {"boxes": boxes, "absent": [[2, 2]]}, ""],
        [f"Boxes in {name}", {"boxes": moved, "absent": [[2, 2]]}, "● unsaved"],
    ]
    assert "alert" not in chromium.dialogs
    assert rows(workspace / name)[:3] == [
        "0,4,4,10,12,marked", "1,5,4.25,10,12,interpolated", "2,,,,,"
    ]  # fmt: skip
    assert "# by hand\n" in (workspace / name).read_text()
    assert not list(workspace.glob("*.draft"))


@needs_browser
def test_page_interpolates_as_the_command_does(chromium):
    rng = np.random.default_rng(0)
    frames = sorted(rng.choice(np.arange(2, 90), 9, replace=False).tolist())
    keys = {frame: rng.uniform(1, 99, 4).tolist() for frame in frames}
    gap = next([a + 1, b - 1] for a, b in pairwise(frames) if b - a > 3)
    chromium.open(_box_picker.PAGE.as_uri())
    chromium.run(f"state = {json.dumps({'boxes': keys, 'absent': [gap]})}; 0")
    boxes = chromium.run(
        "Array.from({ length: 92 }, (_, i) => boxAt(i) ?? [null, null, null, null])"
    )
    chromium.console.clear()
    expected = interpolate(keys, 92, [gap]).boxes
    np.testing.assert_allclose(np.array(boxes, float), expected, rtol=1e-12)


def test_draw_refuses_what_it_would_lose(trackmark, one_line, workspace):
    draw = ("annotate", "data/Small/img", "--draw", "--output", "truth.csv")
    file, draft = workspace / "truth.csv", workspace / "truth.csv.draft"
    file.write_text("frame,x,y,width,height,visibility\n0,1,2,3,4,0.5\n")
    assert "column visibility" in one_line(trackmark(*draw, status=2))
    file.write_text("frame,x,y,width,height\n9,1,2,3,4\n")
    assert "frame 9 is outside the sequence" in one_line(trackmark(*draw, status=2))
    draft.write_text("{}x")
    assert "Delete the file" in one_line(trackmark(*draw, status=2))


@pytest.fixture
def files(tmp_path):
    """Provide the files of a drawing of 20 frames; the ground-truth file is JSON."""
    target = tmp_path / "a.csv"
    files = _drawing.DrawingFiles(
        target,
        "cup.mp4, 20 frames of 32x24 px",
        check=lambda drawing: check_marks(drawing.boxes, 20, drawing.absent, (32, 24)),
        read=lambda: _drawing.Drawing.model_validate_json(target.read_text()),
        write=lambda drawing: target.write_text(drawing.model_dump_json()),
    )
    files.load(_drawing.Drawing(), replace=False)
    return files


@contextmanager
def served(picker):
    """Answer requests in a thread."""
    with picker:
        threading.Thread(target=picker.serve_forever).start()
        try:
            yield picker
        finally:
            picker.shutdown()


@needs_browser
def test_page_zooms_undoes_and_marks_absence(chromium, make_sequence, files):
    drawing = _drawing.Drawing(boxes={0: [2, 3, 8, 6], 10: [12, 3, 8, 6]})
    files.saved = files.drawing = drawing
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        chromium.size(1280, 900)
        chromium.open(picker.url)
        chromium.wait(SHOWN)
        for key, frame in (("End", 19), ("[", 10), ("PageUp", 0), ("Home", 0), ("]", 10)):
            chromium.key(key)
            assert chromium.run("frame") == frame
        chromium.run("go(3)")
        chromium.key("a")
        chromium.run("go(6)")
        chromium.key("A", shift=True)
        assert chromium.run("[3, 4, 5, 6, 7].map(isAbsent)") == [True] * 4 + [False]
        chromium.key("a")
        assert chromium.run("[state.absent, boxAt(6)]") == [[[3, 3], [4, 5]], [8, 3, 8, 6]]
        chromium.click("[data-key='Ctrl+z']")
        chromium.click("[data-key='Ctrl+z']")
        assert chromium.run("state.absent") == [[3, 3]]
        chromium.click("[data-key=revert]")
        chromium.run("$('values').querySelector('input').value = 4.25; $('values').onchange()")
        assert chromium.run("state.boxes[6]") == [4.25, 3, 8, 6]
        chromium.click("[data-key=Delete]")
        assert chromium.run("[boxAt(6), $('mark').textContent]") == [[8, 3, 8, 6], ""]
        chromium.wait(SHOWN)
        pointer = "{ clientX: 500, clientY: 400 }"
        before = chromium.run(f"position({pointer})")
        wheel = {"deltaX": 0, "deltaY": -200, "modifiers": 2}  # with Ctrl
        chromium.call("Input.dispatchMouseEvent", type="mouseWheel", x=500, y=400, **wheel)
        chromium.wait("zoom === 2")
        np.testing.assert_allclose(chromium.run(f"position({pointer})"), before, atol=0.1)
        chromium.key("0")
        assert chromium.run("[zoom, stage.scrollWidth - stage.clientWidth]") == [1, 0]
        chromium.run("posts")
    assert not files.draft.exists()


PAIR = {"0": [4, 5, 10, 12], "4": [8, 5, 10, 12]}


def stored(files):
    """Return the content of the ground-truth file."""
    return _drawing.Drawing.model_validate_json(files.target.read_text())


MARK = "[$('message').textContent, $('message').className, $('mark').textContent]"


@needs_browser
def test_page_plays_to_the_end_and_hides_suggestions(chromium, make_sequence, files):
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        chromium.open(picker.url)
        chromium.wait(SHOWN)
        assert chromium.run("$('hint').textContent") == "Drag a box around the target"
        chromium.run("state.boxes[0] = [2, 3, 8, 6]; commit()")
        chromium.click("[data-key=' ']")
        assert chromium.run("[$('play').ariaLabel, $('hint').textContent]") == ["Stop", ""]
        chromium.wait("frame > 0 && frame === shown")
        assert chromium.run("playing === null || !$('outline').getAttribute('d')")
        chromium.wait("frame === 19 && playing === null")
        assert "Enter" in chromium.run("$('hint').textContent")
        chromium.key("Enter")  # the page has the focus again, not the button
        assert chromium.run("state.boxes[19]") == [2, 3, 8, 6]
        chromium.run("posts")


@needs_browser
def test_boxes_of_another_tab_are_not_overwritten(chromium, make_sequence, files):
    files.keep(_drawing.Drawing(boxes=PAIR), "save")
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        chromium.open(picker.url)
        chromium.wait(SHOWN)
        with chromium.other_tab():
            chromium.open(picker.url)
            chromium.wait(SHOWN)
            chromium.key("ArrowUp")
            chromium.run("posts")
            with chromium.first_tab():
                chromium.key("ArrowRight")
                chromium.run("actions['Ctrl+s'](); posts")
                message, kind, _ = chromium.run(MARK)
                assert kind == "bad"
                assert "another tab has changed the boxes. Reload this page" in message
            chromium.run("actions['Ctrl+s'](); posts")
            assert chromium.run(MARK)[1:] == ["", ""]
        chromium.open(picker.url)
        chromium.wait(SHOWN)
        assert chromium.run("state.boxes[0]") == [4, 4, 10, 12]
        chromium.run("actions.ArrowRight(1); commit(); actions['Ctrl+s'](); posts")
    assert stored(files).boxes == {0: [5, 4, 10, 12], 4: [8, 5, 10, 12]}


@needs_browser
def test_file_of_another_program_is_kept_until_chosen(chromium, make_sequence, files):
    files.keep(_drawing.Drawing(boxes=PAIR), "save")
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        for choice, expected in (("revert", [1, 1, 9, 9]), ("Ctrl+s", [4, 6, 10, 12])):
            chromium.open(picker.url)
            chromium.wait(SHOWN)
            chromium.run("state.boxes[0] = [4, 5, 10, 12]; commit(); actions['Ctrl+s'](); posts")
            other = _drawing.Drawing(boxes=PAIR | {"0": [1, 1, 9, 9]})
            files.target.write_text(other.model_dump_json())
            for action in ("Ctrl+s", "finish"):
                chromium.run(f"actions.ArrowDown(1); commit(); actions['{action}'](); posts")
            assert "another program has changed a.csv. Reload" in chromium.run(MARK)[0]
            assert stored(files) == other
            chromium.open(picker.url)
            chromium.wait(SHOWN)
            assert "Save replaces it with the boxes shown" in chromium.run(MARK)[0]
            assert chromium.run("state.boxes[0]") == [4, 7, 10, 12]
            chromium.run(f"actions['ArrowUp'](1); actions['{choice}'](); commit(); posts")
            chromium.run("actions['Ctrl+s'](); posts")
            assert stored(files).boxes[0] == expected


@needs_browser
def test_page_asks_before_saving_frames_outside_key_frames(chromium, make_sequence, files, axe):
    question = "[$('ask').open, $('ask-title').textContent, $('ask-go').textContent]"
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        chromium.size(1024, 700)
        chromium.open(picker.url)
        chromium.wait(SHOWN)
        chromium.run("state.boxes = { 2: [2, 3, 8, 6], 8: [12, 3, 8, 6] }; state.absent = [[9, 9]]")
        chromium.run("go(4); commit()")
        counts = "2 key frames, 5 interpolated, 13 of 20 without target"
        assert chromium.run("$('summary').textContent") == counts
        chromium.click("[data-key='Ctrl+s']")
        title = "12 of 20 frames count as without target"
        assert chromium.run(question) == [True, title, "Back to frame 10"]
        assert "Frames 0–1, 10–19 are" in chromium.run("$('ask-text').textContent")
        assert violations(chromium, axe) == []
        chromium.key("Enter")  # the button to go back has the focus
        chromium.wait("!$('ask').open && frame === 10 && shown === frame")
        chromium.run("posts")
        assert not files.target.exists()
        chromium.click("[data-key='Ctrl+s']")
        chromium.click("#ask-send")
        chromium.wait("$('message').textContent.startsWith('Saved 2 key frames')")
        chromium.run("state.boxes[5] = [6, 3, 8, 6]; commit()")
        chromium.click("[data-key='Ctrl+s']")  # the file has the same frames without target
        chromium.wait("$('message').textContent.startsWith('Saved 3 key frames')")
        assert chromium.run("$('ask').open") is False
    assert sorted(stored(files).boxes) == [2, 5, 8]


def test_unsaved_boxes_of_another_program_are_kept(files):
    files.keep(_drawing.Drawing(boxes=PAIR), "draft")
    files.draft.write_text('{"boxes": {"0": [1, 1, 9, 9]}}')
    with pytest.raises(_drawing.ConflictError, match=r"changed the boxes in a.csv.draft"):
        files.keep(_drawing.Drawing(), "draft")
    files.keep(_drawing.Drawing(boxes=PAIR), "save")
    files.reload()
    assert files.drawing.boxes == {0: [1, 1, 9, 9]}


def test_file_written_while_annotate_works_is_kept(trackmark, workspace, monkeypatch):
    truth = workspace / "truth.csv"
    monkeypatch.setattr("trackmark.reports.overlay.film_strip", lambda *_: truth.write_text("new"))
    again = ("annotate", "data/Small/img", *BOTH, "--output", "truth.csv")
    assert "the file exists" in trackmark(*again, status=2).stderr
    assert truth.read_text() == "new"


def test_draft_of_another_video_is_set_aside(trackmark, workspace, user):
    draft, seen = workspace / "truth.csv.draft", []
    content = '{"video": "cap.mp4, 90 frames of 5x5 px", "boxes": {"0": [1, 1, 3, 3]}}'
    draft.write_text(content)

    def act(url):
        seen.append(json.loads(ask(url + "state")[1]))
        ask(url + "finish", json.dumps({"boxes": PAIR}).encode())

    user(act)
    done = trackmark("annotate", "data/Small/img", "--draw", "--output", "truth.csv")
    assert seen[0]["drawing"]["boxes"] == {}
    assert "another video" in seen[0]["note"]
    assert "truth.csv.draft.1" in done.stderr
    assert (workspace / "truth.csv.draft.1").read_text() == content
    assert not draft.exists()


def test_boxes_that_do_not_fit_are_no_draft(files):
    for boxes in ({0: [float("nan")] * 4}, {20: [1, 1, 3, 3]}, {0: [1, 1, 3, -3]}):
        with pytest.raises(ValueError, match=r"frame (0|20)"):
            files.keep(_drawing.Drawing(boxes=boxes), "draft")
    assert not files.draft.exists()


def talk(picker, request):
    """Send bytes to the server and return all that it answers."""
    with socket.create_connection(("127.0.0.1", picker.server_port), timeout=300) as connection:
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: connection.recv(1 << 16), b""))


def test_requests_without_token_are_refused(make_sequence, files, capsys):
    body = json.dumps({"boxes": PAIR}).encode()
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        netloc, root = f"127.0.0.1:{picker.server_port}", picker.root
        for prefix in ("/", f"http://{netloc}/", root[1:], root.replace("/", "%2f"), root[:-2]):
            for path in ("state", "save", "frame/0"):
                for method in ("GET", "POST", "PUT"):
                    request = f"{method} {prefix}{path} HTTP/1.1\r\nHost: {netloc}\r\n"
                    length = f"Content-Length: {len(body)}\r\n\r\n"
                    answer = talk(picker, (request + length).encode() + body)
                    assert re.match(rb"HTTP/1.0 (400|404|501) ", answer), (request, answer)
                    assert b"boxes" not in answer
    assert not files.target.exists()
    assert not files.draft.exists()
    assert capsys.readouterr().err == ""


def test_posts_of_wrong_length_are_refused(make_sequence, files):
    statuses = {"99999999999999": 413, "-1": 411, "": 411, "40": 400}
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        for length, status in statuses.items():
            header = f"Content-Length: {length}\r\n" if length else ""
            request = f"POST {picker.root}save HTTP/1.1\r\n{header}\r\n{{".encode()
            assert talk(picker, request).startswith(f"HTTP/1.0 {status} ".encode())
    assert not files.target.exists()


def test_closed_tab_prints_no_traceback(make_sequence, files, capsys):
    with served(_box_picker.BoxPicker(make_sequence(), files)) as picker:
        for sent in (f"GET {picker.root}frame/1 HTTP/1.1\r\n\r\n", "GET /", ""):
            connection = socket.create_connection(("127.0.0.1", picker.server_port))
            connection.sendall(sent.encode())
            # Closing then resets the connection, as a browser does that is ended.
            reset = struct.pack("ii", 1, 0)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)
            connection.close()
        for error in (BrokenPipeError, ConnectionResetError, ConnectionAbortedError):
            try:
                raise error
            except ConnectionError:
                picker.handle_error(None, None)
        assert ask(picker.url + "state")[0] == 200
    assert capsys.readouterr().err == ""
