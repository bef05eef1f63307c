"""An action film: rigid targets that the setting's things pass over, clip by clip."""
