#include "call/kernel/operands.h"

#include <limits.h>

void kernel_free(Kernel *kernel)
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
                     "%U: %zd inputs and %zd outputs; expected at least one of each and at most %d "
                     "in all",
                     kernel->label, n_inputs, n_outputs, MAX_OPERANDS);
        return -1;
    }
    kernel->n_inputs = (int)n_inputs;
    kernel->n_outputs = (int)n_outputs;
    kernel->n_operands = (int)(n_inputs + n_outputs);
    for (int i = 0; i < kernel->n_operands; i++) {
        PyObject *description =
            i < n_inputs ? PyTuple_GET_ITEM(inputs, i) : PyTuple_GET_ITEM(outputs, i - n_inputs);
        if (operand_read(&kernel->operands[i], description) < 0) {
            return -1;
        }
    }
    return 0;
}

/* Binds the functions of a library entry to the kernel if the sizes in the entry match the
 * manifest. A wrong size would write past the end of an array. Returns -1 on error. */
static int kernel_bind(Kernel *kernel, const chasles_kernel *entry)
{
    int agree = entry->n_inputs == kernel->n_inputs && entry->n_outputs == kernel->n_outputs;
    for (int i = 0; agree && i < kernel->n_operands; i++) {
        agree = entry->sizes[i] == kernel->operands[i].size;
    }
    if (!agree) {
        PyErr_Format(MismatchError,
                     "%U: the compiled function has other arguments or sizes than described",
                     kernel->label);
        return -1;
    }
    kernel->call = entry->call;
    kernel->rows = entry->rows;
    kernel->entry = entry;
    return 0;
}

Kernel *kernel_new(PyObject *library, const chasles_kernel *entry, PyObject *label,
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

/* Tests whether the forward kinematics maps the coordinates of one solution to one pose matrix. */
static int takes_slots(const chasles_kernel *fk, const Operand *outputs)
{
    return fk->n_inputs == 1 && fk->n_outputs == 1 && fk->sizes[1] == 16 &&
           fk->sizes[0] * outputs[1].size == outputs[0].size;
}

int set_poses(Kernel *kernel, int poses, const chasles_kernel *fk, double unit)
{
    const Operand *pose = kernel->operands, *outputs = kernel->operands + kernel->n_inputs;
    if (poses < NO_POSES || poses > POSES_JUDGED || kernel->n_outputs != 3 || pose->ndim != 2 ||
        pose->dims[0] != 4 || pose->dims[1] != 4 || outputs[1].size != outputs[2].size ||
        (fk && !takes_slots(fk, outputs))) {
        PyErr_Format(PyExc_TypeError,
                     "%U: an inverse of poses takes a pose (4, 4) first and returns slots of q, "
                     "residual and margin",
                     kernel->label);
        return -1;
    }
    kernel->poses = (PosesOf)poses;
    kernel->unit = unit;
    kernel->fk = unit == 1 ? NULL : fk;
    return 0;
}
