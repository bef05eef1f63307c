"""Parts of `moreno2005`: a chain of cues, each conditional on the previous one.

`chain` evaluates the cues in order. `plane_cue`, `colour_cue` and `contour_cue` are the paper's
cues; `observation` is their input. Colours are Gaussian mixtures (`mixture`) with a `posterior` of
the target. `outline` converts between contours and masks and sums over contours; `snake` refines
contours. `segmenter` is the base class of the trackers.
"""
