"""Weight maps of an image, and functions and classes that move windows on them.

`back_projection` weighs hue, `differences` detects motion between frames, and `joint_map` combines
colour and motion. `colour_limits` declares limits of colours, outside which pixels have weight 0.
`position_filter` is a particle filter on the joint map.
"""
