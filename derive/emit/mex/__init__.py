"""Writes functions for MATLAB, Octave and Simulink, which call the generated C code."""
