"""Views of robots: live in the browser, and as a page that one can mail.

robot = chasles.load("ur5e")
LiveView(robot).wait()  # needs viser, pip install 'chasles[view]'
html_page(robot)    # the text of a page that needs no network
"""

from .live import LiveView
from .mailed_page import html_page
from .playback import Recording, read_recording

__all__ = ["LiveView", "Recording", "html_page", "read_recording"]
