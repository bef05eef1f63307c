"""Wang and Tang 2010: particle filter with improved CamShift."""
