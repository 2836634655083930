/* Packs results into Python objects; an IK function returns a Solutions tuple (solutions.py). */
#pragma once

#include "call/function/arguments.h"
#include "call/function/function.h"

/* Returns a tuple of new references, or NULL on error. */
PyObject *new_tuple(int n, PyObject *const *items);

/* Takes ownership of three results. Returns the branches as Solutions, refined if necessary. */
PyObject *pack_branches(const Function *self, PyObject *const *inputs, PyObject **results);

/* Returns the result, as Solutions if the outputs are branches. */
PyObject *branches_of_ufunc(const Function *self, PyObject *const *inputs, PyObject *result);

/* Packs results. If values in `memory` are not finite, the guard function is called first; if the
 * guard raises an error, NULL is returned. */
PyObject *pack_guarded(Function *self, PyObject *const *inputs, double *const *memory,
                       PyObject **results, PyObject *const *outs);

/* Takes ownership of a ufunc result for one pose. Returns NULL if the guard raises an error. */
PyObject *guard_ufunc_result(Function *self, PyObject *const *inputs, PyObject *result);

/* Sets the class of the solutions and the tolerance of this class. Returns -1 on error. */
int set_solutions(Function *self, PyObject *type);

/* Sets the Python function for refinement, and its maximum residual. Returns -1 on error. */
int set_refinement(Function *self, PyObject *refinement);

/* Returns one result, or a tuple of several results; takes ownership of the references. */
static inline PyObject *pack(const Function *self, PyObject *const *inputs, PyObject **results,
                             PyObject *const *outs)
{
    const Kernel *kernel = self->kernel;
    if (self->solutions) {
        return pack_branches(self, inputs, results);
    }
    for (int i = 0; i < kernel->n_outputs; i++) {
        if (!outs || outs[i] == Py_None) {
            results[i] = PyArray_Return((PyArrayObject *)results[i]);
        }
    }
    if (kernel->n_outputs == 1) {
        return results[0];
    }
    PyObject *tuple = PyTuple_New(kernel->n_outputs);
    for (int i = 0; i < kernel->n_outputs; i++) {
        if (!tuple || !results[i]) {
            Py_CLEAR(tuple);
            Py_XDECREF(results[i]);
        } else {
            PyTuple_SET_ITEM(tuple, i, results[i]);
        }
    }
    return tuple;
}
