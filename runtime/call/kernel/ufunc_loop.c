#include "call/kernel/ufunc_loop.h"

#include <fenv.h>
#include <stdlib.h>
#include <string.h>

#include "call/kernel/rigid_poses.h"

#define STACK_DOUBLES 1024 /* number of doubles; larger operands use malloc */

/* The operands of one run of the inner loop. */
typedef struct {
    const Kernel *kernel;
    char **args;
    const npy_intp *steps;
    const npy_intp *core_strides[MAX_OPERANDS];
    int buffered[MAX_OPERANDS]; /* whether the kernel works on a copy of the operand */
} LoopOperands;

static int is_dense(const Operand *operand, const npy_intp *strides)
{
    npy_intp expected = sizeof(double);
    for (int i = operand->ndim - 1; i >= 0; i--) {
        if (operand->dims[i] != 1 && strides[i] != expected) {
            return 0;
        }
        expected *= operand->dims[i];
    }
    return 1;
}

/* Copies between strided core elements and a dense buffer, in row-major order. */
static void copy_elements(const Operand *operand, const npy_intp *strides, char *strided,
                          double *dense, int gather)
{
    npy_intp index[MAX_CORE_NDIM] = {0};
    for (npy_intp k = 0; k < operand->size; k++) {
        if (gather) {
            dense[k] = *(const double *)strided;
        } else {
            *(double *)strided = dense[k];
        }
        for (int i = operand->ndim - 1; i >= 0; i--) {
            strided += strides[i];
            if (++index[i] < operand->dims[i]) {
                break;
            }
            strided -= strides[i] * operand->dims[i];
            index[i] = 0;
        }
    }
}

/* Tests whether the kernel needs a copy of an operand. The kernel needs a copy if the elements of
 * the operand are not dense, or if an input shares memory with an output. NumPy copies overlapping
 * operands, unless an input and an output are the same array. In this case, a copy is needed,
 * because only elementwise functions compute correct results in place. */
static int needs_buffer(const Kernel *kernel, int i, char **args, const npy_intp *core_strides)
{
    const Operand *operand = &kernel->operands[i];
    if (!is_dense(operand, core_strides)) {
        return 1;
    }
    for (int j = kernel->n_inputs; i < kernel->n_inputs && j < kernel->n_operands; j++) {
        if (overlaps((double *)args[i], operand->size, (double *)args[j],
                     kernel->operands[j].size)) {
            return 1;
        }
    }
    return 0;
}

/* Runs the code for many poses. Rows are dense, and strides are multiples of 8 bytes. */
static void run_rows(const Kernel *kernel, npy_intp n, char **args, const npy_intp *steps)
{
    ptrdiff_t in_doubles[MAX_OPERANDS];
    for (int i = 0; i < kernel->n_operands; i++) {
        in_doubles[i] = steps[i] / (npy_intp)sizeof(double);
    }
    run_kernel_rows(kernel, n, (const double *const *)args, in_doubles,
                    (double *const *)(args + kernel->n_inputs), in_doubles + kernel->n_inputs);
}

/* Runs the kernel row by row, with copies of the buffered operands in the scratch memory. */
static void run_buffered(const LoopOperands *loop, npy_intp n, double *scratch)
{
    const Kernel *kernel = loop->kernel;
    const int n_inputs = kernel->n_inputs, n_operands = kernel->n_operands;
    double *buffers[MAX_OPERANDS]; /* address of the copy, NULL without a copy */
    double *pointers[MAX_OPERANDS];
    for (int i = 0; i < n_operands; i++) {
        buffers[i] = loop->buffered[i] ? scratch : NULL;
        scratch += loop->buffered[i] ? kernel->operands[i].size : 0;
    }
    for (npy_intp k = 0; k < n; k++) {
        for (int i = 0; i < n_operands; i++) {
            char *element = loop->args[i] + k * loop->steps[i];
            pointers[i] = buffers[i] ? buffers[i] : (double *)element;
            if (buffers[i] && i < n_inputs) {
                copy_elements(&kernel->operands[i], loop->core_strides[i], element, buffers[i], 1);
            }
        }
        run_kernel(kernel, (const double *const *)pointers, pointers + n_inputs);
        for (int i = n_inputs; i < n_operands; i++) {
            if (buffers[i]) {
                copy_elements(&kernel->operands[i], loop->core_strides[i],
                              loop->args[i] + k * loop->steps[i], buffers[i], 0);
            }
        }
    }
}

/* The inner loop of the ufunc; it runs without the GIL. */
static void ufunc_loop(char **args, const npy_intp *dimensions, const npy_intp *steps, void *data)
{
    const Kernel *kernel = data;
    LoopOperands loop = {.kernel = kernel, .args = args, .steps = steps};
    const npy_intp *strides = steps + kernel->n_operands;
    npy_intp needed = 0;
    for (int i = 0; i < kernel->n_operands; i++) {
        loop.core_strides[i] = strides;
        loop.buffered[i] = needs_buffer(kernel, i, args, strides);
        needed += loop.buffered[i] ? kernel->operands[i].size : 0;
        strides += kernel->operands[i].ndim;
    }
    if (kernel->rows && !needed) {
        run_rows(kernel, dimensions[0], args, steps);
    } else {
        double stack[STACK_DOUBLES], *scratch = stack;
        if (needed > STACK_DOUBLES && !(scratch = malloc(needed * sizeof(double)))) {
            NPY_ALLOW_C_API_DEF
            NPY_ALLOW_C_API
            PyErr_NoMemory();
            NPY_DISABLE_C_API
            return;
        }
        run_buffered(&loop, dimensions[0], scratch);
        if (scratch != stack) {
            free(scratch);
        }
    }
    /* NaN and infinity propagate without a NumPy warning. */
    feclearexcept(FE_ALL_EXCEPT);
}

/* Returns a copy that PyMem_Free releases, or NULL on error. */
static char *copy_text(PyObject *text)
{
    Py_ssize_t size;
    const char *utf8 = PyUnicode_AsUTF8AndSize(text, &size);
    char *copy = utf8 ? PyMem_Malloc(size + 1) : NULL;
    if (copy) {
        memcpy(copy, utf8, size + 1);
    } else if (utf8) {
        PyErr_NoMemory();
    }
    return copy;
}

/* Returns the signature, as in "(6),(6)->(4,4)". */
static PyObject *ufunc_signature(const Kernel *kernel)
{
    PyObject *text = PyUnicode_FromString("");
    for (int i = 0; text && i < kernel->n_operands; i++) {
        const Operand *operand = &kernel->operands[i];
        const char *before = i == 0 ? "" : i == kernel->n_inputs ? "->" : ",";
        Py_SETREF(text, PyUnicode_FromFormat("%U%s(", text, before));
        for (int j = 0; text && j < operand->ndim; j++) {
            Py_SETREF(text, PyUnicode_FromFormat("%U%s%zd", text, j ? "," : "",
                                                 (Py_ssize_t)operand->dims[j]));
        }
        if (text) {
            Py_SETREF(text, PyUnicode_FromFormat("%U)", text));
        }
    }
    return text;
}

static void kernel_capsule_free(PyObject *capsule)
{
    kernel_free(PyCapsule_GetPointer(capsule, NULL));
}

PyObject *ufunc_new(Kernel *kernel, PyObject *name, PyObject *doc)
{
    PyObject *ufunc = NULL, *signature = NULL;
    PyObject *capsule = PyCapsule_New(kernel, NULL, kernel_capsule_free);
    if (!capsule) {
        kernel_free(kernel);
        return NULL;
    }
    kernel->ufunc_loops[0] = (PyUFuncGenericFunction)ufunc_loop;
    kernel->ufunc_data[0] = kernel;
    memset(kernel->ufunc_types, NPY_DOUBLE, sizeof kernel->ufunc_types);
    kernel->ufunc_name = copy_text(name);
    kernel->ufunc_doc = kernel->ufunc_name ? copy_text(doc) : NULL;
    signature = kernel->ufunc_doc ? ufunc_signature(kernel) : NULL;
    if (signature) {
        ufunc = PyUFunc_FromFuncAndDataAndSignature(
            kernel->ufunc_loops, kernel->ufunc_data, kernel->ufunc_types, 1, kernel->n_inputs,
            kernel->n_outputs, PyUFunc_None, kernel->ufunc_name, kernel->ufunc_doc, 0,
            PyUnicode_AsUTF8(signature));
        Py_DECREF(signature);
    }
    if (ufunc) {
        ((PyUFuncObject *)ufunc)->obj = Py_NewRef(capsule);
    }
    Py_DECREF(capsule);
    return ufunc;
}
