"""Six revolute axes of any geometry: the roots of a determinant (Raghavan and Roth)."""
