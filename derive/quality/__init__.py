"""Quality of kinematic models for calibration: which convention suits each joint, and why."""
