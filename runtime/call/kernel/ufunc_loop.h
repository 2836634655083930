/* The NumPy generalized ufunc of a function, which broadcasts leading dimensions. */
#pragma once

#include "call/kernel/operands.h"

/* Creates the ufunc, which owns the kernel. On error, frees the kernel and returns NULL. */
PyObject *ufunc_new(Kernel *kernel, PyObject *name, PyObject *doc);
