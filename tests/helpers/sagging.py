"""A UR5e with masses on its links, whose joints yield to gravity."""

from derivations import ROBOTS

LINKS = """
[[masses]]
link = "upper_arm"
mass = "m_upper_arm"
at = ["0.2", 0, "0.11"]
[[masses]]
link = "forearm"
mass = "2.3"
at = ["0.2", 0, "0.02"]
[[masses]]
link = "flange"
mass = "m_held"
at = [0, "0.03", "0.08"]
"""
NAMED = """
m_upper_arm = { value = 8.4, unit = "kg", meaning = "upper arm" }
m_held = { value = 4500, unit = "g", meaning = "held body and wrist" }
"""


def sagging_ur5e(gravity='[0, 0, "-9.81"]'):
    """The text of a robot file."""
    text = (ROBOTS / "ur5e.toml").read_text().replace("[parameters]", f"[parameters]{NAMED}")
    text = text.replace('convention = "dh"', f'convention = "dh"\ngravity = {gravity}')
    for joint, link in (
        ("shoulder_lift", "upper_arm"),
        ("elbow", "forearm"),
        ("wrist_3", "flange"),
    ):
        text = text.replace(f'name = "{joint}"', f'name = "{joint}"\nlink = "{link}"')
    return text + LINKS
