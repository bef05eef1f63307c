"""What no score of a run shows, measured on the scenes of the figures for single claims.

    examine(scenes, folder, jobs, quick=False, everything=False) -> dict[str, DataFrame]

A table is named by its claim. Every one has `name` (the sequence, canonical), `sequence` (without
variant), `scene`, then columns of its own. Frames count from 0. Shares, J and F are floats in
[0, 1].

- `mo-11`, of the octopus, a preset, mask and part of the frames a row: `preset`, `mask` (`contour`:
  what the snake encloses; `mean contour`; `posterior map`: where it is above 1/2), `contrast`
  (`all`, or a quarter of the frames by the distance of the mean colours of the target and of what
  is within 12 pixels of it: `least`, `less`, `more`, `most`), `distance` (its mean),
  `region_similarity`. All masks are those of one run;
- `mo-20`, a space and frame a row: `space` (`Fisher plane`, `chromaticity`, `principal components`,
  `random planes`), `frame`, `told_apart` (share of the pixels, those of target and background
  counting alike, that two mixtures tell apart which were fitted to other pixels of the frame; of
  random planes the mean of five);
- `mo-21`, a frame and image of edges a row: `edges` (`supported` by the posterior map, or `all`),
  `frame`, `contour_accuracy`, `region_similarity` (of what the snake encloses, the mean over eight
  starts: the true contour, moved and stretched as the tracker's dynamics would), `accepted` (share
  of the snakes that the tracker would take). The map's mixtures were fitted to the frame before.
"""

from bench.papers.moreno2005.checks.examining import examine

__all__ = ["examine"]
