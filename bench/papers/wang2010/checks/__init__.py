"""What no run of a tracker shows, measured on the scenes and in short runs, for single claims.

A table is named by its claim. Every one has `name` (the sequence, canonical), `sequence` (without
variant), `scene`, then columns of its own. Frames count from 0: the paper's frame k is k - 1. A
share or a yes or no is a float in [0, 1]; NaN where what is asked did not arise. Parameters are
those of `as-written` unless they are columns; maps are those of `bench.papers.wang2010.plain`.

"What moves" is the target, what holds it and whoever comes with it, by their true silhouettes; see
`checks.motion`. `recall` is the share of it that a map B marks, `precision` the share of B that is
on it, `f1` their harmonic mean, in one frame.

Always:

- `wa-2`, a frame with any of the target and map a row: `map` (`hue`: I_h; `hue and saturation`:
  I_c), `frame`, `similar` (1: on the face, or before a background of similar colour), `inside`
  (mean over the target's pixels), `outside` (over all others within a width and a height of its
  box), `difference` (inside - outside), `contrast` (difference / (inside + outside), in [-1, 1]);
- `wa-7`, a frame and map a row: `map` (`colour`: I_c; `moving`: B; `colour and moving`: I_m),
  `frame`, `figure` (1: frame 11 or 12 of the paper), `inside` (share of the map's sum that is on
  the target's pixels), `covered` (share of the target's pixels where the map is not 0);
- `wa-11` (`wang2010`), a frame and stage a row: `preset`, `frame`, `inside` (1: the estimate's
  centre is inside the true box), `stage` (`predicted`: before the drift; `drifted`), `distance`
  (mean, of the particles to the true centre [pixels]), `spread` (root mean square distance from
  their mean [pixels]), `similarity` (mean M/M0), `risen`, `fallen` (share of the particles whose
  M/M0 rises or falls by the drift; of `drifted` alone);
- `wa-29`, a frame a row: `tracker` (`wang2010`, `particle-filter`), `preset`, `frame`,
  `effective_share` (ESS/N), `weight_ratio` (greatest weight times N), `on_target` (share of the
  particles inside the true box), `on_over_off` (mean weight of these over that of the others);
- `camera`, a frame a row, also of sequences in `MOVING_CAMERA`: `camera` (`moving`, `at rest`),
  `frame`, and of the tracker's details `changing`, `moving`, `moving_inside`.

With `everything` also:

- `wa-3`, a frame, gain and map a row: `map` (`without value`: I_c; `with value`: value shares
  saturation's weight), `gain` (of the image; 1 is left out), `frame`, `inside` (mean over the
  target's pixels), `change` (mean absolute change of these by the gain, over their mean without);
- `wa-4`, a frame in which something moves and window a row: `window` (n), `frame`, `recall`,
  `precision`, `f1`, `precision_swept` (share of B where something moving is or was in one of the
  two frames before);
- `wa-5`, a frame, step, noise and number of differences a row: `differences` (`one`: D1; `two`:
  (D1 + D2) / 2), `noise` (deviation of what is added [grey levels]), `frame`, `step` (frames from
  one image to the next), `speed` (of the target [pixels an image]), `slow` (1: from the frame
  before it moves less than from one frame to the next in half of them), `recall`, `precision`,
  `f1`, `precision_swept` (share of B where something moving is in one of the three images; all
  else is noise, shadow or the rim of the window);
- `wa-6`, a threshold, contrast and noise a row, means over frames: `rule` (`adaptive`, `fixed`),
  `level` (λ; or T as mean absolute difference of a pixel [grey levels]), `contrast` (1: as it is),
  `noise`, `recall`, `precision`, `f1`, `best` (1: of all levels of the rule, this one's mean F1
  over all contrasts and noises of the scene is greatest);
- `wa-28`, a start and repetition a row: `tracker` (`wang2010`, `particle-filter`, `camshift
  fixed`, `camshift adaptive`), `preset` (`any` of CamShift), `start` (frame), `widths` (by which it
  starts beside the target; 0 to compare with), `right`, `down` (likewise [pixels]), `repetition`,
  `recovered` (in the twentieth frame the centre error is within half the mean side of the boxes),
  `recovered_from` (frame after the start from which it stays so), `reached` (it is within that in
  any of the twenty).
"""
