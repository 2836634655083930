"""Other libraries, set up for the same kinematics, by the problem that they solve."""
