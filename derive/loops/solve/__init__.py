"""Computes the joints of all loops as functions of the actuators or of the main-chain joints."""
