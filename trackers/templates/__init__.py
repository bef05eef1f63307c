"""Template tracking with a Kalman filter per pixel (Nguyen & Smeulders 2002).

`matching` finds the template's pose, `appearance` filters its pixels, `occlusion` stores the state
during an occlusion.
"""
