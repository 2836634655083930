/* What a compiled robot offers to chasles: one entry per function, found by name.
 *
 * A library exports two symbols:
 *     const chasles_kernel chasles_kernels[]   ended by an entry whose name is NULL
 *     const char chasles_hash[]                the content hash it was compiled for
 * The rest of it stays hidden, so that two robots never meet in one process.
 */
#ifndef CHASLES_KERNEL_H
#define CHASLES_KERNEL_H

#include <stddef.h>

/* The name of capsules that hold a `const chasles_kernel *`; each keeps its library loaded. */
#define CHASLES_KERNEL_CAPSULE "chasles.kernel"

#define CHASLES_EXPORT __attribute__((visibility("default")))

typedef struct {
    const char *name;
    /* One pointer per input, one per output, each to dense row-major doubles. */
    void (*call)(const double *const *inputs, double *const *outputs);
    /* The same for n rows: steps from row to row in doubles, of any size for inputs and outputs,
     * whose rows are dense. NULL where the robot has no code for many poses at once. Outputs must
     * not overlap inputs. */
    void (*rows)(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
                 double *const *outputs, const ptrdiff_t *output_steps);
    int n_inputs;
    int n_outputs;
    /* Doubles in each input, then in each output. */
    const int *sizes;
} chasles_kernel;

#endif
