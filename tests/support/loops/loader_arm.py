"""A loader arm with two links.

Its main chain has more joints than degrees of freedom.
"""

LOADER = """
name = "loader"
title = "Loader arm on two links"
convention = "urdf"
units = { length = "mm", angle = "deg" }
actuated = ["lift"]
tool = { body = "arm", xyz = [2500, 0, -350] }
joints = [
  { name = "rear", link = "rear", xyz = [115, 0, 890], axis = [0, -1, 0] },
  { name = "arm", link = "arm", xyz = [623, 0, 0], axis = [0, -1, 0] },
  { name = "front", parent = "0", link = "front", xyz = [855, 0, 660], axis = [0, -1, 0] },
]
reference = { rear = 135, arm = -142, front = 142, lift = 765 }
[[closures]]
name = "pin"
kind = "pin"
a = { body = "arm", xyz = [402, 0, 0], rpy = [90, 0, 0] }
b = { body = "front", xyz = [997, 0, 0], rpy = [90, 0, 0] }
[[cylinders]]
name = "lift"
a = { body = "0", xyz = [430, 0, 330] }
b = { body = "arm", xyz = [900, 0, -130] }
limits = [640, 1180]
"""
_SECOND = """
[[cylinders]]
name = "left"
a = { body = "0", xyz = [430, 0, 330] }
b = { body = "arm", xyz = [900, 0, -130] }
"""
TWIN = (
    LOADER.replace('["lift"]', '["lift", "left"]').replace("lift = 765", "lift = 765, left = 765")
    + _SECOND
)
"""The loader arm with two lift cylinders for its one degree of freedom."""
