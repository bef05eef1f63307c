"""Colour histograms under an elliptic kernel, found again by mean shift; and prediction."""
