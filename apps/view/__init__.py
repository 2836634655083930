"""Views of robots: a live view in the browser, and a self-contained HTML page.

robot = chasles.load("ur5e")
LiveView(robot).wait()  # needs viser, pip install 'chasles[view]'
write_html(robot, "ur5e.html")  # a self-contained page
"""

from .live import LiveView
from .mailed_page import write_html

__all__ = ["LiveView", "write_html"]
