/* Evaluates a batch of poses on SIMD lanes. Each row of the batch is a pose. This file is part of
 * chasles and is the same for every robot.
 *
 * chasles_batch.h is included once per instruction set, after chasles_lanes.h. `lanes_run`
 * processes the rows in tiles of LANES rows. For each tile, `lanes_run` transposes the inputs to
 * SIMD lanes, runs a kernel and transposes the results back. */
#ifndef CHASLES_BATCH_H
#define CHASLES_BATCH_H

#include <stdint.h>
#include <string.h>

#define LANES_MAX_INPUTS 256  /* maximum number of doubles in all inputs of a function */
#define LANES_MAX_OUTPUTS 512 /* maximum number of doubles in all outputs of a function */
#define LANES_MAX_ARGUMENTS 8 /* maximum number of inputs, and of outputs */
#define LANES_LINE 8          /* number of doubles in a cache line */
/* Number of SIMD vectors in the work memory of a batch evaluation. The work memory holds the
 * inputs, the outputs, and the collected rows of each output. The collected rows of each output
 * need one extra cache line. */
#define LANES_MAX_WORK (LANES_MAX_INPUTS + 2 * LANES_MAX_OUTPUTS + LANES_MAX_ARGUMENTS * LANES_LINE)
/* A result array above this size [bytes] bypasses the caches, because the array does not fit into
 * the caches. */
#define LANES_STREAMED ((size_t)4 << 20)

typedef struct {
    int inputs, outputs;
    const int *sizes; /* number of doubles in each input and each output */
} lanes_shape;

/* A result that is written to memory in complete cache lines. New rows are written to the buffer
 * `stage`, starting at its second cache line. The last `held` doubles in the first cache line of
 * `stage` are left over from earlier rows. The first `skipped` doubles in the array `to` do not
 * belong to the result. */
typedef struct {
    double *to;
    size_t held, skipped;
    double *stage;
} lanes_stream;
#endif

typedef void (*LANES_NAME(lanes_kernel))(const lanes *in, lanes *out);

/* ---- results that bypass the caches ---- */

/* Writes all complete cache lines of a result to memory, and keeps the remaining doubles for the
 * next tile of rows. */
static LANES_TARGET void LANES_NAME(lanes_push)(lanes_stream *stream, size_t added)
{
    const double *from = stream->stage + LANES_LINE - stream->held;
    double *to = stream->to, rest[LANES_LINE];
    size_t total = stream->held + added, whole = total - total % LANES_LINE, k = 0;
    if (whole && stream->skipped) {
        size_t own = LANES_LINE - stream->skipped;
        memcpy(to + stream->skipped, from + stream->skipped, own * sizeof(double));
        stream->skipped = 0;
        k = LANES_LINE;
    }
#if CHASLES_ISA == 2
    for (; k < whole; k += 8) {
        _mm512_stream_pd(to + k, _mm512_loadu_pd(from + k));
    }
#elif CHASLES_ISA == 1
    for (; k < whole; k += 4) {
        _mm256_stream_pd(to + k, _mm256_loadu_pd(from + k));
    }
#else
    for (; k < whole; k += 2) {
        _mm_stream_pd(to + k, _mm_loadu_pd(from + k));
    }
#endif
    memcpy(rest, stream->stage + added, sizeof rest);
    memcpy(stream->stage, rest, sizeof rest);
    stream->to = to + whole;
    stream->held = total - whole;
}

/* ---- evaluation of a batch ---- */

static LANES_TARGET void LANES_NAME(lanes_run)(LANES_NAME(lanes_kernel) kernel,
                                               const lanes_shape *shape, size_t n,
                                               const double *const *inputs,
                                               const ptrdiff_t *input_steps, double *const *outputs,
                                               const ptrdiff_t *output_steps)
{
    /* The work memory is aligned to a page. */
    lanes work[LANES_MAX_WORK] __attribute__((aligned(4096)));
    lanes_stream streams[LANES_MAX_ARGUMENTS];
    const int *sizes = shape->sizes + shape->inputs;
    /* The input and output arrays are adjacent in memory, because separately page-aligned arrays
     * would compete for a few cache lines. */
    lanes *in = work, *out = in;
    for (int i = 0; i < shape->inputs; i++) {
        out += shape->sizes[i];
    }
    double *stage = (double *)out;
    for (int i = 0; i < shape->outputs; i++) {
        stage += (size_t)sizes[i] * LANES;
    }
    for (int i = 0; i < shape->outputs; i++) {
        size_t past = ((uintptr_t)outputs[i] / sizeof(double)) % LANES_LINE;
        int streamed =
            output_steps[i] == sizes[i] && n * sizes[i] * sizeof(double) > LANES_STREAMED;
        streams[i].stage = streamed ? stage : 0;
        streams[i].to = outputs[i] - past;
        streams[i].held = streams[i].skipped = past;
        stage += (size_t)sizes[i] * LANES + LANES_LINE;
    }
    for (size_t row = 0; row < n; row += LANES) {
        int count = n - row < LANES ? (int)(n - row) : LANES;
        lanes *at = in;
        for (int i = 0; i < shape->inputs; i++) {
            const double *rows = inputs[i] + (ptrdiff_t)row * input_steps[i];
            LANES_NAME(lanes_gather)(rows, input_steps[i], shape->sizes[i], count, at);
            at += shape->sizes[i];
        }
        kernel(in, out);
        at = out;
        for (int i = 0; i < shape->outputs; i++) {
            if (streams[i].stage) {
                double *rows = streams[i].stage + LANES_LINE;
                LANES_NAME(lanes_scatter)(at, sizes[i], count, rows, sizes[i]);
                LANES_NAME(lanes_push)(&streams[i], (size_t)count * sizes[i]);
            } else {
                double *rows = outputs[i] + (ptrdiff_t)row * output_steps[i];
                LANES_NAME(lanes_scatter)(at, sizes[i], count, rows, output_steps[i]);
            }
            at += sizes[i];
        }
    }
    for (int i = 0; i < shape->outputs; i++) {
        const lanes_stream *stream = &streams[i];
        if (stream->stage) {
            size_t own = stream->held - stream->skipped;
            const double *end = stream->stage + LANES_LINE;
            memcpy(stream->to + stream->skipped, end - own, own * sizeof(double));
        }
    }
    _mm_sfence();
}
