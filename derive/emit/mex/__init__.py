"""Functions for MATLAB, Octave and Simulink that call the generated C."""
