"""Writes functions for MATLAB, Octave and Simulink. The functions call the generated C code."""
