/* Lanes: LANES poses at once, one pose a lane; part of chasles, the same for every robot.
 *
 * Included once for each instruction set, with CHASLES_ISA 0 (baseline), 1 (AVX2) or 2 (AVX-512).
 * It gives the type `lanes` with its sine, cosine and other functions, and `lanes_run`, which walks
 * over rows of any step in tiles of LANES rows: rows to lanes, a kernel on lanes, lanes to rows.
 * Each lane gets what C gives, NaN and infinities included, but for last places of sines and their
 * kind: with FMA, cosine and sine of an angle are computed here, and are good to 1.5 units; all else
 * comes from libmvec, the vector part of glibc's libm, by name, and is good to 4.
 */
#ifndef CHASLES_LANES_H
#define CHASLES_LANES_H

#include <immintrin.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define LANES_MOST_INPUTS 256   /* doubles in all inputs of a kernel */
#define LANES_MOST_OUTPUTS 512  /* doubles in all outputs */
#define LANES_MOST_ARGUMENTS 8  /* inputs, and outputs */
#define LANES_LINE 8            /* doubles in a cache line */
/* Lanes of inputs, of outputs, and of outputs that are staged with a line each. */
#define LANES_MOST_WORK \
  (LANES_MOST_INPUTS + 2 * LANES_MOST_OUTPUTS + LANES_MOST_ARGUMENTS * LANES_LINE)
/* Results larger than this (bytes) go past the caches: they would not be found there anyway. */
#define LANES_STREAMED ((size_t)4 << 20)

typedef struct {
  int inputs, outputs;
  const int *sizes; /* doubles of each input, then of each output */
} lanes_shape;

/* A result on its way to memory, in whole cache lines: rows are staged behind the first line of
 * `stage`, at whose end `held` doubles of earlier rows wait for the rest of the line that begins at
 * `to`; the first `skipped` of them belong to somebody else. */
typedef struct {
  double *to;
  size_t held, skipped;
  double *stage;
} lanes_stream;

/* Minimax on |y| <= pi/4, for z = y^2: sin y = y + y z P(z) to 2^-57, cos y = 1 - z/2 + z^2 Q(z) to
 * 2^-63; highest powers first. */
static const double lanes_sine[] = {1.589623007685026e-10, -2.505074776274793e-08,
  2.7557313621395764e-06, -0.00019841269829589612, 0.008333333333322118, -0.1666666666666663};
static const double lanes_cosine[] = {-1.1358536307896614e-11, 2.0875700837723448e-09,
  -2.755731417926397e-07, 2.4801587288851585e-05, -0.0013888888888873056, 0.041666666666666595};
/* pi/2 as a sum of doubles, each rounded down, for -0 less +0 is -0. */
static const double lanes_right_angle[] = {1.5707963267948966, 6.123233995736765e-17,
  1.0828566739219139e-32};
#define LANES_FARTHEST 1e5 /* radian; farther angles are left to libmvec */

#define LANES_JOIN_(a, b) a##_##b
#define LANES_JOIN(a, b) LANES_JOIN_(a, b)
#define LANES_NAME(name) LANES_JOIN(name, LANES_SET)

/* Less +0, which leaves -0 as it is. */
#define LANES_OF(number) ((number) - LANES_NAME(lanes_zero))
/* Conditions are 1 or 0. What they choose is chosen by bits: NaN elsewhere is not seen. */
#define LANES_WHERE(mask, x) ((lanes)((lanes_mask)(mask) & (lanes_mask)LANES_OF(x)))
#define LANES_EITHER(mask, x, y) \
  ((lanes)(((lanes_mask)(mask) & (lanes_mask)(x)) | (~(lanes_mask)(mask) & (lanes_mask)(y))))
#define LANES_LT(x, y) LANES_WHERE((x) < (y), 1.0)
#define LANES_LE(x, y) LANES_WHERE((x) <= (y), 1.0)
#define LANES_EQ(x, y) LANES_WHERE((x) == (y), 1.0)
#define LANES_NE(x, y) LANES_WHERE((x) != (y), 1.0)
#define LANES_NOT(x) LANES_WHERE((x) == 0.0, 1.0)
#define LANES_AND(x, y) LANES_WHERE(((x) != 0.0) & ((y) != 0.0), 1.0)
#define LANES_OR(x, y) LANES_WHERE(((x) != 0.0) | ((y) != 0.0), 1.0)
#define LANES_IF(condition, x) LANES_WHERE((condition) != 0.0, x)

/* Functions take lanes by address: vectors wider than the baseline's are not passed by value in its
 * calls. They call others part by part, a part being a register of the set. */
#define LANES_PART(x, k) (((lanes_part *)(x))[k])
#define LANES_PARTS (int)(sizeof(lanes) / sizeof(lanes_part))
#define LANES_BY_PARTS(name, function)                                                       \
  static inline LANES_TARGET void LANES_NAME(lanes_##name)(const lanes *x, lanes *value)     \
  {                                                                                          \
    for (int k = 0; k < LANES_PARTS; k++) {                                                  \
      LANES_PART(value, k) = function(LANES_PART(x, k));                                     \
    }                                                                                        \
  }
#define LANES_BY_PARTS_OF_TWO(name, function)                                                \
  static inline LANES_TARGET void LANES_NAME(lanes_##name)(const lanes *x, const lanes *y,   \
                                                           lanes *value)                     \
  {                                                                                          \
    for (int k = 0; k < LANES_PARTS; k++) {                                                  \
      LANES_PART(value, k) = function(LANES_PART(x, k), LANES_PART(y, k));                   \
    }                                                                                        \
  }
#define LANES_LIBMVEC(name)                                \
  LANES_TARGET lanes_part LANES_VECTOR(name)(lanes_part);  \
  LANES_BY_PARTS(name, LANES_VECTOR(name))
#define LANES_LIBMVEC_OF_TWO(name)                                            \
  LANES_TARGET lanes_part LANES_VECTOR_OF_TWO(name)(lanes_part, lanes_part);  \
  LANES_BY_PARTS_OF_TWO(name, LANES_VECTOR_OF_TWO(name))
/* For a libmvec that has no such function. */
#define LANES_LIBM(name)                                                                     \
  static inline LANES_TARGET void LANES_NAME(lanes_##name)(const lanes *x, lanes *value)     \
  {                                                                                          \
    for (int k = 0; k < LANES; k++) {                                                        \
      (*value)[k] = name((*x)[k]);                                                           \
    }                                                                                        \
  }
#define LANES_LIBM_OF_TWO(name)                                                              \
  static inline LANES_TARGET void LANES_NAME(lanes_##name)(const lanes *x, const lanes *y,   \
                                                           lanes *value)                     \
  {                                                                                          \
    for (int k = 0; k < LANES; k++) {                                                        \
      (*value)[k] = name((*x)[k], (*y)[k]);                                                  \
    }                                                                                        \
  }
#endif

#undef LANES
#undef LANES_SET
#undef LANES_TARGET
#undef LANES_VECTOR
#undef LANES_VECTOR_OF_TWO
#undef LANES_SQRT
#undef LANES_FMA
#undef LANES_ANY
#undef LANES_LESS_PRODUCT
#undef lanes
#undef lanes_mask
#undef lanes_part
#if CHASLES_ISA == 2
#define LANES 8
#define LANES_SET avx512
#define LANES_TARGET __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma")))
#define LANES_VECTOR(name) _ZGVeN8v_##name
#define LANES_VECTOR_OF_TWO(name) _ZGVeN8vv_##name
#define LANES_SQRT _mm512_sqrt_pd
#define LANES_FMA(x, y, z) ((lanes)_mm512_fmadd_pd(x, y, z))
#define LANES_LESS_PRODUCT(z, x, y) ((lanes)_mm512_fnmadd_pd(x, y, z))
#define LANES_ANY(mask) _mm512_movepi64_mask((__m512i)(mask))
#define lanes_part __m512d
#elif CHASLES_ISA == 1
#define LANES 4
#define LANES_SET avx2
#define LANES_TARGET __attribute__((target("avx2,fma")))
#define LANES_VECTOR(name) _ZGVdN4v_##name
#define LANES_VECTOR_OF_TWO(name) _ZGVdN4vv_##name
#define LANES_SQRT _mm256_sqrt_pd
#define LANES_FMA(x, y, z) ((lanes)_mm256_fmadd_pd(x, y, z))
#define LANES_LESS_PRODUCT(z, x, y) ((lanes)_mm256_fnmadd_pd(x, y, z))
#define LANES_ANY(mask) _mm256_movemask_pd((__m256d)(mask))
#define lanes_part __m256d
#else
#define LANES 4
#define LANES_SET baseline
#define LANES_TARGET
#define LANES_VECTOR(name) _ZGVbN2v_##name
#define LANES_VECTOR_OF_TWO(name) _ZGVbN2vv_##name
#define LANES_SQRT _mm_sqrt_pd
#define lanes_part __m128d
#endif
#define lanes LANES_NAME(lanes_type)
#define lanes_mask LANES_NAME(lanes_mask_type)

typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));
typedef int64_t lanes_mask __attribute__((vector_size(LANES * sizeof(double))));
typedef double LANES_NAME(lanes_row)
    __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));
static const lanes LANES_NAME(lanes_zero) = {0};
typedef void (*LANES_NAME(lanes_kernel))(const lanes *in, lanes *out);

/* ---- functions of lanes ---- */

LANES_LIBMVEC(sin)
LANES_LIBMVEC(cos)
#if __GLIBC_PREREQ(2, 35)
LANES_LIBMVEC(tan)
LANES_LIBMVEC(atan)
LANES_LIBMVEC_OF_TWO(atan2)
#else
LANES_LIBM(tan)
LANES_LIBM(atan)
LANES_LIBM_OF_TWO(atan2)
#endif
LANES_BY_PARTS(sqrt, LANES_SQRT)

static inline LANES_TARGET void LANES_NAME(lanes_fabs)(const lanes *x, lanes *value)
{
  *value = (lanes)((lanes_mask)*x & INT64_MAX);
}

#if CHASLES_ISA > 0
/* For angles that are far or not finite, in their own lanes. */
static __attribute__((noinline, cold)) LANES_TARGET void LANES_NAME(lanes_cos_sin_far)(
    const lanes *x, const lanes_mask *far, lanes *c, lanes *s)
{
  lanes far_c, far_s;
  LANES_NAME(lanes_cos)(x, &far_c);
  LANES_NAME(lanes_sin)(x, &far_s);
  *c = LANES_EITHER(*far, far_c, *c);
  *s = LANES_EITHER(*far, far_s, *s);
}

/* The angle less n right angles, reduced as Cody and Waite do, then two polynomials. */
static inline LANES_TARGET void LANES_NAME(lanes_cos_sin)(const lanes *x, lanes *c, lanes *s)
{
  const double units = 6755399441055744.0; /* 1.5 * 2^52: in a sum with it, the last bit is 1 */
  const lanes shifted = LANES_FMA(*x, LANES_OF(0.63661977236758134), LANES_OF(units));
  const lanes n = shifted - units;
  lanes y = *x;
  for (int k = 0; k < 3; k++) {
    y = LANES_LESS_PRODUCT(y, n, LANES_OF(lanes_right_angle[k]));
  }
  const lanes z = y * y;
  lanes sine = LANES_OF(lanes_sine[0]), cosine = LANES_OF(lanes_cosine[0]);
  for (int k = 1; k < 6; k++) {
    sine = LANES_FMA(sine, z, LANES_OF(lanes_sine[k]));
    cosine = LANES_FMA(cosine, z, LANES_OF(lanes_cosine[k]));
  }
  sine = LANES_FMA(y * z, sine, y);
  cosine = LANES_FMA(z, LANES_FMA(z, cosine, LANES_OF(-0.5)), LANES_OF(1.0));
  /* The sum has lost the sign of -0. */
  const lanes_mask sine_bits = (lanes_mask)sine | ((lanes_mask)y & INT64_MIN);
  /* Each quarter turn swaps the two; the sine is negative in quarters 2 and 3, the cosine in 1, 2. */
  const lanes_mask quarter = (lanes_mask)shifted, odd = -(quarter & 1);
  const lanes_mask swapped = (sine_bits ^ (lanes_mask)cosine) & odd;
  *s = (lanes)(sine_bits ^ swapped ^ ((quarter << 62) & INT64_MIN));
  *c = (lanes)((lanes_mask)cosine ^ swapped ^ (((quarter + 1) << 62) & INT64_MIN));
  lanes size;
  LANES_NAME(lanes_fabs)(x, &size);
  const lanes_mask far = ~(lanes_mask)(size <= LANES_FARTHEST);
  if (LANES_ANY(far)) {
    LANES_NAME(lanes_cos_sin_far)(x, &far, c, s);
  }
}
#else
static inline LANES_TARGET void LANES_NAME(lanes_cos_sin)(const lanes *x, lanes *c, lanes *s)
{
  LANES_NAME(lanes_cos)(x, c);
  LANES_NAME(lanes_sin)(x, s);
}
#endif

static inline LANES_TARGET void LANES_NAME(lanes_sign)(const lanes *x, lanes *value)
{
  *value = LANES_EITHER((*x < 0.0) | (*x > 0.0), LANES_LT(0.0, *x) - LANES_LT(*x, 0.0), *x);
}

/* The number where the other is NaN, as C has it. */
static inline LANES_TARGET void LANES_NAME(lanes_fmin)(const lanes *x, const lanes *y, lanes *value)
{
  *value = LANES_EITHER((*x < *y) | (*y != *y), *x, *y);
}

static inline LANES_TARGET void LANES_NAME(lanes_fmax)(const lanes *x, const lanes *y, lanes *value)
{
  *value = LANES_EITHER((*x > *y) | (*y != *y), *x, *y);
}

/* ---- rows to lanes and back ---- */

/* LANES lanes become LANES rows. */
static inline LANES_TARGET void LANES_NAME(lanes_transpose)(const lanes *a, lanes *rows)
{
#if LANES == 8
  lanes b[8], c[8];
  for (int i = 0; i < 8; i += 2) {
    b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int j = i; j < i + 2; j++) {
      c[j] = __builtin_shufflevector(b[j], b[j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      c[j + 2] = __builtin_shufflevector(b[j], b[j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int j = 0; j < 4; j++) {
    rows[j] = __builtin_shufflevector(c[j], c[j + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    rows[j + 4] = __builtin_shufflevector(c[j], c[j + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
#else
  lanes b[4];
  for (int i = 0; i < 4; i += 2) {
    b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 4, 2, 6);
    b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 1, 5, 3, 7);
  }
  for (int j = 0; j < 2; j++) {
    rows[j] = __builtin_shufflevector(b[j], b[j + 2], 0, 1, 4, 5);
    rows[j + 2] = __builtin_shufflevector(b[j], b[j + 2], 2, 3, 6, 7);
  }
#endif
}

/* The first `width` doubles of a row; what lies behind them is not touched. */
static inline LANES_TARGET void LANES_NAME(lanes_load)(const double *row, int width, lanes *to)
{
#if CHASLES_ISA == 2
  *to = (lanes)_mm512_maskz_loadu_pd((__mmask8)((1 << width) - 1), row);
#else
  lanes found = {0};
  for (int k = 0; k < width; k++) {
    found[k] = row[k];
  }
  *to = found;
#endif
}

/* Through registers: a wide load would have to wait for narrow stores to reach the cache. */
static LANES_TARGET void LANES_NAME(lanes_gather)(const double *rows, ptrdiff_t step, int size,
                                                  int count, lanes *to)
{
  for (int k = 0; k < size; k += LANES) {
    int width = size - k < LANES ? size - k : LANES;
    lanes block[LANES], turned[LANES];
    for (int lane = 0; lane < LANES; lane++) {
      /* A lane without a row of its own repeats the last one, so that it computes something tame. */
      const double *row = rows + (lane < count ? lane : count - 1) * step;
      LANES_NAME(lanes_load)(row + k, width, &block[lane]);
    }
    LANES_NAME(lanes_transpose)(block, turned);
    for (int i = 0; i < width; i++) {
      to[k + i] = turned[i];
    }
  }
}

static LANES_TARGET void LANES_NAME(lanes_scatter)(const lanes *from, int size, int count,
                                                   double *rows, ptrdiff_t step)
{
  int k = 0;
  for (; k < size && size >= LANES; k += LANES) {
    lanes block[LANES];
    /* Where the last columns are fewer than the lanes, some are written twice. */
    k = k + LANES > size ? size - LANES : k;
    LANES_NAME(lanes_transpose)(from + k, block);
    if (count == LANES) {
      for (int lane = 0; lane < LANES; lane++) {
        *(LANES_NAME(lanes_row) *)(rows + lane * step + k) = block[lane];
      }
    } else {
      for (int lane = 0; lane < count; lane++) {
        *(LANES_NAME(lanes_row) *)(rows + lane * step + k) = block[lane];
      }
    }
  }
  for (; k < size; k++) {
    const double *at = (const double *)(from + k);
    for (int lane = 0; lane < count; lane++) {
      rows[lane * step + k] = at[lane];
    }
  }
}

/* ---- results past the caches ---- */

/* Writes the whole lines among the doubles that are staged, keeps the rest for the next tile. */
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

/* ---- a batch ---- */

static LANES_TARGET void LANES_NAME(lanes_run)(LANES_NAME(lanes_kernel) kernel,
                                               const lanes_shape *shape, size_t n,
                                               const double *const *inputs,
                                               const ptrdiff_t *input_steps,
                                               double *const *outputs,
                                               const ptrdiff_t *output_steps)
{
  /* On a page of its own: elsewhere, by chance, storing and loading it again took twice as long. */
  lanes work[LANES_MOST_WORK] __attribute__((aligned(4096)));
  lanes_stream streams[LANES_MOST_ARGUMENTS];
  const int *sizes = shape->sizes + shape->inputs;
  /* One behind the other: arrays that begin on pages of their own would share few cache lines. */
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
    int streamed = output_steps[i] == sizes[i] && n * sizes[i] * sizeof(double) > LANES_STREAMED;
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
