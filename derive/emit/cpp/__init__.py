"""The C++17 language: a header over the generated C, an Eigen adapter and a CMake package."""
