"""Views of robots: live in the browser, and as a page that one can mail.

robot = chasles.load("ur5e")
LiveView(robot).wait()  # needs viser, pip install 'chasles[view]'
write_html(robot, "ur5e.html")  # a page that needs no network
"""

from .live import LiveView
from .mailed_page import write_html

__all__ = ["LiveView", "write_html"]
