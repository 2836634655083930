/* chasles._call: calls compiled kernels from Python.
 *
 * Library    a compiled robot, opened and checked against the content hash that is expected.
 * Function   one kernel of it. A call takes one of three ways:
 *              call_once   every argument is a plain float64 array of the core shape; the kernel
 *                          runs on the caller's memory with nothing in between
 *              call_dense  every argument is a dense float64 batch of one shape, without out=
 *              call_any    all else: arguments are read and checked, then a NumPy generalized
 *                          ufunc broadcasts the leading dimensions; with threads= it is called
 *                          on parts of the batch (threads.py), and arguments with a ufunc
 *                          protocol of their own never come to it (overrides.py)
 *            A function that rests on loops has a guard (guard.py), which is told of every single
 *            pose whose result is not finite, and may raise. One that computes all branches of an
 *            inverse returns them as Solutions (solutions.py), with a fourth array: which are valid;
 *            where it comes near to a pose without reaching it, a last resort is asked (rescue.py).
 * Kernel     the description that Function and ufunc share, kept alive by the ufunc (a capsule).
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#include <dlfcn.h>
#include <fenv.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include <numpy/arrayobject.h>
#include <numpy/ufuncobject.h>

#include "contract/_kernel.h"

#define MAX_OPERANDS 32 /* inputs and outputs of one function */
#define MAX_CORE_NDIM 8
#define STACK_DOUBLES 1024 /* scratch for strided operands, before malloc is asked */
#define N_OPTIONS 2        /* keywords beside the inputs: out, threads */
#define ALL_THREADS 0      /* threads="all" */

static PyObject *ShapeError, *InputError, *LibraryMismatchError;
static PyObject *str_out, *str_threads, *str_name, *str_shape, *str_array_ufunc;
static PyObject *ndarray_array_ufunc;

/* ------------------------------------------------------------------ Library */

typedef struct {
    PyObject_HEAD
    void *handle;
    const chasles_kernel *kernels;
    PyObject *path;
} Library;

static PyTypeObject LibraryType;

static void library_dealloc(Library *self)
{
    if (self->handle) {
        dlclose(self->handle);
    }
    Py_XDECREF(self->path);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyObject *library_repr(Library *self)
{
    return PyUnicode_FromFormat("<chasles library %R>", self->path);
}

/* The symbol, or NULL with an error that names the file. */
static const void *find_symbol(Library *self, const char *symbol)
{
    const void *found = dlsym(self->handle, symbol);
    if (!found) {
        PyErr_Format(LibraryMismatchError, "%U: not a library of chasles (it has no %s)",
                     self->path, symbol);
    }
    return found;
}

static int library_load(Library *self, const char *path, const char *expected_hash)
{
    self->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!self->handle) {
        PyErr_Format(LibraryMismatchError, "%U: cannot be opened as a library (%s)", self->path,
                     dlerror());
        return -1;
    }
    const char *hash = find_symbol(self, "chasles_hash");
    if (!hash) {
        return -1;
    }
    if (strcmp(hash, expected_hash) != 0) {
        PyErr_Format(LibraryMismatchError,
                     "%U: compiled for content %.16s..., but %.16s... is expected", self->path,
                     hash, expected_hash);
        return -1;
    }
    self->kernels = find_symbol(self, "chasles_kernels");
    return self->kernels ? 0 : -1;
}

static PyObject *call_open(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *path_bytes;
    const char *expected_hash;
    if (!PyArg_ParseTuple(args, "O&s:open", PyUnicode_FSConverter, &path_bytes, &expected_hash)) {
        return NULL;
    }
    const char *path = PyBytes_AS_STRING(path_bytes);
    Library *self = (Library *)LibraryType.tp_alloc(&LibraryType, 0);
    if (self) {
        self->path = PyUnicode_DecodeFSDefault(path);
        if (!self->path || library_load(self, path, expected_hash) < 0) {
            Py_CLEAR(self);
        }
    }
    Py_DECREF(path_bytes);
    return (PyObject *)self;
}

/* -------------------------------------------------------- memory of results
 *
 * malloc returns blocks of 32 MB to the system as soon as they are freed (glibc), and the system
 * clears what it gives: for a large batch that takes as long as the kernel itself. So large results
 * have a memory handler of their own (NEP 49), which keeps what is freed for those of the next call.
 * A block belongs to one array or is kept, never both. Handlers run under the GIL: it is the lock.
 */
#define LEAST_KEPT ((size_t)32 << 20) /* bytes of a call's results; else malloc does as well */
#define MOST_KEPT ((size_t)256 << 20) /* bytes of all that is kept */
#define MAX_KEPT 32                   /* blocks */
#define HUGE_PAGE ((size_t)2 << 20) /* the system places whole ones at their boundaries */
#define BLOCK_HEAD 64 /* bytes before the array's, for the block's size; arrays stay aligned */

typedef struct {
    char *start;
    size_t size;
} Block;

static struct {
    Block blocks[MAX_KEPT]; /* the oldest first */
    int n;
    size_t bytes;
} kept;

/* The block of an array's memory. */
static Block block_of(void *memory)
{
    char *start = (char *)memory - BLOCK_HEAD;
    return (Block){start, *(size_t *)start};
}

/* Takes a block out of those that are kept. */
static Block kept_take(int i)
{
    Block block = kept.blocks[i];
    kept.n--;
    kept.bytes -= block.size;
    memmove(kept.blocks + i, kept.blocks + i + 1, (kept.n - i) * sizeof *kept.blocks);
    return block;
}

/* Returns the oldest blocks to the system until no more than that many, and bytes, are left. */
static void kept_shrink(int n, size_t bytes)
{
    while (kept.n > n || kept.bytes > bytes) {
        Block block = kept_take(0);
        munmap(block.start, block.size);
    }
}

/* The smallest of the kept blocks that hold so much and at most a quarter more; -1 if none does. */
static int kept_find(size_t size)
{
    int best = -1;
    for (int i = 0; i < kept.n; i++) {
        size_t own = kept.blocks[i].size;
        if (own >= size && own <= size + size / 4 &&
            (best < 0 || own < kept.blocks[best].size)) {
            best = i;
        }
    }
    return best;
}

static void *block_new(void *Py_UNUSED(context), size_t n)
{
    if (n > (size_t)PY_SSIZE_T_MAX - BLOCK_HEAD - HUGE_PAGE) {
        return NULL;
    }
    size_t size = (n + BLOCK_HEAD + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    int found = kept_find(size);
    Block block = {MAP_FAILED, size};
    if (found >= 0) {
        block = kept_take(found);
    }
    else {
        block.start = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (block.start == MAP_FAILED) {
            return NULL;
        }
#ifdef MADV_HUGEPAGE
        madvise(block.start, size, MADV_HUGEPAGE);
#endif
    }
    *(size_t *)block.start = block.size;
    return block.start + BLOCK_HEAD;
}

static void block_free(void *Py_UNUSED(context), void *memory, size_t Py_UNUSED(n))
{
    if (!memory) {
        return;
    }
    Block block = block_of(memory);
    if (block.size > MOST_KEPT) {
        munmap(block.start, block.size);
        return;
    }
    kept_shrink(MAX_KEPT - 1, MOST_KEPT - block.size);
    kept.blocks[kept.n++] = block;
    kept.bytes += block.size;
#ifdef MADV_FREE
    /* The system may take the pages, contents and all, where it runs short of memory. */
    madvise(block.start, block.size, MADV_FREE);
#endif
}

static void *block_new_zeroed(void *context, size_t n, size_t size)
{
    void *memory = size && n > SIZE_MAX / size ? NULL : block_new(context, n * size);
    return memory ? memset(memory, 0, n * size) : NULL;
}

static void *block_resize(void *context, void *memory, size_t n)
{
    void *other = block_new(context, n);
    if (other && memory) {
        size_t held = block_of(memory).size - BLOCK_HEAD;
        memcpy(other, memory, held < n ? held : n);
        block_free(context, memory, held);
    }
    return other;
}

static PyDataMem_Handler block_handler = {
    "chasles_results", 1, {NULL, block_new, block_new_zeroed, block_resize, block_free}};
static PyObject *block_capsule;

/* An array in a block. A handler that the program has chosen for its arrays is left in force. */
static PyObject *new_large(int ndim, npy_intp *dims)
{
    PyObject *chosen = PyDataMem_GetHandler();
    if (!chosen || chosen != PyDataMem_DefaultHandler) {
        Py_XDECREF(chosen);
        return chosen ? PyArray_SimpleNew(ndim, dims, NPY_DOUBLE) : NULL;
    }
    PyObject *before = PyDataMem_SetHandler(block_capsule);
    PyObject *result = before ? PyArray_SimpleNew(ndim, dims, NPY_DOUBLE) : NULL;
    PyObject *own = before ? PyDataMem_SetHandler(chosen) : NULL;
    if (!own) {
        Py_CLEAR(result);
    }
    Py_XDECREF(own);
    Py_XDECREF(before);
    Py_DECREF(chosen);
    return result;
}

static PyObject *call_release_memory(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(ignored))
{
    size_t bytes = kept.bytes;
    kept_shrink(0, 0);
    return PyLong_FromSize_t(bytes);
}

/* ------------------------------------------------------------------- Kernel */

typedef struct {
    PyObject *name;
    int ndim;
    npy_intp dims[MAX_CORE_NDIM];
    npy_intp size;
} Operand;

typedef struct {
    void (*call)(const double *const *inputs, double *const *outputs);
    void (*rows)(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
                 double *const *outputs, const ptrdiff_t *output_steps); /* or NULL */
    const chasles_kernel *entry; /* in the library */
    int n_inputs, n_outputs, n_operands;
    Operand operands[MAX_OPERANDS];
    PyObject *library;
    PyObject *label; /* "ur5e.fk", for messages */
    /* A ufunc keeps the pointers it is given, so what they point to lives here. */
    char *ufunc_name, *ufunc_doc;
    PyUFuncGenericFunction ufunc_loops[1];
    void *ufunc_data[1];
    char ufunc_types[MAX_OPERANDS];
} Kernel;

static void kernel_free(Kernel *kernel)
{
    for (int i = 0; i < kernel->n_operands; i++) {
        Py_XDECREF(kernel->operands[i].name);
    }
    Py_XDECREF(kernel->library);
    Py_XDECREF(kernel->label);
    PyMem_Free(kernel->ufunc_name);
    PyMem_Free(kernel->ufunc_doc);
    PyMem_Free(kernel);
}

static void kernel_capsule_free(PyObject *capsule)
{
    kernel_free(PyCapsule_GetPointer(capsule, NULL));
}

/* Reads .name and .shape of a description into the operand; -1 with an error set. */
static int operand_read(Operand *operand, PyObject *description)
{
    operand->name = PyObject_GetAttr(description, str_name);
    PyObject *shape = operand->name ? PyObject_GetAttr(description, str_shape) : NULL;
    if (!shape) {
        return -1;
    }
    if (!PyUnicode_Check(operand->name) || !PyTuple_Check(shape) ||
        PyTuple_GET_SIZE(shape) > MAX_CORE_NDIM) {
        PyErr_Format(PyExc_TypeError, "name %R, shape %R: expected a str and a tuple of at most %d",
                     operand->name, shape, MAX_CORE_NDIM);
        Py_DECREF(shape);
        return -1;
    }
    operand->ndim = (int)PyTuple_GET_SIZE(shape);
    operand->size = 1;
    for (int i = 0; i < operand->ndim; i++) {
        operand->dims[i] = PyLong_AsSsize_t(PyTuple_GET_ITEM(shape, i));
        if (operand->dims[i] < 1 || operand->dims[i] > INT_MAX / operand->size) {
            if (!PyErr_Occurred()) {
                PyErr_Format(PyExc_ValueError, "shape %R: expected positive sizes", shape);
            }
            Py_DECREF(shape);
            return -1;
        }
        operand->size *= operand->dims[i];
    }
    Py_DECREF(shape);
    return 0;
}

static int kernel_read_operands(Kernel *kernel, PyObject *inputs, PyObject *outputs)
{
    Py_ssize_t n_inputs = PyTuple_GET_SIZE(inputs), n_outputs = PyTuple_GET_SIZE(outputs);
    if (n_inputs < 1 || n_outputs < 1 || n_inputs + n_outputs > MAX_OPERANDS) {
        PyErr_Format(PyExc_ValueError,
                     "%U: %zd inputs and %zd outputs; expected one of each at least, %d in all at "
                     "most",
                     kernel->label, n_inputs, n_outputs, MAX_OPERANDS);
        return -1;
    }
    kernel->n_inputs = (int)n_inputs;
    kernel->n_outputs = (int)n_outputs;
    kernel->n_operands = (int)(n_inputs + n_outputs);
    for (int i = 0; i < kernel->n_operands; i++) {
        PyObject *description = i < n_inputs ? PyTuple_GET_ITEM(inputs, i)
                                             : PyTuple_GET_ITEM(outputs, i - n_inputs);
        if (operand_read(&kernel->operands[i], description) < 0) {
            return -1;
        }
    }
    return 0;
}

/* Takes the entry's function if its sizes are the ones described; the manifest alone is not
 * believed, for a wrong size would write past the end of an array. */
static int kernel_bind(Kernel *kernel, const chasles_kernel *entry)
{
    int agree = entry->n_inputs == kernel->n_inputs && entry->n_outputs == kernel->n_outputs;
    for (int i = 0; agree && i < kernel->n_operands; i++) {
        agree = entry->sizes[i] == kernel->operands[i].size;
    }
    if (!agree) {
        PyErr_Format(LibraryMismatchError,
                     "%U: the compiled function has other arguments or sizes than described",
                     kernel->label);
        return -1;
    }
    kernel->call = entry->call;
    kernel->rows = entry->rows;
    kernel->entry = entry;
    return 0;
}

/* ------------------------------------------------------- generalized ufunc */

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
static void copy_core(const Operand *operand, const npy_intp *strides, char *strided,
                      double *dense, int gather)
{
    npy_intp index[MAX_CORE_NDIM] = {0};
    for (npy_intp k = 0; k < operand->size; k++) {
        if (gather) {
            dense[k] = *(const double *)strided;
        }
        else {
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

/* Whether two dense operands touch: exact, as both are without gaps. */
static int overlap(const double *a, npy_intp a_size, const double *b, npy_intp b_size)
{
    return (uintptr_t)a < (uintptr_t)(b + b_size) && (uintptr_t)b < (uintptr_t)(a + a_size);
}

/* Whether the kernel must be given a copy of an operand's elements: where they lie apart, and where
 * an input is also an output, for kernels read inputs after they have begun to write. (NumPy copies
 * operands that overlap, but not the one that is exactly another: for elementwise functions that is
 * safe.) */
static int needs_buffer(const Kernel *kernel, int i, char **args, const npy_intp *core_strides)
{
    const Operand *operand = &kernel->operands[i];
    if (!is_dense(operand, core_strides)) {
        return 1;
    }
    for (int j = kernel->n_inputs; i < kernel->n_inputs && j < kernel->n_operands; j++) {
        if (overlap((double *)args[i], operand->size, (double *)args[j],
                    kernel->operands[j].size)) {
            return 1;
        }
    }
    return 0;
}

/* Hands dense rows to the code for many poses at once. Rows of aligned doubles lie a whole number of
 * doubles apart. */
static void run_rows(const Kernel *kernel, npy_intp n, char **args, const npy_intp *steps)
{
    ptrdiff_t in_doubles[MAX_OPERANDS];
    for (int i = 0; i < kernel->n_operands; i++) {
        in_doubles[i] = steps[i] / (npy_intp)sizeof(double);
    }
    kernel->rows((size_t)n, (const double *const *)args, in_doubles,
                 (double *const *)(args + kernel->n_inputs), in_doubles + kernel->n_inputs);
}

/* The inner loop of the ufunc; runs without the GIL. */
static void ufunc_loop(char **args, const npy_intp *dimensions, const npy_intp *steps, void *data)
{
    const Kernel *kernel = data;
    const int n_inputs = kernel->n_inputs, n_operands = kernel->n_operands;
    const npy_intp *core_strides[MAX_OPERANDS];
    double *buffers[MAX_OPERANDS]; /* NULL where the kernel may use the operand's own memory */
    double *pointers[MAX_OPERANDS];
    int buffered[MAX_OPERANDS];
    double stack[STACK_DOUBLES], *scratch = stack;
    npy_intp needed = 0;

    const npy_intp *strides = steps + n_operands;
    for (int i = 0; i < n_operands; i++) {
        core_strides[i] = strides;
        strides += kernel->operands[i].ndim;
        buffered[i] = needs_buffer(kernel, i, args, core_strides[i]);
        needed += buffered[i] ? kernel->operands[i].size : 0;
    }
    if (kernel->rows && !needed) {
        run_rows(kernel, dimensions[0], args, steps);
        feclearexcept(FE_ALL_EXCEPT);
        return;
    }
    if (needed > STACK_DOUBLES && !(scratch = malloc(needed * sizeof(double)))) {
        NPY_ALLOW_C_API_DEF
        NPY_ALLOW_C_API
        PyErr_NoMemory();
        NPY_DISABLE_C_API
        return;
    }
    double *next = scratch;
    for (int i = 0; i < n_operands; i++) {
        buffers[i] = buffered[i] ? next : NULL;
        next += buffered[i] ? kernel->operands[i].size : 0;
    }

    for (npy_intp k = 0; k < dimensions[0]; k++) {
        for (int i = 0; i < n_operands; i++) {
            char *element = args[i] + k * steps[i];
            pointers[i] = buffers[i] ? buffers[i] : (double *)element;
            if (buffers[i] && i < n_inputs) {
                copy_core(&kernel->operands[i], core_strides[i], element, buffers[i], 1);
            }
        }
        kernel->call((const double *const *)pointers, pointers + n_inputs);
        for (int i = n_inputs; i < n_operands; i++) {
            if (buffers[i]) {
                copy_core(&kernel->operands[i], core_strides[i], args[i] + k * steps[i],
                          buffers[i], 0);
            }
        }
    }
    if (scratch != stack) {
        free(scratch);
    }
    /* NaN and infinity flow through: NumPy shall not warn about what the kernels met. */
    feclearexcept(FE_ALL_EXCEPT);
}

/* A copy that PyMem_Free takes; NULL with an error set. */
static char *copy_text(PyObject *text)
{
    Py_ssize_t size;
    const char *utf8 = PyUnicode_AsUTF8AndSize(text, &size);
    char *copy = utf8 ? PyMem_Malloc(size + 1) : NULL;
    if (copy) {
        memcpy(copy, utf8, size + 1);
    }
    else if (utf8) {
        PyErr_NoMemory();
    }
    return copy;
}

/* "(6),(6)->(4,4)" */
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

/* Makes the ufunc, which takes the kernel over: it is freed with the ufunc, or here on error. */
static PyObject *ufunc_new(Kernel *kernel, PyObject *name, PyObject *doc)
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

/* ----------------------------------------------------------------- Function */

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    const Kernel *kernel; /* owned by the ufunc */
    PyObject *ufunc;
    PyObject *name, *label, *doc, *signature, *inputs, *outputs, *operations, *reduced;
    PyObject *guard; /* NULL where the result is finite for every finite input */
    PyTypeObject *solutions; /* a kind of tuple; NULL where the outputs are no branches */
    double tolerance;        /* residual up to which a branch is valid */
    PyObject *rescue;        /* NULL where there is no last resort */
    double near;             /* residual up to which it is asked */
} Function;

static PyTypeObject FunctionType;

static int function_traverse(Function *self, visitproc visit, void *arg)
{
    Py_VISIT(self->ufunc);
    Py_VISIT(self->signature);
    Py_VISIT(self->inputs);
    Py_VISIT(self->outputs);
    Py_VISIT(self->operations);
    Py_VISIT(self->reduced);
    Py_VISIT(self->guard);
    Py_VISIT(self->solutions);
    Py_VISIT(self->rescue);
    return 0;
}

/* No tp_clear: all members are set once, from values made before, so that a cycle through a
 * Function always holds some other object that can be cleared. A call needs them to the end. */
static void function_dealloc(Function *self)
{
    PyObject_GC_UnTrack(self);
    Py_XDECREF(self->ufunc);
    Py_XDECREF(self->name);
    Py_XDECREF(self->label);
    Py_XDECREF(self->doc);
    Py_XDECREF(self->signature);
    Py_XDECREF(self->inputs);
    Py_XDECREF(self->outputs);
    Py_XDECREF(self->operations);
    Py_XDECREF(self->reduced);
    Py_XDECREF(self->guard);
    Py_XDECREF(self->solutions);
    Py_XDECREF(self->rescue);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyObject *function_repr(Function *self)
{
    return PyUnicode_FromFormat("<chasles function %U%S>", self->label, self->signature);
}

static PyObject *function_reduce(Function *self, PyObject *Py_UNUSED(ignored))
{
    return Py_NewRef(self->reduced);
}

/* ------------------------------------------------------------ the short way */

/* Whether the object is memory that a kernel can use as it is. */
static inline int is_plain(PyObject *object, const Operand *operand)
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

/* Whether the kernel may write straight into the caller's arrays. It may not where an output
 * touches another operand: kernels read inputs after they have begun to write. */
static int is_plain_out(const Kernel *kernel, PyObject *const *inputs, PyObject *const *outs)
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
        if (!is_plain(out, &kernel->operands[i]) || !PyArray_ISWRITEABLE((PyArrayObject *)out)) {
            return 0;
        }
        memory[i] = PyArray_DATA((PyArrayObject *)out);
        for (int j = 0; j < i; j++) {
            if (memory[j] && overlap(memory[i], kernel->operands[i].size, memory[j],
                                     kernel->operands[j].size)) {
                return 0;
            }
        }
    }
    return 1;
}

/* A tuple of new references; NULL with an error set. */
static PyObject *tuple_of(int n, PyObject *const *items)
{
    PyObject *tuple = PyTuple_New(n);
    for (int i = 0; tuple && i < n; i++) {
        PyTuple_SET_ITEM(tuple, i, Py_NewRef(items[i]));
    }
    return tuple;
}

/* ---------------------------------------------------------------- branches */

/* The outputs of a function of all branches, in this order, then which of them are valid. */
enum { BRANCH_Q, BRANCH_RESIDUAL, BRANCH_MARGIN, BRANCH_VALID, N_BRANCH_FIELDS };

/* Whether any of n poses has no valid slot of its k, but one with a residual of at most near. */
static int any_missed(npy_intp n, npy_intp k, const double *residual, const npy_bool *valid,
                      double near)
{
    for (; n-- > 0; residual += k, valid += k) {
        npy_bool solved = 0;
        for (npy_intp slot = 0; slot < k; slot++) {
            solved |= valid[slot];
        }
        for (npy_intp slot = 0; !solved && slot < k; slot++) {
            if (residual[slot] <= near) {
                return 1;
            }
        }
    }
    return 0;
}

/* residual <= tolerance as a new array of booleans, false where the residual is NaN. Sets *missed to
 * whether the last resort is to be asked. */
static PyObject *judge(const Function *self, PyArrayObject *residual, int *missed)
{
    int ndim = PyArray_NDIM(residual);
    PyArrayObject *valid =
        (PyArrayObject *)PyArray_SimpleNew(ndim, PyArray_DIMS(residual), NPY_BOOL);
    PyArrayObject *dense =
        PyArray_ISCARRAY_RO(residual)
            ? (PyArrayObject *)Py_NewRef(residual)
            : (PyArrayObject *)PyArray_FROM_OTF((PyObject *)residual, NPY_DOUBLE,
                                                NPY_ARRAY_IN_ARRAY);
    if (!valid || !dense) {
        Py_XDECREF(valid);
        Py_XDECREF(dense);
        return NULL;
    }
    npy_intp n = PyArray_SIZE(dense), k = PyArray_DIM(dense, ndim - 1);
    const double *from = PyArray_DATA(dense), tolerance = self->tolerance;
    npy_bool *to = PyArray_DATA(valid);
    NPY_BEGIN_THREADS_DEF
    NPY_BEGIN_THREADS_THRESHOLDED(n)
    for (npy_intp i = 0; i < n; i++) {
        to[i] = from[i] <= tolerance;
    }
    *missed = self->rescue && any_missed(n / k, k, from, to, self->near);
    NPY_END_THREADS
    Py_DECREF(dense);
    return (PyObject *)valid;
}

/* Asks the last resort, which changes results and valid in place; -1 with an error set. */
static int ask_rescue(const Function *self, PyObject *const *inputs, PyObject **results,
                      PyObject *valid)
{
    PyObject *given = tuple_of(self->kernel->n_inputs, inputs);
    PyObject *answer =
        given ? PyObject_CallFunctionObjArgs(self->rescue, given, results[BRANCH_Q],
                                             results[BRANCH_RESIDUAL], valid, NULL)
              : NULL;
    Py_XDECREF(given);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

/* The branches as Solutions; steals the references of the three results. */
static PyObject *pack_branches(const Function *self, PyObject *const *inputs, PyObject **results)
{
    int missed = 0;
    PyObject *valid = judge(self, (PyArrayObject *)results[BRANCH_RESIDUAL], &missed);
    if (missed && ask_rescue(self, inputs, results, valid) < 0) {
        Py_CLEAR(valid);
    }
    PyObject *solutions =
        valid ? self->solutions->tp_alloc(self->solutions, N_BRANCH_FIELDS) : NULL;
    if (!solutions) {
        Py_XDECREF(valid);
        for (int i = 0; i < BRANCH_VALID; i++) {
            Py_DECREF(results[i]);
        }
        return NULL;
    }
    for (int i = 0; i < BRANCH_VALID; i++) {
        PyTuple_SET_ITEM(solutions, i, results[i]);
    }
    PyTuple_SET_ITEM(solutions, BRANCH_VALID, valid);
    return solutions;
}

/* What the ufunc returned, as Solutions where it is branches; steals the reference. */
static PyObject *as_branches(const Function *self, PyObject *const *inputs, PyObject *result)
{
    if (!self->solutions || !result) {
        return result;
    }
    PyObject *results[BRANCH_VALID];
    for (int i = 0; i < BRANCH_VALID; i++) {
        results[i] = Py_NewRef(PyTuple_GET_ITEM(result, i));
    }
    Py_DECREF(result);
    return pack_branches(self, inputs, results);
}

/* Takes the class for the branches and the tolerance that it tells; -1 with an error set. */
static int take_solutions(Function *self, PyObject *type)
{
    if (type == Py_None) {
        return 0;
    }
    if (!PyType_Check(type) || !PyType_IsSubtype((PyTypeObject *)type, &PyTuple_Type) ||
        ((PyTypeObject *)type)->tp_basicsize != PyTuple_Type.tp_basicsize ||
        self->kernel->n_outputs != BRANCH_VALID) {
        PyErr_Format(PyExc_TypeError,
                     "%U: solutions must be a kind of tuple without fields of its own, for a "
                     "function of %d outputs, got %R",
                     self->label, BRANCH_VALID, type);
        return -1;
    }
    PyObject *tolerance = PyObject_GetAttrString(type, "TOLERANCE");
    self->tolerance = tolerance ? PyFloat_AsDouble(tolerance) : -1.0;
    Py_XDECREF(tolerance);
    if (PyErr_Occurred()) {
        return -1;
    }
    self->solutions = (PyTypeObject *)Py_NewRef(type);
    return 0;
}

/* Takes the last resort and from which residual on it is asked; -1 with an error set. */
static int take_rescue(Function *self, PyObject *rescue)
{
    if (rescue == Py_None) {
        return 0;
    }
    PyObject *near = PyObject_GetAttrString(rescue, "near");
    self->near = near ? PyFloat_AsDouble(near) : -1.0;
    Py_XDECREF(near);
    if (PyErr_Occurred()) {
        return -1;
    }
    self->rescue = Py_NewRef(rescue);
    return 0;
}

/* ------------------------------------------------------------- the results */

/* One result, or a tuple of several; steals the references. Empty shapes become scalars, as
 * NumPy's own functions have it, unless the caller gave the array. */
static PyObject *pack(const Function *self, PyObject *const *inputs, PyObject **results,
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
        }
        else {
            PyTuple_SET_ITEM(tuple, i, results[i]);
        }
    }
    return tuple;
}

static int is_finite(const double *values, npy_intp size)
{
    int strange = 0;
    for (npy_intp k = 0; k < size; k++) {
        strange |= !(fabs(values[k]) <= DBL_MAX); /* without a branch: in lanes */
    }
    return !strange;
}

/* Whether all outputs of one pose are finite. */
static int are_finite(const Kernel *kernel, double *const *outputs)
{
    for (int i = 0; i < kernel->n_outputs; i++) {
        if (!is_finite(outputs[i], kernel->operands[kernel->n_inputs + i].size)) {
            return 0;
        }
    }
    return 1;
}

/* Tells the guard of a pose whose result is not finite; -1 with the error that it raised. */
static int ask_guard(Function *self, PyObject *const *inputs)
{
    PyObject *given = tuple_of(self->kernel->n_inputs, inputs);
    PyObject *answer = given ? PyObject_CallOneArg(self->guard, given) : NULL;
    Py_XDECREF(given);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

/* As pack, unless the guard raises. Not inlined: the way of functions without a guard is short. */
__attribute__((noinline)) static PyObject *pack_guarded(Function *self, PyObject *const *inputs,
                                                        double *const *memory, PyObject **results,
                                                        PyObject *const *outs)
{
    const Kernel *kernel = self->kernel;
    if (!are_finite(kernel, memory) && ask_guard(self, inputs) < 0) {
        for (int i = 0; i < kernel->n_outputs; i++) {
            Py_DECREF(results[i]);
        }
        return NULL;
    }
    return pack(self, inputs, results, outs);
}

/* Runs the kernel on plain inputs, into plain outs or new arrays (outs NULL, or None within). */
static PyObject *call_once(Function *self, PyObject *const *inputs, PyObject *const *outs)
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
        results[i] = outs && outs[i] != Py_None
                         ? Py_NewRef(outs[i])
                         : PyArray_SimpleNew(outputs[i].ndim, (npy_intp *)outputs[i].dims,
                                             NPY_DOUBLE);
        if (!results[i]) {
            while (i-- > 0) {
                Py_DECREF(results[i]);
            }
            return NULL;
        }
        to[i] = PyArray_DATA((PyArrayObject *)results[i]);
    }
    kernel->call(from, to);
    if (__builtin_expect(self->guard != NULL, 0)) {
        return pack_guarded(self, inputs, to, results, outs);
    }
    return pack(self, inputs, results, outs);
}

/* The leading dimensions that all inputs share where all are dense float64 arrays, else NULL. */
static const npy_intp *shared_batch(const Kernel *kernel, PyObject *const *inputs, int *ndim)
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

/* Whether the results for n rows are worth blocks. */
static int is_large(const Kernel *kernel, npy_intp n)
{
    double size = 0.0; /* in floating point it cannot overflow */
    for (int i = kernel->n_inputs; i < kernel->n_operands; i++) {
        size += (double)kernel->operands[i].size;
    }
    return (double)n * size >= (double)(LEAST_KEPT / sizeof(double));
}

/* Runs the kernel on n rows without gaps. */
static void run_dense(const Kernel *kernel, npy_intp n, double **memory)
{
    ptrdiff_t steps[MAX_OPERANDS];
    for (int i = 0; i < kernel->n_operands; i++) {
        steps[i] = kernel->operands[i].size;
    }
    if (kernel->rows && n > 1) {
        kernel->rows((size_t)n, (const double *const *)memory, steps, memory + kernel->n_inputs,
                     steps + kernel->n_inputs);
        return;
    }
    for (npy_intp row = 0; row < n; row++) {
        kernel->call((const double *const *)memory, memory + kernel->n_inputs);
        for (int i = 0; i < kernel->n_operands; i++) {
            memory[i] += steps[i];
        }
    }
}

/* Dense batches of one shape into new arrays: what the ufunc would do, without its preparations,
 * which cost more than a few poses. */
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
    run_dense(kernel, n, memory);
    NPY_END_THREADS
    return pack(self, inputs, results, NULL);
}

/* ------------------------------------------------------------- the long way */

/* Whether the type brings its own __array_ufunc__ (dask, units): 1, 0, or -1 on error. */
static int has_override(PyObject *object)
{
    if (PyArray_CheckExact(object) || PyList_CheckExact(object) || PyTuple_CheckExact(object) ||
        PyFloat_CheckExact(object) || PyLong_CheckExact(object) || PyArray_IsScalar(object, Generic)) {
        return 0;
    }
    PyObject *method = PyObject_GetAttr((PyObject *)Py_TYPE(object), str_array_ufunc);
    if (!method) {
        if (!PyErr_ExceptionMatches(PyExc_AttributeError)) {
            return -1;
        }
        PyErr_Clear();
        return 0;
    }
    int own = method != ndarray_array_ufunc;
    Py_DECREF(method);
    return own;
}

/* "6" or "4 x 4", for messages. */
static PyObject *sizes_text(int ndim, const npy_intp *dims, const char *between)
{
    PyObject *text = PyUnicode_FromString("");
    for (int i = 0; text && i < ndim; i++) {
        Py_SETREF(text, PyUnicode_FromFormat("%U%s%zd", text, i ? between : "",
                                             (Py_ssize_t)dims[i]));
    }
    return text;
}

/* "(5,)" or "(2, 6)": the shape as Python prints it. */
static PyObject *shape_text(int ndim, const npy_intp *dims)
{
    PyObject *shape = PyArray_IntTupleFromIntp(ndim, dims);
    PyObject *text = shape ? PyObject_Repr(shape) : NULL;
    Py_XDECREF(shape);
    return text;
}

static int check_core_shape(const Kernel *kernel, const Operand *operand, PyArrayObject *array)
{
    int extra = PyArray_NDIM(array) - operand->ndim;
    int agree = extra >= 0;
    for (int i = 0; agree && i < operand->ndim; i++) {
        agree = PyArray_DIM(array, extra + i) == operand->dims[i];
    }
    if (agree) {
        return 0;
    }
    PyObject *values = sizes_text(operand->ndim, operand->dims, " x ");
    PyObject *core = sizes_text(operand->ndim, operand->dims, ", ");
    PyObject *got = shape_text(PyArray_NDIM(array), PyArray_DIMS(array));
    if (values && core && got) {
        PyErr_Format(ShapeError, "%U: %U must end in %U value%s (shape (..., %U)), got shape %U",
                     kernel->label, operand->name, values, operand->size == 1 ? "" : "s", core,
                     got);
    }
    Py_XDECREF(values);
    Py_XDECREF(core);
    Py_XDECREF(got);
    return -1;
}

/* Turns NumPy's complaint about an argument into one that names the argument. */
static void chain_input_error(const Kernel *kernel, const Operand *operand)
{
    if (!PyErr_ExceptionMatches(PyExc_ValueError) && !PyErr_ExceptionMatches(PyExc_TypeError)) {
        return;
    }
    PyObject *type, *cause, *traceback;
    PyErr_Fetch(&type, &cause, &traceback);
    PyErr_NormalizeException(&type, &cause, &traceback);
    PyErr_Format(InputError, "%U: %U cannot be read as an array of numbers: %S", kernel->label,
                 operand->name, cause);
    PyObject *type2, *error, *traceback2;
    PyErr_Fetch(&type2, &error, &traceback2);
    PyErr_NormalizeException(&type2, &error, &traceback2);
    PyException_SetCause(error, cause); /* steals cause */
    PyErr_Restore(type2, error, traceback2);
    Py_XDECREF(type);
    Py_XDECREF(traceback);
}

/* The argument as an aligned native float64 array of the right core shape, copied only where it
 * is not one yet. The kind is looked at before the cast, so that "1", True or 1j is refused. */
static PyObject *read_input(const Kernel *kernel, const Operand *operand, PyObject *object)
{
    PyArrayObject *array =
        (PyArrayObject *)PyArray_FromAny(object, NULL, 0, 0, NPY_ARRAY_ENSUREARRAY, NULL);
    if (!array) {
        chain_input_error(kernel, operand);
        return NULL;
    }
    if (!PyTypeNum_ISINTEGER(PyArray_TYPE(array)) && !PyTypeNum_ISFLOAT(PyArray_TYPE(array))) {
        PyErr_Format(InputError, "%U: %U must hold real numbers, got dtype %S", kernel->label,
                     operand->name, PyArray_DESCR(array));
        Py_DECREF(array);
        return NULL;
    }
    if (check_core_shape(kernel, operand, array) < 0) {
        Py_DECREF(array);
        return NULL;
    }
    PyObject *result = PyArray_FromArray(
        array, PyArray_DescrFromType(NPY_DOUBLE),
        NPY_ARRAY_ALIGNED | NPY_ARRAY_NOTSWAPPED | NPY_ARRAY_FORCECAST);
    Py_DECREF(array);
    return result;
}

typedef struct {
    int ndim;
    npy_intp dims[NPY_MAXDIMS];
} Batch;

/* The sizes of an input's leading dimensions against those of the inputs before it. */
static int check_leading(const Kernel *kernel, const Operand *operand, PyArrayObject *array,
                         const Batch *batch)
{
    int ndim = PyArray_NDIM(array) - operand->ndim;
    for (int i = 1; i <= ndim && i <= batch->ndim; i++) {
        npy_intp own = PyArray_DIM(array, ndim - i), other = batch->dims[batch->ndim - i];
        if (own != other && own != 1 && other != 1) {
            PyObject *shape = shape_text(ndim, PyArray_DIMS(array));
            PyObject *before = shape_text(batch->ndim, batch->dims);
            if (shape && before) {
                PyErr_Format(ShapeError,
                             "%U: leading dimensions do not broadcast: %U has %U, those before it "
                             "%U",
                             kernel->label, operand->name, shape, before);
            }
            Py_XDECREF(shape);
            Py_XDECREF(before);
            return -1;
        }
    }
    return 0;
}

/* Broadcasts the leading dimensions of all inputs; -1 with an error that names the two. */
static int read_batch(const Kernel *kernel, PyObject *const *inputs, Batch *batch)
{
    batch->ndim = 0;
    for (int i = 0; i < kernel->n_inputs; i++) {
        PyArrayObject *array = (PyArrayObject *)inputs[i];
        if (check_leading(kernel, &kernel->operands[i], array, batch) < 0) {
            return -1;
        }
        int ndim = PyArray_NDIM(array) - kernel->operands[i].ndim;
        if (ndim > batch->ndim) {
            int more = ndim - batch->ndim;
            memmove(batch->dims + more, batch->dims, batch->ndim * sizeof(npy_intp));
            for (int j = 0; j < more; j++) {
                batch->dims[j] = 1;
            }
            batch->ndim = ndim;
        }
        npy_intp *dims = batch->dims + (batch->ndim - ndim);
        for (int j = 0; j < ndim; j++) {
            dims[j] = dims[j] == 1 ? PyArray_DIM(array, j) : dims[j];
        }
    }
    return 0;
}

/* An array given as out must be exactly what the call would have returned. */
static int check_out(const Kernel *kernel, const Operand *operand, const Batch *batch,
                     PyObject *object)
{
    if (!PyArray_Check(object)) {
        PyErr_Format(InputError, "%U: out for %U must be a NumPy array, got %s", kernel->label,
                     operand->name, Py_TYPE(object)->tp_name);
        return -1;
    }
    PyArrayObject *out = (PyArrayObject *)object;
    if (PyArray_TYPE(out) != NPY_DOUBLE || !PyArray_ISNOTSWAPPED(out)) {
        PyErr_Format(InputError, "%U: out for %U must have dtype float64, got %S", kernel->label,
                     operand->name, PyArray_DESCR(out));
        return -1;
    }
    if (!PyArray_ISWRITEABLE(out)) {
        PyErr_Format(InputError, "%U: out for %U is read-only", kernel->label, operand->name);
        return -1;
    }
    npy_intp dims[NPY_MAXDIMS + MAX_CORE_NDIM];
    int ndim = batch->ndim + operand->ndim;
    memcpy(dims, batch->dims, batch->ndim * sizeof(npy_intp));
    memcpy(dims + batch->ndim, operand->dims, operand->ndim * sizeof(npy_intp));
    if (ndim == PyArray_NDIM(out) && PyArray_CompareLists(dims, PyArray_DIMS(out), ndim)) {
        return 0;
    }
    PyObject *expected = shape_text(ndim, dims);
    PyObject *got = shape_text(PyArray_NDIM(out), PyArray_DIMS(out));
    if (expected && got) {
        PyErr_Format(ShapeError, "%U: out for %U must have shape %U, got shape %U", kernel->label,
                     operand->name, expected, got);
    }
    Py_XDECREF(expected);
    Py_XDECREF(got);
    return -1;
}

/* Hands the inputs to the ufunc, with out=outs where given. */
static PyObject *call_ufunc(Function *self, PyObject *const *inputs, PyObject *const *outs)
{
    int n_inputs = self->kernel->n_inputs;
    PyObject *args[MAX_OPERANDS + 1];
    memcpy(args, inputs, n_inputs * sizeof(PyObject *));
    if (!outs) {
        return PyObject_Vectorcall(self->ufunc, args, n_inputs, NULL);
    }
    PyObject *keywords = PyTuple_Pack(1, str_out);
    PyObject *out = tuple_of(self->kernel->n_outputs, outs);
    PyObject *result = NULL;
    if (keywords && out) {
        args[n_inputs] = out;
        result = PyObject_Vectorcall(self->ufunc, args, n_inputs, keywords);
    }
    Py_XDECREF(keywords);
    Py_XDECREF(out);
    return result;
}

/* Calls module.run(function, inputs, outs) in Python, where outs is a tuple or None, with the
 * batch's shape and the number of threads as further arguments unless batch is NULL. */
static PyObject *call_python(const char *module, Function *self, PyObject *const *inputs,
                             PyObject *const *outs, PyObject *batch, long threads)
{
    PyObject *imported = PyImport_ImportModule(module);
    PyObject *given = tuple_of(self->kernel->n_inputs, inputs);
    PyObject *out = outs ? tuple_of(self->kernel->n_outputs, outs) : Py_NewRef(Py_None);
    PyObject *result = NULL;
    if (imported && given && out) {
        result = batch ? PyObject_CallMethod(imported, "run", "OOOOl", self, given, out, batch,
                                             threads)
                       : PyObject_CallMethod(imported, "run", "OOO", self, given, out);
    }
    Py_XDECREF(imported);
    Py_XDECREF(given);
    Py_XDECREF(out);
    return result;
}

/* Parts of the batch, each on a thread of its own. */
static PyObject *call_threads(Function *self, PyObject *const *inputs, PyObject *const *outs,
                              const Batch *batch, long threads)
{
    PyObject *shape = PyArray_IntTupleFromIntp(batch->ndim, batch->dims);
    if (!shape) {
        return NULL;
    }
    PyObject *result = call_python("chasles.call.threads", self, inputs, outs, shape, threads);
    Py_DECREF(shape);
    return result;
}

/* Arguments with a ufunc protocol of their own: they bring their own parallelism, if any. */
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

/* The result of one pose that the ufunc computed, unless the guard raises; steals the result. */
static PyObject *guarded(Function *self, PyObject *const *inputs, PyObject *result)
{
    const Kernel *kernel = self->kernel;
    int finite = 1;
    for (int i = 0; result && finite && i < kernel->n_outputs; i++) {
        PyObject *item = kernel->n_outputs == 1 ? result : PyTuple_GET_ITEM(result, i);
        PyObject *array = PyArray_FROM_OTF(item, NPY_DOUBLE, NPY_ARRAY_IN_ARRAY);
        if (!array) {
            Py_CLEAR(result);
            break;
        }
        finite = is_finite(PyArray_DATA((PyArrayObject *)array),
                           kernel->operands[kernel->n_inputs + i].size);
        Py_DECREF(array);
    }
    if (!finite && ask_guard(self, inputs) < 0) {
        Py_CLEAR(result);
    }
    return result;
}

/* The arrays for a large batch, for the ufunc would ask malloc: new ones in the places that the caller
 * left free. -1 with an error set. */
static int large_results(const Kernel *kernel, const Batch *batch, PyObject *const *outs,
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

/* Runs the ufunc over a batch, on as many threads. */
static PyObject *call_batch(Function *self, PyObject *const *inputs, PyObject *const *outs,
                            const Batch *batch, long threads)
{
    const Kernel *kernel = self->kernel;
    PyObject *results[MAX_OPERANDS];
    npy_intp n = PyArray_OverflowMultiplyList((npy_intp *)batch->dims, batch->ndim);
    int large = is_large(kernel, n); /* not if n is -1, too many for any array */
    if (large && large_results(kernel, batch, outs, results) < 0) {
        return NULL;
    }
    PyObject *const *into = large ? results : outs;
    PyObject *result = threads == 1 ? call_ufunc(self, inputs, into)
                                    : call_threads(self, inputs, into, batch, threads);
    for (int i = 0; large && i < kernel->n_outputs; i++) {
        Py_DECREF(results[i]);
    }
    return result;
}

/* Checks what was read, then runs the kernel once or over a batch. */
static PyObject *call_read(Function *self, PyObject *const *inputs, PyObject *const *outs,
                           long threads)
{
    const Kernel *kernel = self->kernel;
    Batch batch;
    if (read_batch(kernel, inputs, &batch) < 0) {
        return NULL;
    }
    for (int i = 0; outs && i < kernel->n_outputs; i++) {
        const Operand *operand = &kernel->operands[kernel->n_inputs + i];
        if (outs[i] != Py_None && check_out(kernel, operand, &batch, outs[i]) < 0) {
            return NULL;
        }
    }
    int plain = 1;
    for (int i = 0; plain && i < kernel->n_inputs; i++) {
        plain = is_plain(inputs[i], &kernel->operands[i]);
    }
    if (plain && (!outs || is_plain_out(kernel, inputs, outs))) {
        return call_once(self, inputs, outs);
    }
    PyObject *result = call_batch(self, inputs, outs, &batch, threads);
    if (self->guard && batch.ndim == 0) {
        result = guarded(self, inputs, result);
    }
    return as_branches(self, inputs, result);
}

static PyObject *call_any(Function *self, PyObject *const *inputs, PyObject *const *outs,
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
        result = call_read(self, read, outs, threads);
    }
    while (n_read-- > 0) {
        Py_DECREF(read[n_read]);
    }
    return result;
}

/* ---------------------------------------------------------------- the call */

/* "q, qd", for messages. */
static PyObject *input_names(const Kernel *kernel)
{
    PyObject *text = PyUnicode_FromString("");
    for (int i = 0; text && i < kernel->n_inputs; i++) {
        Py_SETREF(text, PyUnicode_FromFormat("%U%s%U", text, i ? ", " : "",
                                             kernel->operands[i].name));
    }
    return text;
}

static int fail_count(const Kernel *kernel, Py_ssize_t n_given)
{
    PyObject *names = input_names(kernel);
    if (names) {
        PyErr_Format(InputError, "%U: takes %d input%s (%U), got %zd", kernel->label,
                     kernel->n_inputs, kernel->n_inputs == 1 ? "" : "s", names, n_given);
        Py_DECREF(names);
    }
    return -1;
}

/* The slot of a keyword: an input's index, n_inputs for out, the next for threads; -1 if there is
 * none or on error. */
static int find_keyword(const Kernel *kernel, PyObject *keyword)
{
    for (int i = 0; i < kernel->n_inputs + N_OPTIONS; i++) {
        PyObject *name = i < kernel->n_inputs    ? kernel->operands[i].name
                         : i == kernel->n_inputs ? str_out
                                                 : str_threads;
        int equal = PyObject_RichCompareBool(keyword, name, Py_EQ);
        if (equal != 0) {
            return equal < 0 ? -1 : i;
        }
    }
    PyObject *names = input_names(kernel);
    if (names) {
        PyErr_Format(InputError, "%U: unknown argument %R; it takes %U, out and threads",
                     kernel->label, keyword, names);
        Py_DECREF(names);
    }
    return -1;
}

/* Sorts the arguments into slots: one per input, then out and threads. */
static int bind_arguments(const Kernel *kernel, PyObject *const *args, Py_ssize_t n_args,
                          PyObject *keywords, PyObject **slots)
{
    Py_ssize_t n_keywords = keywords ? PyTuple_GET_SIZE(keywords) : 0, n_given = n_args;
    if (n_args > kernel->n_inputs) {
        return fail_count(kernel, n_args);
    }
    memcpy(slots, args, n_args * sizeof(PyObject *));
    memset(slots + n_args, 0, (kernel->n_inputs + N_OPTIONS - n_args) * sizeof(PyObject *));
    for (Py_ssize_t k = 0; k < n_keywords; k++) {
        int slot = find_keyword(kernel, PyTuple_GET_ITEM(keywords, k));
        if (slot < 0) {
            return -1;
        }
        if (slots[slot]) {
            PyErr_Format(InputError, "%U: %U is given twice", kernel->label,
                         PyTuple_GET_ITEM(keywords, k));
            return -1;
        }
        slots[slot] = args[n_args + k];
        n_given += slot < kernel->n_inputs;
    }
    return n_given == kernel->n_inputs ? 0 : fail_count(kernel, n_given);
}

/* The arrays to write into, one pointer per output, None where a new one is wanted. Sets *outs to
 * NULL if there are none at all. */
static int read_out(const Kernel *kernel, PyObject **out, PyObject *const **outs)
{
    *outs = NULL;
    if (!*out || *out == Py_None) {
        return 0;
    }
    if (PyTuple_CheckExact(*out)) {
        if (PyTuple_GET_SIZE(*out) == kernel->n_outputs) {
            *outs = ((PyTupleObject *)*out)->ob_item;
            return 0;
        }
    }
    else if (kernel->n_outputs == 1) {
        *outs = out;
        return 0;
    }
    PyErr_Format(InputError, "%U: out must be %s of %d, one for each output", kernel->label,
                 kernel->n_outputs == 1 ? "an array, or a tuple" : "a tuple", kernel->n_outputs);
    return -1;
}

/* How many threads are asked for, at least 1, or ALL_THREADS; -1 with an error set. */
static long read_threads(const Kernel *kernel, PyObject *given)
{
    if (!given || given == Py_None) {
        return 1;
    }
    if (PyUnicode_Check(given) && PyUnicode_CompareWithASCIIString(given, "all") == 0) {
        return ALL_THREADS;
    }
    if (PyIndex_Check(given) && !PyBool_Check(given)) {
        Py_ssize_t threads = PyNumber_AsSsize_t(given, NULL); /* NULL: clips what is too large */
        if (threads >= 1) {
            return threads;
        }
        if (PyErr_Occurred()) {
            if (!PyErr_ExceptionMatches(PyExc_TypeError)) {
                return -1;
            }
            PyErr_Clear(); /* an array of several integers */
        }
    }
    PyErr_Format(InputError, "%U: threads must be a positive integer or 'all', got %R",
                 kernel->label, given);
    return -1;
}

static PyObject *function_vectorcall(PyObject *object, PyObject *const *args, size_t n_flagged,
                                     PyObject *keywords)
{
    Function *self = (Function *)object;
    const Kernel *kernel = self->kernel;
    PyObject *slots[MAX_OPERANDS + N_OPTIONS];
    PyObject *const *inputs = args;
    PyObject *const *outs = NULL;
    long threads = 1;

    Py_ssize_t n_args = PyVectorcall_NARGS(n_flagged);
    if (keywords || n_args != kernel->n_inputs) {
        if (bind_arguments(kernel, args, n_args, keywords, slots) < 0 ||
            read_out(kernel, &slots[kernel->n_inputs], &outs) < 0 ||
            (threads = read_threads(kernel, slots[kernel->n_inputs + 1])) < 0) {
            return NULL;
        }
        inputs = slots;
    }
    for (int i = 0; i < kernel->n_inputs; i++) {
        if (!is_plain(inputs[i], &kernel->operands[i])) {
            int ndim;
            const npy_intp *batch =
                outs || threads != 1 ? NULL : shared_batch(kernel, inputs, &ndim);
            return batch ? call_dense(self, inputs, batch, ndim)
                         : call_any(self, inputs, outs, threads);
        }
    }
    if (outs && !is_plain_out(kernel, inputs, outs)) {
        return call_any(self, inputs, outs, threads);
    }
    return call_once(self, inputs, outs);
}

static PyMemberDef function_members[] = {
    {"ufunc", T_OBJECT_EX, offsetof(Function, ufunc), READONLY,
     "The NumPy generalized ufunc behind the call."},
    {"inputs", T_OBJECT_EX, offsetof(Function, inputs), READONLY,
     "What it takes: name, shape, unit and meaning of each input."},
    {"outputs", T_OBJECT_EX, offsetof(Function, outputs), READONLY,
     "What it returns: name, shape, unit and meaning of each output."},
    {"operations", T_OBJECT_EX, offsetof(Function, operations), READONLY,
     "How many floating-point operations one pose costs, by kind."},
    {"solutions", T_OBJECT, offsetof(Function, solutions), READONLY,
     "The class of its result where that is all branches of an inverse, else None."},
    {"__name__", T_OBJECT_EX, offsetof(Function, name), READONLY, NULL},
    {"__qualname__", T_OBJECT_EX, offsetof(Function, label), READONLY, NULL},
    {"__doc__", T_OBJECT_EX, offsetof(Function, doc), READONLY, NULL},
    {"__signature__", T_OBJECT_EX, offsetof(Function, signature), READONLY, NULL},
    {NULL},
};

static void entry_capsule_free(PyObject *capsule)
{
    Py_DECREF((PyObject *)PyCapsule_GetContext(capsule));
}

/* Solvers in C call the kernel without a Python call in between. */
static PyObject *function_kernel(Function *self, void *Py_UNUSED(closure))
{
    void *entry = (void *)self->kernel->entry;
    PyObject *capsule = PyCapsule_New(entry, CHASLES_KERNEL_CAPSULE, entry_capsule_free);
    if (capsule) {
        PyCapsule_SetContext(capsule, Py_NewRef(self));
    }
    return capsule;
}

static PyGetSetDef function_getset[] = {
    {"kernel", (getter)function_kernel, NULL,
     "A capsule with the compiled function (chasles_kernel of _kernel.h), for solvers in C.", NULL},
    {NULL},
};

static PyMethodDef function_methods[] = {
    {"__reduce__", (PyCFunction)function_reduce, METH_NOARGS, NULL},
    {"__class_getitem__", Py_GenericAlias, METH_O | METH_CLASS,
     "Function[R] is the type of a function that returns R."},
    {NULL},
};

static PyTypeObject FunctionType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "chasles.call._call.Function",
    .tp_doc = "One compiled function of a robot; see its own help and `robot.functions`.",
    .tp_basicsize = sizeof(Function),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_vectorcall_offset = offsetof(Function, vectorcall),
    .tp_call = PyVectorcall_Call,
    .tp_dealloc = (destructor)function_dealloc,
    .tp_traverse = (traverseproc)function_traverse,
    .tp_repr = (reprfunc)function_repr,
    .tp_members = function_members,
    .tp_getset = function_getset,
    .tp_methods = function_methods,
};

/* -------------------------------------------------------- Library.function */

static const chasles_kernel *find_kernel(const Library *library, const char *name)
{
    for (const chasles_kernel *entry = library->kernels; entry->name; entry++) {
        if (strcmp(entry->name, name) == 0) {
            return entry;
        }
    }
    return NULL;
}

static Kernel *kernel_new(Library *library, const chasles_kernel *entry, PyObject *label,
                          PyObject *inputs, PyObject *outputs)
{
    Kernel *kernel = PyMem_Calloc(1, sizeof(Kernel));
    if (!kernel) {
        PyErr_NoMemory();
        return NULL;
    }
    kernel->library = Py_NewRef(library);
    kernel->label = Py_NewRef(label);
    if (kernel_read_operands(kernel, inputs, outputs) < 0 || kernel_bind(kernel, entry) < 0) {
        kernel_free(kernel);
        return NULL;
    }
    return kernel;
}

static PyObject *library_function(Library *self, PyObject *args, PyObject *kwargs)
{
    static char *keywords[] = {"name",      "inputs",     "outputs", "label", "doc",
                               "signature", "operations", "reduced", "guard", "solutions",
                               "rescue",    NULL};
    PyObject *name, *inputs, *outputs, *label, *doc, *signature, *operations, *reduced, *guard,
        *solutions, *rescue;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "UO!O!$UUOOO!OOO:function", keywords, &name,
                                     &PyTuple_Type, &inputs, &PyTuple_Type, &outputs, &label, &doc,
                                     &signature, &operations, &PyTuple_Type, &reduced, &guard,
                                     &solutions, &rescue)) {
        return NULL;
    }
    const char *utf8 = PyUnicode_AsUTF8(name);
    const chasles_kernel *entry = utf8 ? find_kernel(self, utf8) : NULL;
    if (!entry) {
        if (utf8) {
            PyErr_Format(LibraryMismatchError, "%U: has no function %R", self->path, name);
        }
        return NULL;
    }
    Kernel *kernel = kernel_new(self, entry, label, inputs, outputs);
    PyObject *ufunc = kernel ? ufunc_new(kernel, name, doc) : NULL;
    Function *function = ufunc ? (Function *)FunctionType.tp_alloc(&FunctionType, 0) : NULL;
    if (!function) {
        Py_XDECREF(ufunc);
        return NULL;
    }
    function->vectorcall = function_vectorcall;
    function->kernel = kernel;
    function->ufunc = ufunc;
    function->name = Py_NewRef(name);
    function->label = Py_NewRef(label);
    function->doc = Py_NewRef(doc);
    function->signature = Py_NewRef(signature);
    function->inputs = Py_NewRef(inputs);
    function->outputs = Py_NewRef(outputs);
    function->operations = Py_NewRef(operations);
    function->reduced = Py_NewRef(reduced);
    function->guard = guard == Py_None ? NULL : Py_NewRef(guard);
    if (take_solutions(function, solutions) < 0 || take_rescue(function, rescue) < 0) {
        Py_CLEAR(function);
    }
    return (PyObject *)function;
}

static PyObject *library_names(Library *self, void *Py_UNUSED(closure))
{
    PyObject *names = PyList_New(0);
    for (const chasles_kernel *entry = self->kernels; names && entry->name; entry++) {
        PyObject *name = PyUnicode_FromString(entry->name);
        if (!name || PyList_Append(names, name) < 0) {
            Py_CLEAR(names);
        }
        Py_XDECREF(name);
    }
    return names;
}

static PyGetSetDef library_getset[] = {
    {"names", (getter)library_names, NULL, "The names of its functions.", NULL},
    {NULL},
};

static PyMethodDef library_methods[] = {
    {"function", (PyCFunction)(void (*)(void))library_function, METH_VARARGS | METH_KEYWORDS,
     "The function of that name; inputs and outputs describe it and must agree with the C."},
    {NULL},
};

static PyTypeObject LibraryType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "chasles.call._call.Library",
    .tp_doc = "A compiled robot, open for as long as any of its functions lives.",
    .tp_basicsize = sizeof(Library),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_dealloc = (destructor)library_dealloc,
    .tp_repr = (reprfunc)library_repr,
    .tp_methods = library_methods,
    .tp_getset = library_getset,
};

/* ------------------------------------------------------------------- module */

static PyMethodDef module_methods[] = {
    {"open", call_open, METH_VARARGS,
     "open(path, expected_hash): the library, refused unless it was compiled for that hash."},
    {"release_memory", call_release_memory, METH_NOARGS,
     "release_memory(): returns to the system the memory that is kept for large results (of 32 MB\n"
     "a call and more; 256 MB at most); gives how many bytes that was."},
    {NULL},
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.call._call",
    .m_doc = "Calls compiled kernels on NumPy arrays.",
    .m_size = -1,
    .m_methods = module_methods,
};

static int import_names(void)
{
    PyObject *errors = PyImport_ImportModule("chasles.errors");
    if (!errors) {
        return -1;
    }
    ShapeError = PyObject_GetAttrString(errors, "ShapeError");
    InputError = PyObject_GetAttrString(errors, "InputTypeError");
    LibraryMismatchError = PyObject_GetAttrString(errors, "LibraryMismatchError");
    Py_DECREF(errors);
    str_out = PyUnicode_InternFromString("out");
    str_threads = PyUnicode_InternFromString("threads");
    str_name = PyUnicode_InternFromString("name");
    str_shape = PyUnicode_InternFromString("shape");
    str_array_ufunc = PyUnicode_InternFromString("__array_ufunc__");
    if (!ShapeError || !InputError || !LibraryMismatchError || !str_out || !str_threads ||
        !str_name || !str_shape || !str_array_ufunc) {
        return -1;
    }
    ndarray_array_ufunc = PyObject_GetAttr((PyObject *)&PyArray_Type, str_array_ufunc);
    return ndarray_array_ufunc ? 0 : -1;
}

PyMODINIT_FUNC PyInit__call(void)
{
    import_array();
    import_umath();
    block_capsule = PyCapsule_New(&block_handler, "mem_handler", NULL);
    if (!block_capsule || import_names() < 0 || PyType_Ready(&LibraryType) < 0 || PyType_Ready(&FunctionType) < 0) {
        return NULL;
    }
    PyObject *module = PyModule_Create(&module_definition);
    if (module && (PyModule_AddObjectRef(module, "Library", (PyObject *)&LibraryType) < 0 ||
                   PyModule_AddObjectRef(module, "Function", (PyObject *)&FunctionType) < 0)) {
        Py_CLEAR(module);
    }
    return module;
}
