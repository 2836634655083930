"""Other libraries, set up for the same kinematics and grouped by problem."""
