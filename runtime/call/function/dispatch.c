/* Dispatch of a call to one of three functions. For arguments that are dense float64 arrays of the
 * core shape, call_single runs the kernel directly on the caller's memory. For dense float64
 * batches of one shape without out=, call_dense runs the kernel. In all other calls, call_general
 * converts and checks the arguments. The ufunc then broadcasts the leading dimensions. With
 * threads=, the ufunc runs on parts of the batch (threads.py). Arguments with __array_ufunc__ are
 * passed to overrides.py.
 *
 * In a call of inverse kinematics, fixed= contains the redundancy parameters. If fixed= contains
 * other joints, Python handles the call. */
#include <string.h>

#include "call/function/arguments.h"
#include "call/function/function.h"
#include "call/function/results.h"
#include "call/kernel/buffer_pool.h"
#include "call/kernel/rigid_poses.h"

#define MIN_LONG 8192 /* rows */

/* Tests whether the kernel can write directly into the caller's arrays. An output must not share
 * memory with any other operand, because kernels may read inputs after writing outputs. */
static int are_direct_outputs(const Kernel *kernel, PyObject *const *inputs, PyObject *const *outs)
{
    const double *memory[MAX_OPERANDS];
    for (int i = 0; i < kernel->n_inputs; i++) {
        memory[i] = PyArray_DATA((PyArrayObject *)inputs[i]);
    }
    for (int i = kernel->n_inputs; i < kernel->n_operands; i++) {
        PyObject *out = outs[i - kernel->n_inputs];
        memory[i] = NULL;
        if (out == Py_None) {
            continue;
        }
        if (!is_core_array(out, &kernel->operands[i]) ||
            !PyArray_ISWRITEABLE((PyArrayObject *)out)) {
            return 0;
        }
        memory[i] = PyArray_DATA((PyArrayObject *)out);
        for (int j = 0; j < i; j++) {
            if (memory[j] && overlaps(memory[i], kernel->operands[i].size, memory[j],
                                      kernel->operands[j].size)) {
                return 0;
            }
        }
    }
    return 1;
}

/* Runs the kernel on core arrays. The function creates outputs if outs is NULL or contains None. */
static PyObject *call_single(Function *self, PyObject *const *inputs, PyObject *const *outs)
{
    const Kernel *kernel = self->kernel;
    const double *from[MAX_OPERANDS];
    double *to[MAX_OPERANDS];
    PyObject *results[MAX_OPERANDS];
    const Operand *outputs = kernel->operands + kernel->n_inputs;

    for (int i = 0; i < kernel->n_inputs; i++) {
        from[i] = PyArray_DATA((PyArrayObject *)inputs[i]);
    }
    for (int i = 0; i < kernel->n_outputs; i++) {
        results[i] =
            outs && outs[i] != Py_None
                ? Py_NewRef(outs[i])
                : PyArray_SimpleNew(outputs[i].ndim, (npy_intp *)outputs[i].dims, NPY_DOUBLE);
        if (!results[i]) {
            while (i-- > 0) {
                Py_DECREF(results[i]);
            }
            return NULL;
        }
        to[i] = PyArray_DATA((PyArrayObject *)results[i]);
    }
    run_kernel(kernel, from, to);
    if (__builtin_expect(self->guard != NULL, 0)) {
        return pack_guarded(self, inputs, to, results, outs);
    }
    return pack(self, inputs, results, outs);
}

/* Returns the common leading dimensions if all inputs are dense float64 arrays, otherwise NULL. */
static const npy_intp *shared_leading_shape(const Kernel *kernel, PyObject *const *inputs,
                                            int *ndim)
{
    const npy_intp *batch = NULL;
    for (int i = 0; i < kernel->n_inputs; i++) {
        const Operand *operand = &kernel->operands[i];
        PyArrayObject *array = (PyArrayObject *)inputs[i];
        if (!PyArray_CheckExact(inputs[i]) || PyArray_TYPE(array) != NPY_DOUBLE ||
            !PyArray_ISCARRAY_RO(array)) {
            return NULL;
        }
        int leading = PyArray_NDIM(array) - operand->ndim;
        const npy_intp *dims = PyArray_DIMS(array);
        if (leading < 1 || !PyArray_CompareLists(operand->dims, dims + leading, operand->ndim) ||
            (batch && (leading != *ndim || !PyArray_CompareLists(batch, dims, leading)))) {
            return NULL;
        }
        batch = dims;
        *ndim = leading;
    }
    return batch;
}

/* Tests whether a batch is so long that Python must handle Ctrl-C between parts. */
static int is_long(npy_intp n)
{
    return n >= MIN_LONG;
}

/* Tests whether the results for n rows are large enough for the memory pool. */
static int is_large(const Kernel *kernel, npy_intp n)
{
    double size = 0.0; /* a double, because an integer could overflow */
    for (int i = kernel->n_inputs; i < kernel->n_operands; i++) {
        size += (double)kernel->operands[i].size;
    }
    return (double)n * size >= (double)(MIN_KEPT / sizeof(double));
}

static void run_dense_rows(const Kernel *kernel, npy_intp n, double **memory)
{
    ptrdiff_t steps[MAX_OPERANDS];
    for (int i = 0; i < kernel->n_operands; i++) {
        steps[i] = kernel->operands[i].size;
    }
    run_kernel_rows(kernel, n, (const double *const *)memory, steps, memory + kernel->n_inputs,
                    steps + kernel->n_inputs);
}

/* Runs the kernel on dense batches of one shape, into new arrays. For few poses, this function is
 * faster than the ufunc. */
static PyObject *call_dense(const Function *self, PyObject *const *inputs, const npy_intp *batch,
                            int ndim)
{
    const Kernel *kernel = self->kernel;
    double *memory[MAX_OPERANDS];
    PyObject *results[MAX_OPERANDS];
    npy_intp n = PyArray_MultiplyList(batch, ndim), dims[NPY_MAXDIMS + MAX_CORE_NDIM];
    int large = is_large(kernel, n);
    memcpy(dims, batch, ndim * sizeof(npy_intp));
    for (int i = 0; i < kernel->n_inputs; i++) {
        memory[i] = PyArray_DATA((PyArrayObject *)inputs[i]);
    }
    for (int i = 0; i < kernel->n_outputs; i++) {
        const Operand *operand = &kernel->operands[kernel->n_inputs + i];
        memcpy(dims + ndim, operand->dims, operand->ndim * sizeof(npy_intp));
        results[i] = large ? new_large(ndim + operand->ndim, dims)
                           : PyArray_SimpleNew(ndim + operand->ndim, dims, NPY_DOUBLE);
        if (!results[i]) {
            while (i-- > 0) {
                Py_DECREF(results[i]);
            }
            return NULL;
        }
        memory[kernel->n_inputs + i] = PyArray_DATA((PyArrayObject *)results[i]);
    }
    NPY_BEGIN_THREADS_DEF
    NPY_BEGIN_THREADS_THRESHOLDED(n)
    run_dense_rows(kernel, n, memory);
    NPY_END_THREADS
    return pack(self, inputs, results, NULL);
}

static PyObject *call_ufunc(Function *self, PyObject *const *inputs, PyObject *const *outs)
{
    int n_inputs = self->kernel->n_inputs;
    PyObject *args[MAX_OPERANDS + 1];
    memcpy(args, inputs, n_inputs * sizeof(PyObject *));
    if (!outs) {
        return PyObject_Vectorcall(self->ufunc, args, n_inputs, NULL);
    }
    PyObject *keywords = PyTuple_Pack(1, str_out);
    PyObject *out = new_tuple(self->kernel->n_outputs, outs);
    PyObject *result = NULL;
    if (keywords && out) {
        args[n_inputs] = out;
        result = PyObject_Vectorcall(self->ufunc, args, n_inputs, keywords);
    }
    Py_XDECREF(keywords);
    Py_XDECREF(out);
    return result;
}

/* Calls run(function, inputs, outs) of a Python module, where outs is a tuple or None. If `leading`
 * is not NULL, the function also receives the leading shape and the number of threads. */
static PyObject *call_python(const char *module, Function *self, PyObject *const *inputs,
                             PyObject *const *outs, PyObject *leading, long threads)
{
    PyObject *imported = PyImport_ImportModule(module);
    PyObject *given = new_tuple(self->kernel->n_inputs, inputs);
    PyObject *out = outs ? new_tuple(self->kernel->n_outputs, outs) : Py_NewRef(Py_None);
    PyObject *result = NULL;
    if (imported && given && out) {
        result = leading ? PyObject_CallMethod(imported, "run", "OOOOl", self, given, out, leading,
                                               threads)
                         : PyObject_CallMethod(imported, "run", "OOO", self, given, out);
    }
    Py_XDECREF(imported);
    Py_XDECREF(given);
    Py_XDECREF(out);
    return result;
}

static PyObject *call_threads(Function *self, PyObject *const *inputs, PyObject *const *outs,
                              const LeadingShape *batch, long threads)
{
    PyObject *shape = PyArray_IntTupleFromIntp(batch->ndim, batch->dims);
    if (!shape) {
        return NULL;
    }
    PyObject *result = call_python("chasles.call.threads", self, inputs, outs, shape, threads);
    Py_DECREF(shape);
    return result;
}

/* Passes the call to the __array_ufunc__ protocol of an argument. */
static PyObject *call_override(Function *self, PyObject *const *inputs, PyObject *const *outs,
                               PyObject *own, long threads)
{
    if (threads != 1) {
        PyErr_Format(InputError,
                     "%U: threads splits NumPy arrays; leave it out where an argument is a %s",
                     self->kernel->label, Py_TYPE(own)->tp_name);
        return NULL;
    }
    return call_python("chasles.call.overrides", self, inputs, outs, NULL, threads);
}

/* Creates missing output arrays of a large batch in the memory pool; the ufunc would use malloc.
 * Returns -1 on error. */
static int new_large_results(const Kernel *kernel, const LeadingShape *batch, PyObject *const *outs,
                             PyObject **results)
{
    npy_intp dims[NPY_MAXDIMS + MAX_CORE_NDIM];
    memcpy(dims, batch->dims, batch->ndim * sizeof(npy_intp));
    for (int i = 0; i < kernel->n_outputs; i++) {
        const Operand *operand = &kernel->operands[kernel->n_inputs + i];
        memcpy(dims + batch->ndim, operand->dims, operand->ndim * sizeof(npy_intp));
        results[i] = outs && outs[i] != Py_None ? Py_NewRef(outs[i])
                                                : new_large(batch->ndim + operand->ndim, dims);
        if (!results[i]) {
            while (i-- > 0) {
                Py_DECREF(results[i]);
            }
            return -1;
        }
    }
    return 0;
}

static PyObject *call_broadcast(Function *self, PyObject *const *inputs, PyObject *const *outs,
                                const LeadingShape *batch, long threads)
{
    const Kernel *kernel = self->kernel;
    PyObject *results[MAX_OPERANDS];
    npy_intp n = PyArray_OverflowMultiplyList((npy_intp *)batch->dims, batch->ndim);
    int large = is_large(kernel, n); /* n is -1 if the number of poses overflows */
    if (large && new_large_results(kernel, batch, outs, results) < 0) {
        return NULL;
    }
    PyObject *const *into = large ? results : outs;
    PyObject *result = threads == 1 && !is_long(n)
                           ? call_ufunc(self, inputs, into)
                           : call_threads(self, inputs, into, batch, threads);
    for (int i = 0; large && i < kernel->n_outputs; i++) {
        Py_DECREF(results[i]);
    }
    return result;
}

/* Checks the converted arrays, then runs the kernel once or over a batch. */
static PyObject *call_checked(Function *self, PyObject *const *inputs, PyObject *const *outs,
                              long threads)
{
    const Kernel *kernel = self->kernel;
    LeadingShape batch;
    if (broadcast_inputs(kernel, inputs, &batch) < 0) {
        return NULL;
    }
    for (int i = 0; outs && i < kernel->n_outputs; i++) {
        const Operand *operand = &kernel->operands[kernel->n_inputs + i];
        if (outs[i] != Py_None && check_out(kernel, operand, &batch, outs[i]) < 0) {
            return NULL;
        }
    }
    int direct = 1;
    for (int i = 0; direct && i < kernel->n_inputs; i++) {
        direct = is_core_array(inputs[i], &kernel->operands[i]);
    }
    if (direct && (!outs || are_direct_outputs(kernel, inputs, outs))) {
        return call_single(self, inputs, outs);
    }
    PyObject *result = call_broadcast(self, inputs, outs, &batch, threads);
    if (self->guard && batch.ndim == 0) {
        result = guard_ufunc_result(self, inputs, result);
    }
    return branches_of_ufunc(self, inputs, result);
}

static PyObject *call_general(Function *self, PyObject *const *inputs, PyObject *const *outs,
                              long threads)
{
    const Kernel *kernel = self->kernel;
    for (int i = 0; i < kernel->n_inputs + (outs ? kernel->n_outputs : 0); i++) {
        PyObject *object = i < kernel->n_inputs ? inputs[i] : outs[i - kernel->n_inputs];
        int own = has_override(object);
        if (own != 0) {
            return own < 0 ? NULL : call_override(self, inputs, outs, object, threads);
        }
    }
    PyObject *read[MAX_OPERANDS], *result = NULL;
    int n_read = 0;
    for (; n_read < kernel->n_inputs; n_read++) {
        read[n_read] = read_input(kernel, &kernel->operands[n_read], inputs[n_read]);
        if (!read[n_read]) {
            break;
        }
    }
    if (n_read == kernel->n_inputs) {
        result = call_checked(self, read, outs, threads);
    }
    while (n_read-- > 0) {
        Py_DECREF(read[n_read]);
    }
    return result;
}

/* Calls the kernel by the fastest applicable function: call_single, call_dense or call_general. */
static PyObject *call_bound(Function *self, PyObject *const *inputs, PyObject *const *outs,
                            long threads)
{
    const Kernel *kernel = self->kernel;
    for (int i = 0; i < kernel->n_inputs; i++) {
        if (!is_core_array(inputs[i], &kernel->operands[i])) {
            int ndim = 0;
            const npy_intp *batch =
                outs || threads != 1 ? NULL : shared_leading_shape(kernel, inputs, &ndim);
            return batch && !is_long(PyArray_MultiplyList(batch, ndim))
                       ? call_dense(self, inputs, batch, ndim)
                       : call_general(self, inputs, outs, threads);
        }
    }
    if (outs && !are_direct_outputs(kernel, inputs, outs)) {
        return call_general(self, inputs, outs, threads);
    }
    return call_single(self, inputs, outs);
}

/* Calls an inverse kinematics function whose poses and fixed joint values are already in the order
 * of its inputs. */
static PyObject *call_fixed(Function *self, PyObject **slots)
{
    const Kernel *kernel = self->kernel;
    PyObject **options = slots + kernel->n_inputs, *const *outs = NULL, *result = NULL;
    long threads;
    int found = spread_fixed(kernel, self->parameters, options[2], slots);
    if (found <= 0) {
        for (int i = 0; i < N_OPTIONS; i++) {
            options[i] = options[i] ? options[i] : Py_None;
        }
        return found < 0 ? NULL
                         : PyObject_CallFunctionObjArgs(self->general, slots[0], options[2],
                                                        options[0], options[1], NULL);
    }
    if (read_out(kernel, options, &outs) == 0 &&
        (threads = read_threads(kernel, options[1])) >= 0) {
        result = call_bound(self, slots, outs, threads);
    }
    for (int i = 1; i < kernel->n_inputs; i++) {
        Py_DECREF(slots[i]);
    }
    return result;
}

PyObject *function_vectorcall(PyObject *object, PyObject *const *args, size_t n_flagged,
                              PyObject *keywords)
{
    Function *self = (Function *)object;
    const Kernel *kernel = self->kernel;
    PyObject *slots[MAX_OPERANDS + N_OPTIONS];
    PyObject *const *inputs = args;
    PyObject *const *outs = NULL;
    long threads = 1;

    Py_ssize_t n_args = PyVectorcall_NARGS(n_flagged);
    int takes_fixed = self->general != NULL;
    if (keywords || n_args != kernel->n_inputs || (takes_fixed && n_args > 1)) {
        PyObject **options = slots + kernel->n_inputs;
        if (bind_arguments(kernel, takes_fixed, args, n_args, keywords, slots) < 0) {
            return NULL;
        }
        if (takes_fixed && (kernel->n_inputs > 1 || (options[2] && options[2] != Py_None))) {
            return call_fixed(self, slots);
        }
        if (read_out(kernel, options, &outs) < 0 ||
            (threads = read_threads(kernel, options[1])) < 0) {
            return NULL;
        }
        inputs = slots;
    }
    return call_bound(self, inputs, outs, threads);
}
