"""Interfaces to other libraries for the same kinematics, in one folder per problem."""
