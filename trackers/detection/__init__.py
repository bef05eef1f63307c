"""Detectors that can start a tracker: functions from an image to boxes, the best first."""
