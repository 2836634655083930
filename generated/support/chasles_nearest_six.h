/* chasles_nearest_turns for six coordinates and a multiple of four slots, with AVX2 vectors. Part
 * of chasles; the same for every robot. Included by chasles_nearest.h. */
#ifndef CHASLES_NEAREST_SIX_H
#define CHASLES_NEAREST_SIX_H

#include <immintrin.h>

/* Four coordinates of the seed, with their limits, weights and periods. */
typedef struct {
    __m256d seed, turn, scale;
} chasles_four;

/* Joints 0 and 1 of the seed, twice; and joints 2 to 5 of the seed. */
static inline chasles_four chasles_first_two(const chasles_moves *moves, const double *q_seed)
{
    const chasles_four found = {_mm256_broadcast_pd((const __m128d *)q_seed),
                                _mm256_broadcast_pd((const __m128d *)moves->turn),
                                _mm256_broadcast_pd((const __m128d *)moves->scale)};
    return found;
}

static inline chasles_four chasles_last_four(const chasles_moves *moves, const double *q_seed)
{
    const chasles_four found = {_mm256_loadu_pd(q_seed + 2), _mm256_loadu_pd(moves->turn + 2),
                                _mm256_loadu_pd(moves->scale + 2)};
    return found;
}

/* The full turns between coordinates and the seed. */
static inline __m256d chasles_turns(__m256d q, const chasles_four *of)
{
    const __m256d apart =
        _mm256_mul_pd(_mm256_sub_pd(q, of->seed), _mm256_set1_pd(1 / CHASLES_FULL_TURN));
    return _mm256_round_pd(apart, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}

/* The weighted displacements of four coordinates. */
static inline __m256d chasles_four_moves(__m256d q, const chasles_four *of)
{
    const __m256d apart = _mm256_sub_pd(q, of->seed);
    const __m256d move = _mm256_fnmadd_pd(of->turn, chasles_turns(q, of), apart);
    return _mm256_mul_pd(_mm256_andnot_pd(_mm256_set1_pd(-0.0), move), of->scale);
}

/* The first two coordinates of two result rows. Loads that overlap recent stores wait: the inverse
 * stored the first four and the last four coordinates of a row. */
static inline __m256d chasles_two_rows(const double *row)
{
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(row)), _mm_loadu_pd(row + 6),
                                1);
}

static inline __m256d chasles_max_of_pairs(__m256d a, __m256d b)
{
    return _mm256_max_pd(_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
}

/* The distances of four slots. */
static inline __m256d chasles_four_distances(const double *q, const chasles_four *first,
                                             const chasles_four *last)
{
    __m256d a[2], b[4], low, high;
    for (int i = 0; i < 2; i++) {
        a[i] = chasles_four_moves(chasles_two_rows(q + 12 * i), first);
    }
    for (int i = 0; i < 4; i++) {
        b[i] = chasles_four_moves(_mm256_loadu_pd(q + 6 * i + 2), last);
    }
    low = chasles_max_of_pairs(b[0], b[1]);
    high = chasles_max_of_pairs(b[2], b[3]);
    low = _mm256_max_pd(_mm256_permute2f128_pd(low, high, 0x20),
                        _mm256_permute2f128_pd(low, high, 0x31));
    return _mm256_max_pd(low, _mm256_permute4x64_pd(chasles_max_of_pairs(a[0], a[1]), 0xD8));
}

/* Returns the coordinates nearest to the seed by full turns; clears is_inside unless they are
 * within the limits. */
static inline __m256d chasles_turned(__m256d q, const chasles_four *of, __m256d lower,
                                     __m256d upper, int *is_inside)
{
    const __m256d at = _mm256_fnmadd_pd(of->turn, chasles_turns(q, of), q);
    const __m256d inside =
        _mm256_and_pd(_mm256_cmp_pd(at, lower, _CMP_GE_OQ), _mm256_cmp_pd(at, upper, _CMP_LE_OQ));
    *is_inside &= _mm256_movemask_pd(inside) == 15;
    return at;
}

/* Writes a row, shifted by full turns to be nearest to the seed. Returns whether it is within the
 * limits. */
static inline void chasles_turn_six(const double *row, const chasles_moves *moves,
                                    const chasles_four *first, const chasles_four *last, double *at,
                                    int *is_inside)
{
    const __m256d lower = _mm256_broadcast_pd((const __m128d *)moves->lower);
    const __m256d upper = _mm256_broadcast_pd((const __m128d *)moves->upper);
    const __m256d two = _mm256_broadcast_pd((const __m128d *)row);
    *is_inside = 1;
    _mm_storeu_pd(at, _mm256_castpd256_pd128(chasles_turned(two, first, lower, upper, is_inside)));
    _mm256_storeu_pd(at + 2, chasles_turned(_mm256_loadu_pd(row + 2), last,
                                            _mm256_loadu_pd(moves->lower + 2),
                                            _mm256_loadu_pd(moves->upper + 2), is_inside));
}

/* See chasles_nearest_turns. */
static inline int chasles_nearest_six(const chasles_slots *of, const chasles_moves *moves,
                                      const double *q_seed, double *distance, double *at,
                                      int *is_inside)
{
    const chasles_four first = chasles_first_two(moves, q_seed);
    const chasles_four last = chasles_last_four(moves, q_seed);
    const __m256d none = _mm256_set1_pd(INFINITY), tolerance = _mm256_set1_pd(of->tolerance);
    const __m256d rounding = _mm256_castsi256_pd(_mm256_set1_epi64x(CHASLES_ROUNDING));
    __m256d least = none, last_equal;
    uint64_t slots = 0;
    int best;
    for (int slot = 0; slot < of->slots; slot += 4) {
        const __m256d residual = _mm256_loadu_pd(of->residual + slot);
        const __m256d solved = _mm256_cmp_pd(residual, tolerance, _CMP_LE_OQ);
        const __m256d found =
            _mm256_blendv_pd(none, chasles_four_distances(of->q + 6 * slot, &first, &last), solved);
        _mm256_storeu_pd(distance + slot, found);
        least = _mm256_min_pd(found, least);
    }
    least = _mm256_min_pd(least, _mm256_permute2f128_pd(least, least, 1));
    least = _mm256_min_pd(least, _mm256_permute_pd(least, 5));
    last_equal = _mm256_or_pd(least, rounding);
    for (int slot = 0; slot < of->slots; slot += 4) {
        const __m256d own = _mm256_loadu_pd(distance + slot);
        slots |= (uint64_t)_mm256_movemask_pd(_mm256_cmp_pd(own, last_equal, _CMP_LE_OQ)) << slot;
    }
    *is_inside = 0;
    if (!(_mm256_cvtsd_f64(least) < INFINITY)) {
        return -1;
    }
    best = __builtin_ctzll(slots);
    chasles_turn_six(of->q + 6 * best, moves, &first, &last, at, is_inside);
    return best;
}

#endif
