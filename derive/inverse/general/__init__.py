"""Six revolute axes of any geometry: the equations of Raghavan and Roth as eigenvalues."""
