/* Memory pool for large results.
 *
 * The library glibc returns freed blocks of at least 32 MB to the system. The operating system
 * clears this memory before a program can use it again. Therefore large results use a memory
 * handler (NEP 49) that keeps freed blocks for the next call. A memory block belongs either to one
 * array or to the buffer pool. The interpreter lock (GIL) protects the pool. */
#pragma once

#include "call/kernel/python_api.h"

#define MIN_KEPT ((size_t)32 << 20) /* minimum size of results in the pool, in bytes */

/* Prepares the memory handler. Returns -1 on error. */
int buffer_pool_init(void);

/* Returns a new array of doubles in a block of the pool. If the calling program has set a NumPy
 * memory handler, the memory handler allocates the array instead. */
PyObject *new_large(int ndim, npy_intp *dims);

/* release_memory() of the module: frees all blocks of the pool and returns their size [B]. */
PyObject *release_memory(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(ignored));
