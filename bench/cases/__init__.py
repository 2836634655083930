"""Arms, robots, poses and inverse kinematics tasks of the benchmarks."""
