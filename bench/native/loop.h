/* Benchmark loop over joint vectors for fk() and fk_jacobian() of the including file.
 *
 * If `step` is 0, each call overwrites the result of the last call. The results then cause no
 * memory traffic. The macro KEEP makes the compiler assume that each result is used. */
#define KEEP(pointer) __asm__ volatile("" : : "r"(pointer) : "memory")
#define EXPORT __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

EXPORT void run_fk(void *context, const double *q, long joints, long count, double *T, long step)
{
    for (long k = 0; k < count; k++) {
        fk(context, q + k * joints, T + 16 * k * step);
        KEEP(T);
    }
}

EXPORT void run_fk_jacobian(void *context, const double *q, long joints, long count, double *T,
                            double *J, long step)
{
    for (long k = 0; k < count; k++) {
        fk_jacobian(context, q + k * joints, T + 16 * k * step, J + 6 * joints * k * step);
        KEEP(T);
        KEEP(J);
    }
}

#ifdef __cplusplus
}
#endif
