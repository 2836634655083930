/* Calls every function of a robot without Python, under compiler sanitizers.
 *
 *   `kernels bounds`:   Tests all batch lengths, steps and alignments. Memory blocks have exactly
 *                       the required size, so the address sanitizer detects access outside them.
 *   `kernels pages`:    Tests the cases of `bounds` between protected memory pages, which detect
 *                       streaming stores that the sanitizer misses.
 *   `kernels threads`:  Several threads with the same inputs write parts of the same results.
 *   `kernels race`:     Two threads write one variable, and the thread sanitizer must report this.
 */
#define _DEFAULT_SOURCE
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "library/_kernel.h"

#define MAX 16                       /* maximum number of inputs and outputs of a function */
#define LONGEST 40                   /* largest number of rows of a short batch */
#define LINE 8                       /* number of doubles in a cache line */
#define STREAMED ((size_t)(4 << 20)) /* results with more bytes use streaming stores */
#define THREADS 4
#define PART 24
#define FOREIGN 1.25e300
#define TOLERANCE 1e-13 /* batches and single calls may differ by rounding */

extern const chasles_kernel chasles_kernels[];

static void fail(const char *what, const chasles_kernel *kernel, size_t n)
{
    fprintf(stderr, "%s: %s, %zu rows\n", kernel->name, what, n);
    exit(2);
}

static double input_value(size_t row, int argument, int k)
{
    unsigned long scattered = ((unsigned long)row * 131 + k * 17 + argument * 7) * 2654435761UL;
    return (double)(scattered >> 8 & 0xffff) / 0x8000 - 1;
}

enum { FROM_MALLOC, PAGE_BEHIND, PAGE_BEFORE };

/* A memory block with the rows of one input or output of a function. The memory block is only
 * slightly larger than its rows. The tested function must not change the memory before the first
 * row or between two rows. */
typedef struct {
    double *block, *first;
    size_t doubles;
    ptrdiff_t step;
    int size;
    char *pages; /* memory whose first and last page must not be accessed; NULL for memory from
                    malloc */
    size_t bytes;
} rows;

/* Allocates a memory block that begins `shift` doubles before its n rows. If the step between rows
 * is negative, the last row has the lowest address. */
static rows make_rows(size_t n, int size, ptrdiff_t step, size_t shift, int place)
{
    size_t apart = (size_t)(step < 0 ? -step : step);
    rows made = {.doubles = (n - 1) * apart + (size_t)size + shift, .step = step, .size = size};
    size_t needed = made.doubles * sizeof(double);
    if (place == FROM_MALLOC) {
        made.block = malloc(needed);
    } else {
        size_t page = (size_t)sysconf(_SC_PAGESIZE), open = (needed + page - 1) / page * page;
        made.bytes = open + 2 * page;
        made.pages = mmap(0, made.bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (made.pages == MAP_FAILED ||
            mprotect(made.pages + page, open, PROT_READ | PROT_WRITE) != 0) {
            perror("mmap");
            exit(1);
        }
        made.block = (double *)(made.pages + page + (place == PAGE_BEHIND ? open - needed : 0));
    }
    for (size_t k = 0; k < made.doubles; k++) {
        made.block[k] = FOREIGN;
    }
    made.first = made.block + shift + (step < 0 ? (n - 1) * apart : 0);
    return made;
}

static void free_rows(rows *made)
{
    if (made->pages) {
        munmap(made->pages, made->bytes);
    } else {
        free(made->block);
    }
}

/* Returns whether the memory outside the rows of a block is unchanged. Overwrites the rows. */
static int is_rest_untouched(const rows *made, size_t n)
{
    for (size_t row = 0; row < n; row++) {
        for (int k = 0; k < made->size; k++) {
            made->first[(ptrdiff_t)row * made->step + k] = FOREIGN;
        }
    }
    for (size_t k = 0; k < made->doubles; k++) {
        if (made->block[k] != FOREIGN) {
            return 0;
        }
    }
    return 1;
}

typedef struct {
    int gap;      /* number of doubles between rows */
    int backward; /* the last row has the lowest address */
    int same;     /* all rows of an input share the same memory */
    size_t shift; /* offset from an aligned address, in doubles */
} layout;

static void check_rows(const chasles_kernel *kernel, size_t n, layout how, size_t every, int place)
{
    rows all[MAX];
    const double *inputs[MAX] = {0}, *one_input[MAX];
    double *outputs[MAX] = {0}, *one_output[MAX];
    ptrdiff_t steps[MAX] = {0};
    int operands = kernel->n_inputs + kernel->n_outputs;
    for (int i = 0; i < operands; i++) {
        int size = kernel->sizes[i], is_input = i < kernel->n_inputs;
        ptrdiff_t step = is_input && how.same ? 0 : (size + how.gap) * (how.backward ? -1 : 1);
        all[i] = make_rows(n, size, step, how.shift, place);
        steps[i] = step;
        if (is_input) {
            inputs[i] = all[i].first;
            for (size_t row = 0; row < n; row++) {
                for (int k = 0; k < size; k++) {
                    all[i].first[(ptrdiff_t)row * step + k] = input_value(how.same ? 0 : row, i, k);
                }
            }
        } else {
            outputs[i - kernel->n_inputs] = all[i].first;
            one_output[i - kernel->n_inputs] = malloc((size_t)size * sizeof(double));
        }
    }
    kernel->rows(n, inputs, steps, outputs, steps + kernel->n_inputs);
    for (size_t k = 0; k < n + every - 1; k += every) {
        size_t row = k < n ? k : n - 1;
        for (int i = 0; i < kernel->n_inputs; i++) {
            one_input[i] = inputs[i] + (ptrdiff_t)row * steps[i];
        }
        kernel->call(one_input, one_output);
        for (int i = kernel->n_inputs; i < operands; i++) {
            const double *got = all[i].first + (ptrdiff_t)row * steps[i];
            for (int j = 0; j < kernel->sizes[i]; j++) {
                double expected = one_output[i - kernel->n_inputs][j];
                if (!(fabs(got[j] - expected) <= TOLERANCE * (1 + fabs(expected)))) {
                    fail("a batch differs from single calls", kernel, n);
                }
            }
        }
    }
    for (int i = 0; i < operands; i++) {
        if (i >= kernel->n_inputs) {
            if (!is_rest_untouched(&all[i], n)) {
                fail("writes outside its rows", kernel, n);
            }
            free(one_output[i - kernel->n_inputs]);
        }
        free_rows(&all[i]);
    }
}

static int check_bounds(int place)
{
    static const layout layouts[] = {{0, 0, 0, 0}, {0, 0, 0, 1}, {3, 0, 0, 0},
                                     {0, 1, 0, 0}, {5, 1, 0, 1}, {0, 0, 1, 0}};
    int checked = 0;
    for (const chasles_kernel *kernel = chasles_kernels; kernel->name; kernel++) {
        for (size_t n = 1; n <= LONGEST; n++) {
            for (size_t k = 0; k < sizeof layouts / sizeof *layouts; k++, checked++) {
                check_rows(kernel, n, layouts[k], 1, place);
            }
        }
        size_t streamed = STREAMED / ((size_t)kernel->sizes[kernel->n_inputs] * sizeof(double)) + 1;
        for (size_t shift = 0; shift < LINE; shift += shift ? 3 : 1, checked++) {
            layout dense = {0, 0, 0, shift};
            check_rows(kernel, streamed + shift, dense, 997, place);
        }
    }
    return checked;
}

/* Inputs that all threads share, and results, of which each thread writes one section. */
typedef struct {
    const chasles_kernel *kernel;
    double *inputs[MAX];
    double *outputs[MAX];
    double *expected[MAX];
    size_t part;
} batch;

typedef struct {
    batch *shared;
    size_t index;
} job;

static void *run_part(void *given)
{
    const job *own = given;
    const batch *shared = own->shared;
    const chasles_kernel *kernel = shared->kernel;
    const double *inputs[MAX];
    double *outputs[MAX];
    ptrdiff_t steps[MAX];
    size_t first = own->index * shared->part;
    for (int i = 0; i < kernel->n_inputs + kernel->n_outputs; i++) {
        steps[i] = kernel->sizes[i];
        if (i < kernel->n_inputs) {
            inputs[i] = shared->inputs[i] + first * (size_t)kernel->sizes[i];
        } else {
            int j = i - kernel->n_inputs;
            outputs[j] = shared->outputs[j] + first * (size_t)kernel->sizes[i];
        }
    }
    kernel->rows(shared->part, inputs, steps, outputs, steps + kernel->n_inputs);
    /* Every thread also evaluates the first row, by single calls of the kernel. */
    double *own_outputs[MAX];
    for (int j = 0; j < kernel->n_outputs; j++) {
        own_outputs[j] = malloc((size_t)kernel->sizes[kernel->n_inputs + j] * sizeof(double));
    }
    for (int k = 0; k < 20; k++) {
        kernel->call((const double *const *)shared->inputs, own_outputs);
    }
    for (int j = 0; j < kernel->n_outputs; j++) {
        free(own_outputs[j]);
    }
    return 0;
}

static void check_parts(const chasles_kernel *kernel, size_t part)
{
    batch shared = {.kernel = kernel, .part = part};
    size_t n = THREADS * part;
    ptrdiff_t steps[MAX];
    for (int i = 0; i < kernel->n_inputs + kernel->n_outputs; i++) {
        size_t size = (size_t)kernel->sizes[i], bytes = n * size * sizeof(double);
        steps[i] = kernel->sizes[i];
        if (i < kernel->n_inputs) {
            shared.inputs[i] = malloc(bytes);
            for (size_t k = 0; k < n * size; k++) {
                shared.inputs[i][k] = input_value(k / size, i, (int)(k % size));
            }
        } else {
            shared.outputs[i - kernel->n_inputs] = malloc(bytes);
            shared.expected[i - kernel->n_inputs] = malloc(bytes);
        }
    }
    kernel->rows(n, (const double *const *)shared.inputs, steps, shared.expected,
                 steps + kernel->n_inputs);
    pthread_t threads[THREADS];
    job jobs[THREADS];
    for (size_t k = 0; k < THREADS; k++) {
        jobs[k] = (job){&shared, k};
        if (pthread_create(&threads[k], 0, run_part, &jobs[k]) != 0) {
            fail("no thread could be started", kernel, n);
        }
    }
    for (size_t k = 0; k < THREADS; k++) {
        pthread_join(threads[k], 0);
    }
    for (int i = 0; i < kernel->n_inputs; i++) {
        free(shared.inputs[i]);
    }
    for (int j = 0; j < kernel->n_outputs; j++) {
        size_t bytes = n * (size_t)kernel->sizes[kernel->n_inputs + j] * sizeof(double);
        if (memcmp(shared.outputs[j], shared.expected[j], bytes) != 0) {
            fail("parts differ from the whole", kernel, n);
        }
        free(shared.outputs[j]);
        free(shared.expected[j]);
    }
}

static int check_threads(void)
{
    int checked = 0;
    for (const chasles_kernel *kernel = chasles_kernels; kernel->name; kernel++, checked++) {
        check_parts(kernel, PART);
        check_parts(kernel, PART + 5);
        if (kernel == chasles_kernels) {
            check_parts(kernel,
                        STREAMED / ((size_t)kernel->sizes[kernel->n_inputs] * sizeof(double)) + 9);
        }
    }
    return checked;
}

static int written_by_both;

static void *write_it(void *given)
{
    for (int k = 0; k < 1000; k++) {
        written_by_both += *(int *)given;
    }
    return 0;
}

static int race(void)
{
    pthread_t threads[2];
    int one = 1;
    for (int k = 0; k < 2; k++) {
        pthread_create(&threads[k], 0, write_it, &one);
    }
    for (int k = 0; k < 2; k++) {
        pthread_join(threads[k], 0);
    }
    return written_by_both == 0;
}

/* Prints the number of cases checked. */
int main(int count, char **words)
{
    const char *mode = count == 2 ? words[1] : "";
    if (strcmp(mode, "race") == 0) {
        return race();
    }
    if (strcmp(mode, "bounds") == 0) {
        printf("%d\n", check_bounds(FROM_MALLOC));
    } else if (strcmp(mode, "pages") == 0) {
        printf("%d\n", check_bounds(PAGE_BEHIND) + check_bounds(PAGE_BEFORE));
    } else if (strcmp(mode, "threads") == 0) {
        printf("%d\n", check_threads());
    } else {
        fprintf(stderr, "usage: kernels bounds|pages|threads|race\n");
        return 1;
    }
    return 0;
}
