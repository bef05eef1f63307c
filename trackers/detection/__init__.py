"""Detectors that can initialise a tracker: functions from an image to boxes, best first."""
