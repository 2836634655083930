"""Quality of kinematic models for calibration."""
