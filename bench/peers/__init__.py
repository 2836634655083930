"""Set-ups of other libraries for the same kinematics, by the problem that they solve."""
