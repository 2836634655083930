"""CUDA C++: device functions in single and double precision, and kernels with a thread per pose."""
