#include "call/function/function.h"

#include <string.h>
#include <structmember.h>

#include "call/function/results.h"
#include "call/kernel/compiled_library.h"
#include "call/kernel/ufunc_loop.h"

/* Members for the Python objects that a Function owns. Some of the members may be NULL. */
static const size_t OWNED[] = {
    offsetof(Function, ufunc),   offsetof(Function, name),       offsetof(Function, label),
    offsetof(Function, doc),     offsetof(Function, signature),  offsetof(Function, inputs),
    offsetof(Function, outputs), offsetof(Function, operations), offsetof(Function, reduced),
    offsetof(Function, guard),   offsetof(Function, solutions),  offsetof(Function, refinement),
    offsetof(Function, general), offsetof(Function, parameters)};

static int function_traverse(Function *self, visitproc visit, void *arg)
{
    for (size_t i = 0; i < sizeof OWNED / sizeof *OWNED; i++) {
        Py_VISIT(*(PyObject **)((char *)self + OWNED[i]));
    }
    return 0;
}

/* The type has no tp_clear, because a call needs all members until it ends. A Function refers only
 * to objects that existed before it. A reference cycle through a Function therefore contains
 * another object that was changed later. The garbage collector breaks the cycle at this other
 * object. */
static void function_dealloc(Function *self)
{
    PyObject_GC_UnTrack(self);
    for (size_t i = 0; i < sizeof OWNED / sizeof *OWNED; i++) {
        Py_XDECREF(*(PyObject **)((char *)self + OWNED[i]));
    }
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

static PyMemberDef function_members[] = {
    {"ufunc", T_OBJECT_EX, offsetof(Function, ufunc), READONLY,
     "The NumPy generalized ufunc behind the call."},
    {"inputs", T_OBJECT_EX, offsetof(Function, inputs), READONLY,
     "Name, shape, unit and meaning of each input."},
    {"outputs", T_OBJECT_EX, offsetof(Function, outputs), READONLY,
     "Name, shape, unit and meaning of each output."},
    {"operations", T_OBJECT_EX, offsetof(Function, operations), READONLY,
     "Number of floating-point operations for one pose, by kind."},
    {"solutions", T_OBJECT, offsetof(Function, solutions), READONLY,
     "The class of the result of a function of all branches of an inverse, else None."},
    {"near", T_DOUBLE, offsetof(Function, near), READONLY,
     "Largest residual of a branch that is refined; 0 where none is."},
    {"tolerance", T_DOUBLE, offsetof(Function, tolerance), READONLY,
     "Largest residual of a valid branch; 0 where the outputs are no branches."},
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

/* Returns a PyCapsule with a pointer to the compiled function, for solvers in C. */
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

PyTypeObject FunctionType = {
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

PyObject *function_new(PyObject *library, PyObject *args, PyObject *kwargs)
{
    static char *keywords[] = {"name",       "inputs",     "outputs", "label", "doc",
                               "signature",  "operations", "reduced", "guard", "solutions",
                               "rescue",     "poses",      "fk",      "unit",  "general",
                               "parameters", NULL};
    PyObject *name, *inputs, *outputs, *label, *doc, *signature, *operations, *reduced, *guard,
        *solutions, *rescue, *general, *parameters;
    int poses;
    const char *fk_name;
    double unit;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "UO!O!$UUOOO!OOOizdOO!:function", keywords,
                                     &name, &PyTuple_Type, &inputs, &PyTuple_Type, &outputs, &label,
                                     &doc, &signature, &operations, &PyTuple_Type, &reduced, &guard,
                                     &solutions, &rescue, &poses, &fk_name, &unit, &general,
                                     &PyTuple_Type, &parameters)) {
        return NULL;
    }
    const char *utf8 = PyUnicode_AsUTF8(name);
    const chasles_kernel *entry = utf8 ? library_find((Library *)library, utf8) : NULL;
    if (!entry) {
        if (utf8) {
            PyErr_Format(MismatchError, "%U: has no function %R", ((Library *)library)->path, name);
        }
        return NULL;
    }
    const chasles_kernel *fk = fk_name ? library_find((Library *)library, fk_name) : NULL;
    Kernel *kernel = kernel_new(library, entry, label, inputs, outputs);
    if (kernel && poses && set_poses(kernel, poses, fk, unit) < 0) {
        kernel_free(kernel);
        return NULL;
    }
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
    function->general = general == Py_None ? NULL : Py_NewRef(general);
    function->parameters = Py_NewRef(parameters);
    if (set_solutions(function, solutions) < 0 || set_refinement(function, rescue) < 0) {
        Py_CLEAR(function);
    }
    return (PyObject *)function;
}
