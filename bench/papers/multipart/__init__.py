"""Particle filter with adaptive single- and multi-part colour histograms."""
