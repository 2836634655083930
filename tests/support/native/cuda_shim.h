/* Defines the keywords of CUDA for a C++ compiler. The processor runs the threads of a CUDA kernel
 * one after the other. */
#ifndef CUDA_SHIM_H
#define CUDA_SHIM_H

#include <cstring>
#include <math.h>

#define __device__
#define __global__
#define __forceinline__ inline
#define __launch_bounds__(threads)

struct index3 {
    unsigned x, y, z;
};

static index3 blockIdx, blockDim = {32, 1, 1}, threadIdx;

/* Launches a CUDA kernel with one thread per pose. */
template <typename... Parameters, typename... Arguments>
void launch(void (*kernel)(size_t, Parameters...), size_t poses, Arguments... arguments)
{
    for (blockIdx.x = 0; (size_t)blockIdx.x * blockDim.x < poses; blockIdx.x++) {
        for (threadIdx.x = 0; threadIdx.x < blockDim.x; threadIdx.x++) {
            kernel(poses, (Parameters)arguments...);
        }
    }
}

#endif
