"""What is measured on the scenes themselves, and in short runs of its own, for single claims.

    examine(scenes, folder, jobs, quick=False, everything=False) -> dict[str, DataFrame]

Every table has `name` (the sequence, canonical), `sequence` (without variant), `scene`, `light`
(`even` where a sequence knows no other), then columns of its own. A share or a yes or no is a
float in [0, 1]; NaN where what is asked did not arise. ρ is the Bhattacharyya coefficient with the
model of the true ellipse in the first frame, unless another is named. "Clutter" are ellipses of
the target's size within three widths that a score would call a miss. A clear frame shows .95 of
the target or more. The bins, the kernel and σ are those of the text, unless they are columns.

Always:

- `appearance` (NU-11), a frame of visibility > .8 a row: `frame`, `visibility`, `coefficient` (ρ of
  the truth), `mean`, `deviation`, `threshold` (μ, σ, μ + 2σ of the background), `above_threshold`;
- `background` (NU-11b), a frame a row: `frame`, `positions` (examined in it, all without the
  target), `below_threshold` (share of them), `own` (1: the threshold is of this very frame);
- `occlusion` (NU-1; `students`), a frame of visibility .4 to .6 a row: `frame`, `visibility`,
  `coefficient`, `threshold`, `above_threshold`; `occlusion_curve`: the same of all partly hidden;
- `transformed` (NU-2), a transformed clear frame a row: `frame`, `transformation` (`rotation`,
  `scale`), `amount` (degrees, factor), `coefficient` (ρ of the ellipse that is turned or scaled
  like the target); `transformed_upright`, for rotations alone, what a state of the tracker can say:
  also `region` (`extents`: the ellipse in the turned one's extents; `circle`: the greatest circle
  in it, in the model too);
- `kernels` (NU-5), a frame of visibility ≥ .5 and kernel a row: `kernel`, `frame`, `visibility`,
  `coefficient`, `clutter` (greatest ρ of it), `margin` (coefficient - clutter), `centre_error`
  (truth to the greatest ρ within a Hx at the true size [Hx]);
- `maximum` (NU-7, Fig. 2; `person`, a run without model update), a clear frame a row: `preset`,
  `frame`, `visibility`, `distance` (mean state to the greatest ρ on a grid of a pixel [Hx]),
  `near` (distance ≤ .25), `spread` (deviation of the particles around their mean [Hx]),
  `coefficient` (ρ of the mean state), `greatest` (ρ on the grid);
- `surface` and `surface_particles`, for Fig. 2, of the last of these frames: `preset`, `frame`,
  `x`, `y`, `coefficient`; and `preset`, `frame`, `kind` (`particle`, `mean`, `greatest`), `x`,
  `y`, `half_width`, `half_height`, `weight`;
- `entrance` (NU-28, Fig. 3; `person:start=empty`, b = .1, the model of the first frame that shows
  all of the target, not in the shade), a run a row: `preset`, `kick_off` (b), `repetition`,
  `empty_frames`, `false_starts` (switches to tracking in these), `false_start_rate` (in a hundred
  empty frames), `no_false_start`, `visible_from` (first frame of visibility > .8), `tracks_from`
  (first frame with any of the target in which it tracks; NaN for never), `detected` (likewise, with
  the centre inside), `started` (at most ten frames after `visible_from` it tracks with the centre
  inside, and began to with the target in view; or `kept`), `kept` (tracks with the centre inside
  ten frames after it);
- `entrance_particles`, for Fig. 3, of the first run: `preset`, `frame`, `tracking`, `x`, `y`,
  `half_width`, `half_height`, `weight`; `entrance_regions`: `x`, `y`, `width`, `height`.

With `everything` also:

- `kick_off` (NU-12; `person:start=empty`): as `entrance`, with several values of b;
- `lighting` (NU-6), a clear frame, gain and colour space a row: `colour` (`rgb`, `hsv`), `gain`
  (of the image; 1 is left out), `frame`, `coefficient`, `drop` (of ρ from that without gain);
- `wrong_models` (NU-8; `students`, a model for each particle), a frame a row: `preset`,
  `repetition`, `frame`, `visibility`, `inside`, `nearer_clutter` (share of the models whose ρ with
  some clutter exceeds that with the first);
- `noise` (NU-25; `person`), a clear frame a row: `frame`, `bins` (a channel), `noise` (deviation
  of what is added [grey levels]), `coefficient`, `clutter`, `margin`;
- `mixture` (NU-27), a clear frame and model a row: `model` (`histogram`, `mixture`), `frame`,
  `target`, `distractor`, `clutter` (log likelihoods, of the mixture a pixel's mean; of the clutter
  the mean), `log_ratio` (target - distractor), `separation` (log_ratio / (target - clutter), which
  has no unit: 0 if one of the target's colours matches as well as both, 1 if no better than
  clutter).
"""

from bench.papers.nummiaro2003.checks.examining import examine

__all__ = ["examine"]
