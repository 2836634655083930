/* MEX gateway for MATLAB and Octave, called as name(function, input, ...) for one or many
 * configurations. The file is the same for every robot of chasles. */
#ifndef CHASLES_MEX_H
#define CHASLES_MEX_H

#include <mex.h>
#include <string.h>

#include "chasles_functions.h"

static const chasles_function *chasles_found(const chasles_function *functions, int count,
                                             const mxArray *name)
{
    char text[64];
    if (!mxIsChar(name) || mxGetString(name, text, sizeof text)) {
        mexErrMsgIdAndTxt("chasles:function", "expected the name of a function");
    }
    for (int k = 0; k < count; k++) {
        if (!strcmp(functions[k].name, text)) {
            return &functions[k];
        }
    }
    mexErrMsgIdAndTxt("chasles:function", "no function %s", text);
    return NULL;
}

/* Returns the number of configurations in an input. A vector input with only one configuration may
 * be a row instead of a column. */
static size_t chasles_count(const chasles_array *array, const mxArray *given)
{
    const int is_matrix = array->shape[1] > 1;
    const mwSize dimensions = mxGetNumberOfDimensions(given);
    const mwSize *sizes = mxGetDimensions(given);
    const size_t entries = mxGetNumberOfElements(given), size = chasles_size(array);
    const size_t rows = (size_t)array->shape[0];
    int fits = sizes[0] == rows;
    if (is_matrix) {
        fits = fits && sizes[1] == (size_t)array->shape[1] && dimensions <= 3;
    } else {
        fits = dimensions == 2 && (fits || (sizes[0] == 1 && sizes[1] == size));
    }
    if (!mxIsDouble(given) || mxIsComplex(given) || mxIsSparse(given) || !fits) {
        const char *form = is_matrix ? "%s: expected %d x %d or %d x %d x N real doubles"
                                     : "%s: expected %d x %d or %d x N real doubles";
        mexErrMsgIdAndTxt("chasles:input", form, array->name, array->shape[0], array->shape[1],
                          array->shape[0], array->shape[1]);
    }
    return entries / size;
}

static mxArray *chasles_output(const chasles_array *array, size_t count)
{
    mwSize sizes[4];
    mwSize used = 0;
    for (int k = 0; k < 3; k++) {
        if (k == 0 || array->shape[k] > 1) {
            sizes[used++] = (mwSize)array->shape[k];
        }
    }
    sizes[used++] = (mwSize)count;
    return array->is_condition ? mxCreateLogicalArray(used, sizes)
                               : mxCreateNumericArray(used, sizes, mxDOUBLE_CLASS, mxREAL);
}

static void chasles_store(const chasles_array *array, const double *c, mxArray *to, size_t index)
{
    const size_t size = chasles_size(array);
    for (size_t k = 0; k < size; k++) {
        const size_t at = index * size + chasles_offset(array, k);
        if (array->is_condition) {
            mxGetLogicals(to)[at] = c[k] != 0;
        } else {
            mxGetPr(to)[at] = c[k];
        }
    }
}

/* Allocates the arrays that one call needs. MATLAB frees the allocated arrays, also after an
 * error. */
static void chasles_allocate(const chasles_array *arrays, int count, double **buffers)
{
    for (int k = 0; k < count; k++) {
        buffers[k] = mxCalloc(chasles_size(&arrays[k]), sizeof(double));
    }
}

static void chasles_gateway(const chasles_function *functions, int known, int nlhs, mxArray **plhs,
                            int nrhs, const mxArray **prhs)
{
    double *in[CHASLES_MAX_ARRAYS] = {0}, *out[CHASLES_MAX_ARRAYS] = {0};
    const double *passed[CHASLES_MAX_ARRAYS] = {0};
    size_t counts[CHASLES_MAX_ARRAYS] = {0}, count = 1;
    if (nrhs < 1) {
        mexErrMsgIdAndTxt("chasles:function", "expected the name of a function");
    }
    const chasles_function *f = chasles_found(functions, known, prhs[0]);
    if (nrhs - 1 < f->required || nrhs - 1 > f->inputs || nlhs > f->outputs) {
        mexErrMsgIdAndTxt("chasles:input", "%s: expected %d to %d inputs and at most %d outputs",
                          f->name, f->required, f->inputs, f->outputs);
    }
    for (int k = 0; k < nrhs - 1; k++) {
        const int is_missing = k >= f->required && mxIsEmpty(prhs[k + 1]);
        counts[k] = is_missing ? 0 : chasles_count(&f->in[k], prhs[k + 1]);
        if (is_missing || counts[k] == 1) {
            continue;
        }
        if (count != 1 && counts[k] != count) {
            mexErrMsgIdAndTxt("chasles:input", "%s: inputs for different numbers of configurations",
                              f->name);
        }
        count = counts[k];
    }
    chasles_allocate(f->in, f->inputs, in);
    chasles_allocate(f->out, f->outputs, out);
    for (int k = 0; k < (nlhs > 1 ? nlhs : 1); k++) {
        plhs[k] = chasles_output(&f->out[k], count);
    }
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < nrhs - 1; k++) {
            if (counts[k] > 0) {
                const size_t at = counts[k] > 1 ? i * chasles_size(&f->in[k]) : 0;
                chasles_to_c(&f->in[k], mxGetPr(prhs[k + 1]) + at, in[k]);
                passed[k] = in[k];
            }
        }
        f->call(passed, out);
        for (int k = 0; k < (nlhs > 1 ? nlhs : 1); k++) {
            chasles_store(&f->out[k], out[k], plhs[k], i);
        }
    }
    for (int k = 0; k < CHASLES_MAX_ARRAYS; k++) {
        mxFree(in[k]);
        mxFree(out[k]);
    }
}

#endif
