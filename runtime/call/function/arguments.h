/* The arguments of a call: sorted by name, read as arrays, and checked against the operands. */
#ifndef CHASLES_ARGUMENTS_H
#define CHASLES_ARGUMENTS_H

#include "call/kernel/operands.h"

#define N_OPTIONS 3   /* keywords after the inputs: out, threads, fixed */
#define ALL_THREADS 0 /* the number of threads="all" */

/* The shape of the leading dimensions, to which all inputs broadcast. */
typedef struct {
    int ndim;
    npy_intp dims[NPY_MAXDIMS];
} LeadingShape;

/* Sorts the arguments into slots: one for each input, then out, threads and fixed; NULL where none
 * is given. A function that takes fixed= has one input by position or name. Returns -1 with an
 * error set. */
int bind_arguments(const Kernel *kernel, int takes_fixed, PyObject *const *args, Py_ssize_t n_args,
                   PyObject *keywords, PyObject **slots);

/* Fills the slots of the inputs after the first if `fixed` maps the names in `parameters` to them,
 * or is a tuple of them (the form of calls within this package). Returns 1 with new references, 0
 * for other values, -1 with an error set. */
int spread_fixed(const Kernel *kernel, PyObject *parameters, PyObject *fixed, PyObject **slots);

/* Sets *outs to the arrays to write into, one for each output, with None where a new array is
 * wanted, or to NULL where no array is given at all. Returns -1 with an error set. */
int read_out(const Kernel *kernel, PyObject **out, PyObject *const **outs);

/* Returns the number of threads, at least 1, or ALL_THREADS; -1 with an error set. */
long read_threads(const Kernel *kernel, PyObject *given);

/* Tests whether the type has an __array_ufunc__ of its own (dask, units): 1, 0, or -1 with an error
 * set. */
int has_override(PyObject *object);

/* Returns the argument as an aligned native float64 array of the operand's shape, copied only where
 * it is not such an array; NULL with an error set. */
PyObject *read_input(const Kernel *kernel, const Operand *operand, PyObject *object);

/* Broadcasts the leading dimensions of all inputs; -1 with an error that names the two that do not
 * agree. */
int broadcast_inputs(const Kernel *kernel, PyObject *const *inputs, LeadingShape *batch);

/* Tests that an array given as out has exactly the shape and type of the result; -1 with an error
 * set. */
int check_out(const Kernel *kernel, const Operand *operand, const LeadingShape *batch,
              PyObject *object);

#endif
