"""Writes functions for MATLAB, Octave and Simulink. They call the generated C."""
