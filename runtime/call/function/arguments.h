/* Arguments of a call: sorting by name, conversion to arrays, and checks. */
#pragma once

#include "call/kernel/operands.h"

#define N_OPTIONS 3   /* number of keywords after the inputs: out, threads, fixed */
#define ALL_THREADS 0 /* the number of threads for threads="all" */

/* The broadcast shape of the leading dimensions of all inputs. */
typedef struct {
    int ndim;
    npy_intp dims[NPY_MAXDIMS];
} LeadingShape;

/* Writes the arguments to `slots` in this order: all inputs, then out, threads and fixed. A missing
 * argument is a NULL pointer. If takes_fixed is set, fixed= replaces all inputs after the first.
 * Returns -1 on error. */
int bind_arguments(const Kernel *kernel, int takes_fixed, PyObject *const *args, Py_ssize_t n_args,
                   PyObject *keywords, PyObject **slots);

/* Copies the values of fixed joints to the kernel inputs. The argument `fixed` is a dictionary with
 * the keys `parameters`, or a tuple of values (internal calls). Returns 1 with new references in
 * `slots`, 0 if `fixed` has other keys or another size, -1 on error. */
int spread_fixed(const Kernel *kernel, PyObject *parameters, PyObject *fixed, PyObject **slots);

/* Sets *outs to the output arrays, or to NULL if the call has no argument out=. An entry that is
 * None requests a new output array. Returns -1 on error. */
int read_out(const Kernel *kernel, PyObject **out, PyObject *const **outs);

/* Returns the number of threads (at least 1, or ALL_THREADS), or -1 on error. */
long read_threads(const Kernel *kernel, PyObject *given);

/* Tests whether the type implements __array_ufunc__ (dask, units): 1, 0, or -1 on error. */
int has_override(PyObject *object);

/* Returns the argument as an aligned native float64 array of the operand's shape, without a copy if
 * possible, or NULL on error. */
PyObject *read_input(const Kernel *kernel, const Operand *operand, PyObject *object);

/* Broadcasts the leading dimensions of all inputs. */
int broadcast_inputs(const Kernel *kernel, PyObject *const *inputs, LeadingShape *batch);

/* Tests that an out array has exactly the shape and type of the result. Returns -1 on error. */
int check_out(const Kernel *kernel, const Operand *operand, const LeadingShape *batch,
              PyObject *object);
