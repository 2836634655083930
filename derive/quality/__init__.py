"""The quality of models for calibration: which convention suits which joint, and why."""
