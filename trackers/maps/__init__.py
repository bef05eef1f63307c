"""Maps over the image that a window is moved on.

`back_projection` is that of hue alone; `differences` of frames say what moves; `joint_map` joins
colour and motion, windows `drift` on it, and `place_filter` moves a cloud of them.
"""
