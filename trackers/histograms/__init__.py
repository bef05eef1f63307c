"""Colour histograms of image regions, and tracking by them.

`bins` defines colour bins. `rectangles` and `ellipses` count them in regions; `counting` chooses
between direct counts and integral histograms. `mean_shift` tracks a histogram. `target_model` and
`motion` are parts of the elliptic particle filter `nummiaro2003`.
"""
