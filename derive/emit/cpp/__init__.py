"""Writes a C++17 header, an Eigen adapter and a CMake package."""
