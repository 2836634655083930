/* A kernel consists of a compiled function and the shapes of its operands (inputs and outputs).
 *
 * A Function object and its NumPy ufunc use the same kernel, which a capsule keeps alive. */
#pragma once

#include <stdint.h>

#include "call/kernel/python_api.h"
#include "library/_kernel.h"

#define MAX_OPERANDS 32 /* the inputs and outputs of one function */
#define MAX_CORE_NDIM 8

typedef struct {
    PyObject *name;
    int ndim;
    npy_intp dims[MAX_CORE_NDIM];
    npy_intp size; /* number of elements, the product of dims */
} Operand;

/* How an inverse tests whether its input poses are rigid (rigid_poses.h). */
typedef enum { NO_POSES, POSES_BY_RESIDUAL, POSES_JUDGED } PosesOf;

typedef struct {
    /* `call` computes one row, and `rows` computes many rows. `rows` may be NULL. */
    void (*call)(const double *const *inputs, double *const *outputs);
    void (*rows)(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
                 double *const *outputs, const ptrdiff_t *output_steps);
    const chasles_kernel *entry; /* the kernel's functions in `library` */
    int n_inputs, n_outputs, n_operands;
    PosesOf poses;                  /* how an inverse tests whether its poses are rigid */
    double unit;                    /* [m] the length that is equivalent to one radian */
    const chasles_kernel *fk;       /* computes residuals if the unit is not 1 m, otherwise NULL */
    Operand operands[MAX_OPERANDS]; /* inputs, then outputs */
    PyObject *library;              /* kept open */
    PyObject *label;                /* "ur5e.fk", for messages */
    /* A ufunc stores pointers to the members below, so the kernel owns their memory. */
    char *ufunc_name, *ufunc_doc;
    PyUFuncGenericFunction ufunc_loops[1];
    void *ufunc_data[1];
    char ufunc_types[MAX_OPERANDS];
} Kernel;

/* Creates a kernel from tuples of operand descriptions (.name, .shape), which must match the
 * library entry. Returns NULL on error. */
Kernel *kernel_new(PyObject *library, const chasles_kernel *entry, PyObject *label,
                   PyObject *inputs, PyObject *outputs);

/* Marks a kernel as inverse kinematics, and stores its forward kinematics `fk` (or NULL) and its
 * unit length. Returns -1 with a TypeError if the shapes of the inputs and outputs do not fit the
 * inverse kinematics function. */
int set_poses(Kernel *kernel, int poses, const chasles_kernel *fk, double unit);

void kernel_free(Kernel *kernel);

static inline int overlaps(const double *a, npy_intp a_size, const double *b, npy_intp b_size)
{
    return (uintptr_t)a < (uintptr_t)(b + b_size) && (uintptr_t)b < (uintptr_t)(a + a_size);
}

/* Tests whether an object is an aligned, dense float64 array of the operand's shape. */
static inline int is_core_array(PyObject *object, const Operand *operand)
{
    if (!PyArray_CheckExact(object)) {
        return 0;
    }
    PyArrayObject *array = (PyArrayObject *)object;
    if (PyArray_TYPE(array) != NPY_DOUBLE || PyArray_NDIM(array) != operand->ndim ||
        !PyArray_ISCARRAY_RO(array)) {
        return 0;
    }
    const npy_intp *dims = PyArray_DIMS(array);
    for (int i = 0; i < operand->ndim; i++) {
        if (dims[i] != operand->dims[i]) {
            return 0;
        }
    }
    return 1;
}
