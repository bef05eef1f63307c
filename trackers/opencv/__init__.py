"""OpenCV's own trackers, brought to our interface."""
