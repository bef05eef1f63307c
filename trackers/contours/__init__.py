"""Parts of `moreno2005`: cues in a chain, each judged given the one before.

`chain` asks them in order. `plane_cue`, `colour_cue` and `contour_cue` are the three of the paper;
`observation` is what a frame shows them. Colours are `mixture`s of Gaussians with a `posterior` of
the target; contours come from masks and are summed over by `outline`, and refined by a `snake`.
`segmenter` makes a tracker of all this.
"""
