/* Function: the Python type that calls one compiled function (dispatch.c has the calls). */
#pragma once

#include "call/kernel/operands.h"

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    const Kernel *kernel; /* kernel that the object `ufunc` owns */
    PyObject *ufunc;
    PyObject *name, *label, *doc, *signature, *inputs, *outputs, *operations, *reduced;
    PyObject *guard; /* guard function that is called if a result is not finite; may be NULL */
    PyTypeObject
        *solutions;   /* class of the solutions, or NULL if the outputs are not solution branches */
    double tolerance; /* maximum residual of a valid branch */
    PyObject *refinement; /* refines nearly valid branches; may be NULL */
    double near;          /* maximum residual of a refined branch */
    PyObject *general; /* Python function for calls whose fixed= has other keys than `parameters`,
                          or NULL */
    PyObject *parameters; /* keys of fixed= for all inputs after the first; may be NULL */
} Function;

extern PyTypeObject FunctionType;

/* Calls the function. */
PyObject *function_vectorcall(PyObject *object, PyObject *const *args, size_t n_flagged,
                              PyObject *keywords);

/* Library.function(name, inputs, outputs, *, label, ...): a new Function. */
PyObject *function_new(PyObject *library, PyObject *args, PyObject *kwargs);
