/* Stub of the Simulink header, with the macros that the S-function uses. The macros read and write
 * a plain struct. */
#ifndef STUB_SIMSTRUC_H
#define STUB_SIMSTRUC_H

#include <stdio.h>
#include <string.h>

#define MAX_PORTS 8
#define INHERITED_SAMPLE_TIME (-1.0)
#define SS_OPTION_EXCEPTION_FREE_CODE 1

typedef int int_T;
typedef struct {
    const char *text;
} mxArray;
typedef struct {
    mxArray parameter;
    const char *error;
    int inputs, outputs, widths[2][MAX_PORTS];
    const double *in[MAX_PORTS];
    double *out[MAX_PORTS];
} SimStruct;

static int mxGetString(const mxArray *array, char *text, size_t size)
{
    return snprintf(text, size, "%s", array->text) >= (int)size;
}

#define ssGetSFcnParam(S, k) (&(S)->parameter)
#define ssSetNumSFcnParams(S, count) ((void)(S))
#define ssGetNumSFcnParams(S) 1
#define ssGetSFcnParamsCount(S) 1
#define ssSetSFcnParamTunable(S, k, value) ((void)(S))
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssSetNumInputPorts(S, count) ((S)->inputs = (count), (count) <= MAX_PORTS)
#define ssSetNumOutputPorts(S, count) ((S)->outputs = (count), (count) <= MAX_PORTS)
#define ssSetInputPortWidth(S, k, width) ((S)->widths[0][k] = (width))
#define ssSetOutputPortWidth(S, k, width) ((S)->widths[1][k] = (width))
#define ssSetInputPortMatrixDimensions(S, k, m, n) ((S)->widths[0][k] = (m) * (n))
#define ssSetOutputPortMatrixDimensions(S, k, m, n) ((S)->widths[1][k] = (m) * (n))
#define ssSetInputPortRequiredContiguous(S, k, value) ((void)(S))
#define ssSetInputPortDirectFeedThrough(S, k, value) ((void)(S))
#define ssSetNumSampleTimes(S, count) ((void)(S))
#define ssSetOptions(S, options) ((void)(S))
#define ssSetSampleTime(S, k, time) ((void)(S))
#define ssSetOffsetTime(S, k, time) ((void)(S))
#define ssGetInputPortSignal(S, k) ((const void *)(S)->in[k])
#define ssGetOutputPortRealSignal(S, k) ((S)->out[k])

#endif
