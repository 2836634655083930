"""From text to data: robot files, URDF, and the modelling conventions of both."""
