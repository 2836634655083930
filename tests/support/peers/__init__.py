"""Other inverse kinematics solvers: closed-form or iterative."""
