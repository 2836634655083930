"""LaTeX fragments for a chain: parameters, screw axes, link transforms, poses and Jacobians."""
