"""The report of a calibration: plots, and one page in HTML or LaTeX.

It needs Matplotlib, `pip install 'chasles[calibration]'`.
"""

from .page import html_page
from .plots import parameter_plot, residual_plot
from .tex_page import tex_page

__all__ = ["html_page", "parameter_plot", "residual_plot", "tex_page"]
