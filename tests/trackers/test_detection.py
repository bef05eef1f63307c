"""Detectors that initialise a tracker."""

import cv2
import numpy as np
import pytest

from trackmark import datasets, trackers
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.detection.cascade import cascade
from trackmark.trackers.detection.hog import people

needs_hog = pytest.mark.skipif(
    not hasattr(cv2, "HOGDescriptor"), reason="the installed OpenCV has no HOG detector"
)
needs_cascades = pytest.mark.skipif(
    not hasattr(cv2, "CascadeClassifier"), reason="the installed OpenCV has no cascades"
)

# Cascade of one stage and one stump: the upper half must be brighter than the lower.
CASCADE = """<?xml version="1.0"?>
<opencv_storage>
<cascade>
  <stageType>BOOST</stageType><featureType>HAAR</featureType>
  <height>20</height><width>20</width>
  <stageParams><boostType>GAB</boostType><minHitRate>0.99</minHitRate>
    <maxFalseAlarm>0.5</maxFalseAlarm><weightTrimRate>0.95</weightTrimRate>
    <maxDepth>1</maxDepth><maxWeakCount>1</maxWeakCount></stageParams>
  <featureParams><maxCatCount>0</maxCatCount><featSize>1</featSize><mode>BASIC</mode></featureParams>
  <stageNum>1</stageNum>
  <stages><_><maxWeakCount>1</maxWeakCount><stageThreshold>0.5</stageThreshold>
    <weakClassifiers><_><internalNodes>0 -1 0 0.6</internalNodes>
      <leafValues>0. 1.</leafValues></_></weakClassifiers></_></stages>
  <features><_><rects><_>0 0 20 20 -1.</_><_>0 0 20 10 2.</_></rects>
    <tilted>0</tilted></_></features>
</cascade>
</opencv_storage>
"""


@needs_hog
def test_people_detects_and_tracks_a_walking_person():
    sequence = datasets.load("multipart/1")
    detect = people()
    frames = range(0, 200, 20)
    hits = 0
    for frame in frames:
        actual = detect(sequence[frame])
        x, y = sequence.boxes[frame, :2] + sequence.boxes[frame, 2:] / 2
        inside = (actual[:, :2] < (x, y)) & (actual[:, :2] + actual[:, 2:] > (x, y))
        hits += bool(inside.all(axis=1).any())
    assert hits >= len(frames) / 2
    tracker = trackers.create("nummiaro2003")
    tracker.init_by_detector(sequence[0], detect)
    waited = next(k for k in range(1, 60) if tracker.update(sequence[k]).visible)
    assert "coefficient" in tracker.update(sequence[waited + 1]).details


@needs_cascades
def test_cascade_returns_the_largest_detection_first(tmp_path):
    file = tmp_path / "cascade.xml"
    file.write_text(CASCADE)
    image = np.full((200, 300, 3), 120, np.uint8)
    image[20:40, 20:60], image[40:60, 20:60] = 250, 5
    image[80:120, 150:230], image[120:160, 150:230] = 250, 5
    actual = cascade(file)(image)
    assert len(actual) >= 2
    areas = actual[:, 2] * actual[:, 3]
    assert (np.diff(areas) <= 0).all()
    tracker = trackers.create("nummiaro2003")
    tracker.init_by_detector(image, cascade(file))
    assert tracker.update(image).visible


@needs_cascades
def test_invalid_cascade_file_is_rejected_by_name(tmp_path):
    with pytest.raises(TrackerError, match=r"absent\.xml: there is no such"):
        cascade(tmp_path / "absent.xml")
    (tmp_path / "poor.xml").write_text("no cascade")
    with pytest.raises(TrackerError, match=r"poor\.xml: OpenCV cannot read this file as a cascade"):
        cascade(tmp_path / "poor.xml")


@pytest.mark.parametrize(
    ("name", "make"), [("HOGDescriptor", people), ("CascadeClassifier", cascade)]
)
def test_missing_opencv_detector_error_names_the_package(name, make, monkeypatch, tmp_path):
    monkeypatch.delattr(cv2, name, raising=False)
    (tmp_path / "face.xml").write_text(CASCADE)
    arguments = [tmp_path / "face.xml"] if make is cascade else []
    with pytest.raises(TrackerError, match="opencv-contrib-python-headless"):
        make(*arguments)
