"""Functions for MATLAB, Octave and Simulink over the generated C."""
