/* Selects the solution nearest to a seed for an inverse kinematics function whose branches are in
 * SIMD lanes. Each lane computes the distance of one branch from the seed. This file is part of
 * chasles and is the same for every robot. */
#ifndef CHASLES_NEAREST_LANES_H
#define CHASLES_NEAREST_LANES_H

/* Computes the distance of each branch from the seed without regard to the limits, with the same
 * results as chasles_distances. `branches` contains n + 1 SIMD vectors, in which each lane holds
 * the n coordinates and the residual of one branch. */
LANES_INLINE lanes LANES_NAME(chasles_lane_distances)(int n, const lanes *branches,
                                                      const chasles_moves *moves, double tolerance,
                                                      const double *q_seed)
{
    lanes largest = LANES_NAME(lanes_zero);
    for (int j = 0; j < n; j++) {
        const lanes apart = branches[j] - LANES_OF(q_seed[j]);
        lanes move = apart - moves->turn[j] * CHASLES_TURNS(apart);
        LANES_NAME(lanes_fabs)(&move, &move);
        largest = LANES_MAX(move * moves->scale[j], largest);
    }
    return LANES_CHOICE(LANES_LE(branches[n], tolerance), largest, INFINITY);
}

/* Returns the smallest value of a vector. */
LANES_INLINE double LANES_NAME(chasles_least_lane)(lanes x)
{
#if LANES == 8
    const __m256d low = _mm512_maskz_extractf64x4_pd((__mmask8)-1, x, 0);
    const __m256d high = _mm512_maskz_extractf64x4_pd((__mmask8)-1, x, 1);
    const __m256d four = _mm256_min_pd(low, high);
#else
    const __m256d four = x;
#endif
    const __m256d two = _mm256_min_pd(four, _mm256_permute2f128_pd(four, four, 1));
    return _mm256_cvtsd_f64(_mm256_min_pd(two, _mm256_permute_pd(two, 5)));
}

/* Selects the solution nearest to the seed without regard to the limits. If the nearest solution is
 * within the limits, the function writes its q, residual and margin, and returns its slot index.
 * Without such a solution, the function returns a negative number. */
LANES_INLINE int LANES_NAME(chasles_nearest_lanes)(int n, int slots, int width,
                                                   const lanes *branches,
                                                   const chasles_moves *moves, double tolerance,
                                                   const double *q_seed, double *q,
                                                   double *residual, double *margin)
{
    lanes distance[CHASLES_MAX_SLOTS / LANES], least = LANES_OF(INFINITY);
    double slot[CHASLES_MAX_JOINTS], at[CHASLES_MAX_JOINTS], smallest;
    uint64_t bits, equal = 0;
    const double *own;
    int best, count = LANES_COUNT(slots);
    for (int group = 0; group < slots / count; group++) {
        distance[group] = LANES_NAME(chasles_lane_distances)(n, branches + group * width, moves,
                                                             tolerance, q_seed);
        least = LANES_MIN(distance[group], least);
    }
    smallest = LANES_NAME(chasles_least_lane)(least);
    if (!(smallest < INFINITY)) {
        return -1;
    }
    memcpy(&bits, &smallest, sizeof bits);
    bits |= CHASLES_ROUNDING;
    memcpy(&smallest, &bits, sizeof bits);
    for (int group = 0; group < slots / count; group++) {
        equal |= (uint64_t)LANES_ANY(LANES_LE(distance[group], smallest)) << group * count;
    }
    best = __builtin_ctzll(equal);
    own = (const double *)(branches + best / count * width) + best % count;
    for (int j = 0; j < n; j++) {
        slot[j] = own[j * LANES];
    }
    if (!chasles_is_inside(n, moves, slot, q_seed, at)) {
        return -1;
    }
    memcpy(q, at, (size_t)n * sizeof *q);
    *residual = own[n * LANES];
    *margin = own[(n + 1) * LANES];
    return best;
}

#endif
