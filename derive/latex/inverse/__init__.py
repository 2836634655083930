"""LaTeX fragments for the inverse kinematics."""
