"""The report of a calibration: plots, and one page in HTML or LaTeX, by Matplotlib."""
