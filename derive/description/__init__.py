"""From text to data: robot files, URDF and the conventions that they are written in."""
