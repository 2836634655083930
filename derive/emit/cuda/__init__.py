"""CUDA C++: device functions in both precisions, and kernels with one thread per pose."""
