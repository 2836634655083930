/* Function: the Python object that calls one compiled function.
 *
 * function.c defines the type, dispatch.c the calls; arguments.c reads arguments, and results.c
 * packs results. */
#ifndef CHASLES_FUNCTION_H
#define CHASLES_FUNCTION_H

#include "call/kernel/operands.h"

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    const Kernel *kernel; /* owned by the ufunc */
    PyObject *ufunc;
    PyObject *name, *label, *doc, *signature, *inputs, *outputs, *operations, *reduced;
    PyObject *guard;         /* NULL where the result is finite for every finite input */
    PyTypeObject *solutions; /* a subclass of tuple; NULL where the outputs are no branches */
    double tolerance;        /* greatest residual of a valid branch */
    PyObject *refinement;    /* of branches that are nearly valid; NULL where there is none */
    double near;             /* greatest residual of a branch that is refined */
    PyObject *general;    /* takes other calls of ik(T, *, fixed, ...); NULL for other functions */
    PyObject *parameters; /* the keys of fixed= that stand for the further inputs; may be NULL */
} Function;

extern PyTypeObject FunctionType;

/* Calls the function; see dispatch.c. */
PyObject *function_vectorcall(PyObject *object, PyObject *const *args, size_t n_flagged,
                              PyObject *keywords);

/* Library.function(name, inputs, outputs, *, label, ...): a new Function. */
PyObject *function_new(PyObject *library, PyObject *args, PyObject *kwargs);

#endif
