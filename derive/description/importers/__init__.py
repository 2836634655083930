"""Files that other programs write: trees of links, xacro, SRDF, MJCF, calibrations."""
