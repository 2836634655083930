"""What is measured: observations, the frames of devices, and tables of measurements."""
