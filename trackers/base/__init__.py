"""The contract of every tracker, and parts of no family: particles, Kalman filters, OpenCV."""
