"""The robot file of a palletizer."""

PALLETIZER = """
name = "palletizer"
convention = "urdf"
joints = [
  { name = "j1", xyz = [0, 0, "0.5"], axis = [0, 0, 1] },
  { name = "j2", xyz = ["0.15", 0, 0], axis = [0, 1, 0] },
  { name = "j3", xyz = [0, 0, "0.9"], axis = [0, 1, 0] },
  { name = "level", xyz = [1, 0, 0], axis = [0, 1, 0] },
  { name = "j4", xyz = ["0.2", 0, "-0.15"], axis = [0, 0, 1] },
]
[couplings]
j3 = { j3 = 1, j2 = -1 }
level = { j3 = -1 }
"""
