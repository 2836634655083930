/* The NumPy generalized ufunc behind a function, which broadcasts leading dimensions. */
#ifndef CHASLES_UFUNC_LOOP_H
#define CHASLES_UFUNC_LOOP_H

#include "call/kernel/operands.h"

/* Makes the ufunc, which takes the kernel over: the kernel is freed with the ufunc, or here on
 * error. NULL with an error set. */
PyObject *ufunc_new(Kernel *kernel, PyObject *name, PyObject *doc);

#endif
