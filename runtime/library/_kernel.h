/* The interface between chasles and a compiled robot: one entry for each function, found by name.
 *
 * A compiled library exports two symbols. The table `const chasles_kernel chasles_kernels[]` ends
 * with an entry whose name is NULL. The text `const char chasles_hash[]` is the hash of the content
 * for which the library was compiled. All other symbols are hidden, so that symbols of two robots
 * in one process do not clash.
 *
 * A portable library also exports two more tables: chasles_kernels_v3 for x86-64-v3 processors
 * (AVX2, FMA), and chasles_kernels_v4 for x86-64-v4 processors (AVX-512). */
#ifndef CHASLES_KERNEL_H
#define CHASLES_KERNEL_H

#include <stddef.h>

/* The name of capsules that hold a `const chasles_kernel *` and keep its library loaded. */
#define CHASLES_KERNEL_CAPSULE "chasles.kernel"

#define CHASLES_JOIN_(name, level) name##_##level
#define CHASLES_JOIN(name, level) CHASLES_JOIN_(name, level)
#define CHASLES_AT(name) CHASLES_JOIN(name, CHASLES_LEVEL)

#ifdef _WIN32
#define CHASLES_EXPORT __declspec(dllexport)
#else
#define CHASLES_EXPORT __attribute__((visibility("default")))
#endif

typedef struct {
    const char *name;
    /* One pointer for each input and each output, to dense row-major doubles. */
    void (*call)(const double *const *inputs, double *const *outputs);
    /* Evaluates n rows. A step is the number of doubles from the start of a row to the start of the
     * next row. NULL if the robot has no code for batches. Outputs must not overlap inputs. */
    void (*rows)(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
                 double *const *outputs, const ptrdiff_t *output_steps);
    /* NULL for a function that is not an inverse kinematics function. Writes the solutions nearest
     * to seeds as dense rows of q, residual and margin. Also writes the slot of each solution, or
     * the reason for a missing solution. A step is the number of doubles between the starts of two
     * rows. `moves` points to the lower limits, upper limits, weights and periods of the
     * coordinates. */
    void (*nearest_rows)(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
                         double tolerance, const double *const *moves, const double *q_seed,
                         ptrdiff_t seed_step, double *const *outputs, signed char *slot);
    /* chasles_nearest_slots of chasles_nearest.h. */
    void (*nearest)(size_t rows, int n, int k, const double *const *slots, double tolerance,
                    const double *const *moves, const double *q_seed, ptrdiff_t seed_step,
                    double *const *outputs, signed char *slot);
    int n_inputs;
    int n_outputs;
    /* Number of doubles in each input, then in each output. */
    const int *sizes;
} chasles_kernel;

#endif
