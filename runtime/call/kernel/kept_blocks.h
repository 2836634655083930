/* Memory of large results, kept from one call to the next.
 *
 * malloc returns blocks of 32 MB to the system as soon as they are freed (glibc), and the system
 * clears the memory that it gives: for a large batch that takes as long as the kernel itself. Large
 * results therefore have a memory handler of their own (NEP 49), which keeps freed blocks for the
 * results of the next call. A block belongs to one array or is kept, never both. Handlers run under
 * the interpreter's lock (GIL), which protects the table of kept blocks. */
#ifndef CHASLES_KEPT_BLOCKS_H
#define CHASLES_KEPT_BLOCKS_H

#include "call/kernel/python_api.h"

#define LEAST_KEPT ((size_t)32 << 20) /* bytes of a call's results; malloc keeps smaller ones */

/* Prepares the memory handler; -1 with an error set. */
int kept_blocks_init(void);

/* Returns a new array of doubles in a block. Where the program has set a memory handler of its own
 * for its arrays, that handler is used. */
PyObject *new_large(int ndim, npy_intp *dims);

/* release_memory() of the module: returns all kept blocks to the system, and their size [B]. */
PyObject *release_memory(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(ignored));

#endif
