"""Other inverse kinematics solvers (peers): closed-form or iterative."""
