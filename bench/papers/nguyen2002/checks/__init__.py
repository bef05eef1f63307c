"""What no run of a tracker shows, measured on the scenes for single claims.

    examine(scenes, folder, jobs, quick=False, everything=False) -> dict[str, DataFrame]

A table is named by its claim. Every one has `name` (the sequence, canonical), `sequence` (without
variant), `scene`, then columns of its own. Frames count from 0. A share or a yes or no is a float
in [0, 1]. Parameters are those of `as-written` unless they are columns. `features` are those of the
tracker; all four, in a quick look some.

The template is that of the tracker, kept on the target by its own parts (`checks.follower`), but
for `ng-22`, for which the tracker is run. Where a table says nothing of severe occlusions none is
handled: every view is taken into the template. "Clear" are frames in which as much of the target
is seen as ever in the sequence. What is hidden of it, or changed, is made up on clear frames
(`checks.made_up`), so that it is known what the target truly looks like. A template's error is
|g - truth|, the mean over components, each in its standard deviations over the template, and over
pixels; the truth is that of the next frame.

Always, of the clips with odd numbers:

- `ng-9`, a frame and kind of features a row: `features`, `frame`, `at_target`, `in_clutter` (least
  matching errors a pixel, of a template five frames old, at the target's true place and at places
  that are half its width or its height beside it; R is learnt from the residuals at the true place,
  by the tracker's rule), `margin` (their difference), `ratio`, `false_alarms` (share of the
  template's pixels that are no outliers at that place in clutter);
- `ng-15`, a frame in which the template was compared a row: `features`, `frame`, `visibility`,
  `hidden` (1: less than half of the target is seen), `outliers` (share, at the best match),
  `exceeds` (1: more than γ), `stays_below` (1: not). An occlusion that is declared is bridged as
  the tracker does; where the target was lost, it is given again;
- `ng-17`, an occlusion that was complete and was declared, and `candidates` (`skipped`, `all from
  5 to L`) a row: `features`, `beginning` (frame), `offset` (of the end, from there), `visibility`,
  `overlap` (both there), `in_view` (1: .75 or more are seen), `found` (1: and the overlap is .5 or
  more);
- `ng-17-times`, such an occlusion a row: `features`, `beginning`, `skipped_seconds`, `all_seconds`
  (CPU time for matching the candidates, on the same frames);
- `ng-16`, of the first clip, a speed a row: `features`, `speed` (template widths a frame),
  `declared` (1: before all is covered), `coverage` (share of the template that is covered then),
  `contaminated` (share that is nearer to what covers it than to the target). The target is at
  rest, in one frame of little contrast, dark blue is slid over it, unlike any of its pixels, and
  the template is held at its true place: there are no other outliers.

Always, of `lights`:

- `ng-21`, a kind of light a row: `features`, `cause` (`shade`: an edge of half light; `shading`: a
  surface that turns away from the light), `change` (mean absolute change of a pixel, in standard
  deviations over the target).

With `everything` `ng-9`, `ng-15` and `ng-17` of the other clips, and, of those with odd numbers
and of `lights`:

- `ng-11`, an occlusion of a fifth of the target for five frames a row: `features`, `gate` (`on`,
  `off`), `template_error` (of what is seen; mean over the frames of the occlusion and five after
  it), `covered_error` (of what is covered; mean over the occlusion), `overlap`, `centre_error`
  [pixels] (both as `template_error`); `ng-11-longer`, the same for fifteen frames;
- `ng-12`, of clips whose template is background for a tenth or more: `features`, `part` (`corners`:
  whatever shows the background; `three times inside`), `background` (share of the template),
  `flagged` (share of the part that are outliers, mean over frames; of the second, three times it);
- `ng-13`, a lasting change of a part of the target a row: `features`, `rebootstrap` (`on`, `off`),
  `flagged` (share of the changed pixels that are outliers 20 frames later), `flagged_others`,
  `outliers` (share of all);
- `ng-14`, a change and phase a row: `change` (`dimming`, to .6 in 15 frames; `turning`, by 12° in
  15 frames; of `lights` `lamp off` and `lamp on`, as they are), `features`, `adaptive` (`on`,
  `off`: C_w stays 0), `phase` (`before`, `change`), `state_noise` (trace of C_w over that of R̄),
  `gain` (mean eigenvalue of K), `template_error`; means over ten frames before, fifteen in it;
- `ng-16-targets`, as `ng-16`, of the targets as they are, with something of the scene's ground slid
  over them, and `rule` (`outlier_rule`: `exceeds`, `reaches`);
- `ng-19`, a share of the target that is hidden for ten frames a row: `features`, `norm` (`huber`,
  `quadratic`), `coverage`, `centre_error` [pixels], `overlap`;
- `ng-22`, of clips with 100 clear frames in a row, a noise and trace a row: `features`, `trace`
  (`revised`, `online`), `noise` (deviation of what is added [grey levels]), `false_occlusions`
  (declared in 100 frames), `mean_overlap`; `ng-22-lines`, the same on straight lines through what
  was found at all noises, at the least and at the greatest of them.
"""

from bench.papers.nguyen2002.checks.examining import examine

__all__ = ["examine"]
