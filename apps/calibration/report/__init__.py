"""The report of a calibration: plots (with Matplotlib), and one page in HTML or LaTeX."""
