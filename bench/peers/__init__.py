"""Other libraries, set up for the same kinematics, in one folder per problem."""
