"""Limits of saturation and value, outside which the hue of a pixel does not count."""

from trackmark.trackers.base.parameters import OPTION, Parameters, fraction


class ColourLimits(Parameters):
    """Limits outside which pixels have weight 0; by default, there are none."""

    minimum_saturation: float = fraction(
        0.0, "pixels with a lower saturation get weight 0 [fraction]", origin=OPTION
    )
    minimum_value: float = fraction(
        0.0, "pixels with a lower value (HSV) get weight 0 [fraction]", origin=OPTION
    )
    maximum_value: float = fraction(
        1.0, "pixels with a higher value (HSV) get weight 0 [fraction]", origin=OPTION
    )
