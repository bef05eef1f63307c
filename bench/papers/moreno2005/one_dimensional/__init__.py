"""Section 3: a point that changes position and colour in one dimension each; Fig. 1 and 2.

    measure(folder, jobs, quick=False) -> dict[str, DataFrame]

Position and colour are two cues of the same framework as the tracker's (`trackers.contours.cues`).
What the paper calls dependent attaches to every position a colour drawn by the weights of the
colour filter; independent, one drawn evenly from the whole space of colours. A third way, not in
the paper, tells two effects apart: `unweighted` attaches colours of the filter whatever their
weights. The error is the distance to the truth in the plane of position and colour, the mean over
100 frames.

- `errors`: a row a set of parameters (`set`), `samples`, `repetition` and `filter` (`observation`,
  `independent`, `dependent`, `unweighted`): `error`, `position_error`, `colour_error` (with the
  colours attached to positions, by the positions' weights), `own_error`, `own_colour_error` (with
  the colour filter's own estimate instead), `effective` (effective sample size of the positions, as
  a share). Truth and observations of a repetition are the same for all filters and numbers.
- `differences`: paired, over repetitions, a row a set, number, `pair` (as `independent less
  dependent`) and `quantity` (`error`, `position_error`, …): `mean`, `standard_error`, limits of the
  95 % interval (`lower`, `upper`).
- `trends`: a row a set and filter: `spearman` (rank correlation of mean error and number), and the
  limits of the interval of error(10) less error(500).
- `association`: a row a set, repetition and `association` (`by-weight`, `uniform`): `best` (weight
  of the colour that the best position has, in units of the mean weight), `top_pairs` (share of the
  best tenth of the positions whose colour is among the best tenth), means over frames.
- `factorisation`: a row a `dependence` of a discrete model: `distance` (total variation between
  the posterior and the product of equation 2).

All have `scale` (λ of the weights) where they have `set`.
"""

from bench.papers.moreno2005.one_dimensional.measuring import measure

__all__ = ["measure"]
