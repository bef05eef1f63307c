"""`trackmark annotate`: the ground truth that it writes, and the page for drawing boxes."""

import json
import queue
import shutil
import statistics
import subprocess
import threading
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import click
import cv2
import numpy as np
import pytest

from trackmark import bench
from trackmark.bench.commands import _box_picker

BOTH = ("--box", "0:4,5,10,12", "--box", "4:8,5,10,12")


def test_annotate_writes_a_ground_truth_that_runs(trackmark, workspace):
    source = workspace / "data" / "Small" / "img"
    text = trackmark("annotate", source, *BOTH, "--output", "truth.csv").stdout
    assert "truth.csv" in text
    assert "interpolated" in (workspace / "truth.csv").read_text()
    trackmark("run", "--trackers", "static", "--sequences", source, "--truth", "truth.csv")
    scores = bench.load_runs(workspace / "results").iloc[0]
    assert scores["centre_error"] == pytest.approx(statistics.mean([1, 2, 3, 4]))
    assert (workspace / "truth-check.png").is_file()


def test_annotating_again_reads_images_after_the_last_row(trackmark, one_line, workspace):
    source = workspace / "data" / "Small" / "img"
    trackmark("annotate", source, "--box", "0:4,5,10,12", "--box", "2:8,5,10,12")
    assert len((source / "truth.csv").read_text().splitlines()) > 3
    again = ("annotate", source, *BOTH)
    assert "--force" in one_line(trackmark(*again, status=2))
    trackmark(*again, "--force", "--absent", "2-3")
    assert "3 of 5 frames" in trackmark("describe", source).stdout
    assert (source.parent / "img-check.png").is_file()


def test_image_of_another_size_is_refused_before_writing(trackmark, one_line, workspace):
    source = workspace / "data" / "Small" / "img"
    cv2.imwrite(str(source / "0003.png"), np.zeros((20, 30, 3), np.uint8))
    line = one_line(trackmark("annotate", source, *BOTH, "--output", "truth.csv", status=2))
    assert "frame 2 has 30x20 pixels, others have 50x40" in line
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
                ask(url + "done", b'{"0": [1, 1, 5, 5], "1": [1, 1, 5, 5]}')

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


def test_boxes_drawn_on_the_page_become_the_ground_truth(trackmark, workspace, user, monkeypatch):
    source = workspace / "data" / "Small" / "img"
    seen, opened = {}, queue.Queue()
    monkeypatch.setenv("DISPLAY", ":0")  # with a display, the page is opened
    monkeypatch.setattr(_box_picker.webbrowser, "open", opened.put)

    def act(url):
        assert opened.get(timeout=300) == url
        seen["page"] = ask(url)[1].decode()
        seen["frame"] = cv2.imdecode(np.frombuffer(ask(url + "frame/3")[1], np.uint8), 1)
        seen["no frame"] = [ask(url + path)[0] for path in ("frame/5", "frame/-1", "else")]
        parts = urlsplit(url)
        seen["stranger"] = ask(f"{parts.scheme}://{parts.netloc}/")[0]
        seen["refused"] = [
            ask(url + "done", json.dumps(boxes).encode())
            for boxes in (
                {"0": [4, 5, 10, 12]},
                {"0": [4, 5, 10, 12], "4": [90, 5, 10, 12]},
                {"0": [4, 5, 10]},
                {"x": [4, 5, 10, 12]},
                [],
            )
        ]
        drawn = {"0": [4, 5, 10, 12], "4": [8, 5, 10, 12.5]}
        seen["kept"] = ask(url + "done", json.dumps(drawn).encode())[0]

    user(act)
    trackmark("annotate", source, "--pick", "--box", "2:1,2,3,4", "--output", "truth.csv")
    assert '{"frames": 5, "boxes": {"2": [1.0, 2.0, 3.0, 4.0]}}' in seen["page"]
    assert seen["frame"].shape == (40, 50, 3)
    assert seen["no frame"] == [404, 404, 404]
    assert seen["stranger"] == 404
    assert [status for status, _ in seen["refused"]] == [400] * 5
    messages = b" | ".join(content for _, content in seen["refused"])
    for words in (b"two frames or more", b"frame 4: [90.0", b"[x, y, width, height] by frame"):
        assert words in messages
    assert seen["kept"] == 200
    rows = (workspace / "truth.csv").read_text().splitlines()
    assert rows[-5:] == [
        "0,4,5,10,12,marked",
        "1,5,5,10,12.125,interpolated",
        "2,6,5,10,12.25,interpolated",
        "3,7,5,10,12.375,interpolated",
        "4,8,5,10,12.5,marked",
    ]


DRAG = """
<script>
const shownOnce = () => new Promise(done => {
  const wait = () => picture ? done() : setTimeout(wait, 20);
  wait();
});
async function drag(from, to) {
  await shownOnce();
  const seen = canvas.getBoundingClientRect(), scale = seen.width / canvas.width;
  const send = (target, kind, [x, y]) => target.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, clientX: seen.left + x * scale, clientY: seen.top + y * scale }));
  send(canvas, "pointerdown", from);
  send(window, "pointermove", to);
  send(window, "pointerup", to);
}
(async () => {
  await drag([14, 17], [4, 5]);
  for (let i = 0; i < 4; i++) {
    window.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  }
  await drag([8, 5], [18, 17]);
  done.click();
})();
</script>
"""


def test_browser_draws_boxes_by_dragging(trackmark, workspace, user, monkeypatch):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no browser (chromium) is installed")
    page = workspace / "page.html"
    page.write_text(_box_picker.PAGE.read_text() + DRAG)
    monkeypatch.setattr(_box_picker, "PAGE", page)
    options = (
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={workspace / 'profile'}",
    )

    def act(url):
        output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        call = [browser, *options, "--virtual-time-budget=60000", "--dump-dom", url]
        subprocess.run(call, timeout=300, check=True, **output)

    user(act)
    trackmark("annotate", workspace / "data" / "Small" / "img", "--pick", "--output", "truth.csv")
    rows = (workspace / "truth.csv").read_text().splitlines()
    assert [rows[-5], rows[-1]] == ["0,4,5,10,12,marked", "4,8,5,10,12,marked"]
