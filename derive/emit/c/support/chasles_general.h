/* Inverse kinematics of an arm of six revolute joints of any geometry; part of chasles, the same for
 * every such robot.
 *
 * Raghavan and Roth's fourteen equations A y = B(s) x hold for the products y of the cosines and
 * sines of two joints (those of the pair), and x = (1, cos, sin) of joint v times (1, cos, sin) of
 * joint w; B depends on the angle s of one more joint, the suppressed one, and A on the pose. Six
 * combinations of rows are free of y. They are doubled with the half angle of v, which gives twelve
 * equations M(s) u = 0 in as many unknowns, (cos 3v/2, sin 3v/2, cos v/2, sin v/2) x (1, cos w,
 * sin w): bounded for every angle, with no infinity at pi. M = M0 + M1 cos s + M2 sin s. A constant
 * change of unknowns takes out what M would have in common with 1 + tan^2(s/2), and leaves the
 * sixteen angles s as the eigenvalues of a matrix. The other joints follow linearly, and Newton
 * steps on the pose end it. No allocation, no state, libm alone.
 */
#ifndef CHASLES_GENERAL_H
#define CHASLES_GENERAL_H

#include <float.h>
#include <math.h>
#include <string.h>

#define CHASLES_ROOTS 16
#define CHASLES_SOLVED 1e-9      /* m, rad: a slot of a smaller residual is a solution */
#define CHASLES_CLOSED 1e-14     /* m, rad: where Newton's steps end */
#define CHASLES_SAME 1e-6        /* rad: solutions closer than this are one */
#define CHASLES_NEARLY_REAL 0.01 /* rad: imaginary part of s at which two real roots may hide */
#define CHASLES_HIDING 0.5       /* rad: further from real, no solution is sought nearby */
#define CHASLES_NEAR 1e-4        /* m, rad: what is further off may be out of reach */
#define CHASLES_PIVOT 1e-4       /* a smaller ratio of pivots: s is counted from elsewhere */
#define CHASLES_SINGULAR 1e-8    /* a smaller one wherever s is counted from: roots are unsure */

/* What an arm is, besides its pose and Jacobian. Local angles are sign * q. */
typedef struct {
  /* left[14][9]: the columns of 1 and of the eight products y. */
  void (*left)(const double *T, double *left);
  void (*pose_jacobian)(const double *q, double *T, double *J);
  int joint[6];       /* index in q: the pair, suppressed, v, w, and the joint that is left */
  double sign[6];
  double length;      /* m, the arm's size: weighs metres against radians */
  double right[3][14][9]; /* B: of 1, cos s, sin s */
  double own[12][12];     /* unknowns (alpha, beta, gamma) to u as they meet 1 / (1 - i t) */
  double back[12][12];    /* inverse of the same as they meet t: the negative is taken here */
} chasles_general_arm;

typedef struct {
  double factor[14][8];  /* the triangle of A */
  double head[3][8][9];  /* the rows of B that go with it */
  double M[3][12][12];
} chasles_general_system;

typedef struct {
  double q[6];
  double imaginary; /* of s; 0 for a real root */
  double along;     /* s */
} chasles_general_start;

static double chasles_general_wrapped(double angle)
{
  const double turn = 6.283185307179586476925286766559;
  const double wrapped = angle - turn * floor(angle / turn + 0.5);
  return wrapped <= -0.5 * turn ? 0.5 * turn : wrapped;
}

/* The six equations without y, doubled, and the eight that give y. */
static void chasles_general_eliminate(const chasles_general_arm *arm, const double *T,
    chasles_general_system *system)
{
  double left[14 * 9], S[14][36];
  arm->left(T, left);
  for (int i = 0; i < 14; i++) {
    for (int k = 0; k < 8; k++) S[i][k] = left[9 * i + 1 + k];
    for (int m = 0; m < 3; m++) {
      for (int k = 0; k < 9; k++) S[i][8 + 9 * m + k] = arm->right[m][i][k];
    }
    S[i][8] -= left[9 * i];
    S[i][35] = 0.0;
  }
  /* Householder's reflections of the columns of y. */
  for (int j = 0; j < 8; j++) {
    double norm = 0.0, h[14], sum[36] = {0.0};
    for (int i = j; i < 14; i++) norm += S[i][j] * S[i][j];
    norm = copysign(sqrt(norm), S[j][j]);
    const double scale = norm * (norm + S[j][j]);
    if (scale == 0.0) continue;
    for (int i = j; i < 14; i++) h[i] = S[i][j];
    h[j] += norm;
    for (int i = j; i < 14; i++) {
      for (int k = 0; k < 36; k++) sum[k] += h[i] * S[i][k];
    }
    for (int k = 0; k < 36; k++) sum[k] /= scale;
    for (int i = j; i < 14; i++) {
      for (int k = 0; k < 36; k++) S[i][k] -= h[i] * sum[k];
    }
  }
  for (int i = 0; i < 8; i++) {
    for (int k = 0; k < 8; k++) system->factor[i][k] = S[i][k];
    for (int m = 0; m < 3; m++) {
      for (int k = 0; k < 9; k++) system->head[m][i][k] = S[i][8 + 9 * m + k];
    }
  }
  for (int m = 0; m < 3; m++) {
    for (int i = 0; i < 6; i++) {
      double *even = system->M[m][i], *odd = system->M[m][6 + i];
      const double *row = S[8 + i] + 8 + 9 * m;
      for (int k = 0; k < 3; k++) {
        const double one = row[k], c = 0.5 * row[3 + k], s = 0.5 * row[6 + k];
        even[k] = c, even[3 + k] = s, even[6 + k] = one + c, even[9 + k] = s;
        odd[k] = -s, odd[3 + k] = c, odd[6 + k] = s, odd[9 + k] = one - c;
      }
    }
  }
}

/* Solves the first n columns of a for the rest in place; returns the least ratio of pivots. */
static double chasles_general_divide(double (*a)[28])
{
  double least = DBL_MAX, most = 0.0;
  for (int j = 0; j < 12; j++) {
    int p = j;
    for (int i = j + 1; i < 12; i++) {
      if (fabs(a[i][j]) > fabs(a[p][j])) p = i;
    }
    const double pivot = fabs(a[p][j]);
    if (!(pivot > 0.0)) return 0.0;
    least = pivot < least ? pivot : least;
    most = pivot > most ? pivot : most;
    if (p != j) {
      double row[28];
      memcpy(row, a[p], sizeof row);
      memcpy(a[p], a[j], sizeof row);
      memcpy(a[j], row, sizeof row);
    }
    const double inverse = 1.0 / a[j][j];
    for (int i = j + 1; i < 12; i++) {
      const double factor = a[i][j] * inverse;
      for (int k = j; k < 28; k++) a[i][k] -= factor * a[j][k];
    }
  }
  for (int j = 11; j >= 0; j--) {
    const double inverse = 1.0 / a[j][j];
    for (int k = 12; k < 28; k++) a[j][k] *= inverse;
    for (int i = 0; i < j; i++) {
      const double factor = a[i][j];
      for (int k = 12; k < 28; k++) a[i][k] -= factor * a[j][k];
    }
  }
  return least / most;
}

/* The matrix whose eigenvalues are tan((s - from) / 2); returns its least ratio of pivots. */
static double chasles_general_companion(const chasles_general_arm *arm,
    const chasles_general_system *system, double from, double (*H)[16])
{
  const double c = cos(from), s = sin(from);
  double a[12][28], plus[12][12], twice[12][12];
  for (int i = 0; i < 12; i++) {
    for (int k = 0; k < 12; k++) {
      const double m0 = system->M[0][i][k];
      const double along = c * system->M[1][i][k] + s * system->M[2][i][k];
      plus[i][k] = m0 + along;
      a[i][k] = m0 - along;
      twice[i][k] = 2.0 * (c * system->M[2][i][k] - s * system->M[1][i][k]);
    }
    for (int k = 12; k < 28; k++) a[i][k] = 0.0;
    for (int m = 0; m < 12; m++) {
      for (int k = 0; k < 12; k++) a[i][12 + k] += plus[i][m] * arm->own[m][k];
      for (int k = 0; k < 4; k++) a[i][24 + k] += twice[i][m] * arm->own[m][8 + k];
    }
  }
  const double ratio = chasles_general_divide(a);
  for (int i = 0; i < 12; i++) {
    double row[16] = {0.0};
    for (int m = 0; m < 12; m++) {
      for (int k = 0; k < 16; k++) row[k] -= arm->back[i][m] * a[m][12 + k];
    }
    memcpy(H[i < 8 ? i : i + 4], row, sizeof row);
  }
  memset(H[8], 0, 4 * sizeof H[8]);
  for (int k = 0; k < 4; k++) H[8 + k][12 + k] = 1.0;
  return ratio;
}

/* Rows and columns scaled by powers of two until their sums agree (Osborne). */
static void chasles_general_balance(double (*H)[16])
{
  for (int round = 0, changed = 1; changed && round < 8; round++) {
    changed = 0;
    for (int i = 0; i < 16; i++) {
      double column = 0.0, row = 0.0;
      for (int k = 0; k < 16; k++) {
        if (k == i) continue;
        column += fabs(H[k][i]);
        row += fabs(H[i][k]);
      }
      if (!(column > 0.0 && row > 0.0)) continue;
      int up, down;
      frexp(row, &up);
      frexp(column, &down);
      const int half = (up - down) / 2;
      if (half > -2 && half < 2) continue;
      changed = 1;
      for (int k = 0; k < 16; k++) H[i][k] = ldexp(H[i][k], -half);
      for (int k = 0; k < 16; k++) H[k][i] = ldexp(H[k][i], half);
    }
  }
}

/* Householder's reduction to a matrix that is zero below its first subdiagonal. */
static void chasles_general_hessenberg(double (*H)[16])
{
  for (int j = 0; j < 14; j++) {
    double norm = 0.0, h[16] = {0.0}, sum[16] = {0.0};
    for (int i = j + 1; i < 16; i++) norm += H[i][j] * H[i][j];
    norm = copysign(sqrt(norm), H[j + 1][j]);
    const double scale = norm * (norm + H[j + 1][j]);
    if (scale == 0.0) continue;
    for (int i = j + 1; i < 16; i++) h[i] = H[i][j];
    h[j + 1] += norm;
    for (int i = j + 1; i < 16; i++) {
      for (int k = 0; k < 16; k++) sum[k] += h[i] * H[i][k];
    }
    for (int i = j + 1; i < 16; i++) {
      const double factor = h[i] / scale;
      for (int k = 0; k < 16; k++) H[i][k] -= factor * sum[k];
    }
    for (int i = 0; i < 16; i++) {
      double along = 0.0;
      for (int k = 0; k < 16; k++) along += H[i][k] * h[k];
      along /= scale;
      for (int k = 0; k < 16; k++) H[i][k] -= along * h[k];
    }
    for (int i = j + 2; i < 16; i++) H[i][j] = 0.0;
  }
}

/* The eigenvalues of a Hessenberg matrix by Francis's double step; how many were found. */
static int chasles_general_eigenvalues(double (*H)[16], double *re, double *im)
{
  int high = 15, steps = 0, found = 0;
  double moved = 0.0;
  while (high >= 0) {
    int low = high;
    for (; low > 0; low--) {
      const double size = fabs(H[low - 1][low - 1]) + fabs(H[low][low]);
      if (fabs(H[low][low - 1]) <= DBL_EPSILON * (size > 0.0 ? size : 1.0)) break;
    }
    if (low == high) {
      re[found] = H[high][high] + moved, im[found++] = 0.0;
      high--, steps = 0;
      continue;
    }
    double x = H[high][high], y = H[high - 1][high - 1];
    double w = H[high][high - 1] * H[high - 1][high];
    if (low == high - 1) {
      const double half = 0.5 * (y - x), square = half * half + w, root = sqrt(fabs(square));
      if (square >= 0.0) {
        const double far = half + copysign(root, half);
        re[found] = x + moved + far, im[found++] = 0.0;
        re[found] = x + moved - (far != 0.0 ? w / far : 0.0), im[found++] = 0.0;
      } else {
        re[found] = x + moved + half, im[found++] = root;
        re[found] = x + moved + half, im[found++] = -root;
      }
      high -= 2, steps = 0;
      continue;
    }
    if (++steps > 60) return found;
    if (steps % 10 == 0) {
      /* A shift out of the ordinary, where the ordinary ones go round in circles. */
      moved += x;
      for (int i = 0; i <= high; i++) H[i][i] -= x;
      const double size = fabs(H[high][high - 1]) + fabs(H[high - 1][high - 2]);
      x = y = 0.75 * size;
      w = -0.4375 * size * size;
    }
    double p = 0.0, q = 0.0, r = 0.0;
    int m = high - 2;
    for (; m >= low; m--) {
      const double z = H[m][m], a = x - z, b = y - z;
      p = (a * b - w) / H[m + 1][m] + H[m][m + 1];
      q = H[m + 1][m + 1] - z - a - b;
      r = H[m + 2][m + 1];
      const double size = fabs(p) + fabs(q) + fabs(r);
      p /= size, q /= size, r /= size;
      if (m == low) break;
      const double small = fabs(H[m][m - 1]) * (fabs(q) + fabs(r));
      const double large =
          fabs(p) * (fabs(H[m - 1][m - 1]) + fabs(z) + fabs(H[m + 1][m + 1]));
      if (small <= DBL_EPSILON * large) break;
    }
    for (int k = m; k < high; k++) {
      const int last = k + 1 == high;
      double size = 1.0;
      if (k > m) {
        p = H[k][k - 1], q = H[k + 1][k - 1], r = last ? 0.0 : H[k + 2][k - 1];
        size = fabs(p) + fabs(q) + fabs(r);
        if (size == 0.0) continue;
        p /= size, q /= size, r /= size;
      }
      const double norm = copysign(sqrt(p * p + q * q + r * r), p);
      if (k > m) {
        H[k][k - 1] = -norm * size;
        H[k + 1][k - 1] = 0.0;
        if (!last) H[k + 2][k - 1] = 0.0;
      } else if (m > low) {
        H[k][k - 1] = -H[k][k - 1];
      }
      p += norm;
      const double a = p / norm, b = q / norm, c = r / norm;
      q /= p, r /= p;
      if (last) {
        for (int j = k; j <= high; j++) {
          const double t = H[k][j] + q * H[k + 1][j];
          H[k][j] -= t * a, H[k + 1][j] -= t * b;
        }
        for (int i = low; i <= high; i++) {
          const double t = a * H[i][k] + b * H[i][k + 1];
          H[i][k] -= t, H[i][k + 1] -= t * q;
        }
      } else {
        const int end = k + 3 < high ? k + 3 : high;
        for (int j = k; j <= high; j++) {
          const double t = H[k][j] + q * H[k + 1][j] + r * H[k + 2][j];
          H[k][j] -= t * a, H[k + 1][j] -= t * b, H[k + 2][j] -= t * c;
        }
        for (int i = low; i <= end; i++) {
          const double t = a * H[i][k] + b * H[i][k + 1] + c * H[i][k + 2];
          H[i][k] -= t, H[i][k + 1] -= t * q, H[i][k + 2] -= t * r;
        }
      }
    }
  }
  return found;
}

/* A vector that M(s) takes nearest to zero, by elimination with the largest pivot of all. */
static void chasles_general_null(const chasles_general_system *system, double c, double s,
    double *u)
{
  double a[12][12];
  int name[12];
  for (int i = 0; i < 12; i++) {
    name[i] = i;
    for (int k = 0; k < 12; k++) {
      a[i][k] = system->M[0][i][k] + c * system->M[1][i][k] + s * system->M[2][i][k];
    }
  }
  for (int j = 0; j < 11; j++) {
    int row = j, column = j;
    double most = -1.0;
    for (int i = j; i < 12; i++) {
      for (int k = j; k < 12; k++) {
        if (fabs(a[i][k]) > most) most = fabs(a[i][k]), row = i, column = k;
      }
    }
    if (!(most > 0.0)) break;
    for (int k = 0; k < 12; k++) {
      const double kept = a[row][k];
      a[row][k] = a[j][k], a[j][k] = kept;
    }
    for (int i = 0; i < 12; i++) {
      const double kept = a[i][column];
      a[i][column] = a[i][j], a[i][j] = kept;
    }
    const int kept = name[column];
    name[column] = name[j], name[j] = kept;
    const double inverse = 1.0 / a[j][j];
    for (int i = j + 1; i < 12; i++) {
      const double factor = a[i][j] * inverse;
      for (int k = j; k < 12; k++) a[i][k] -= factor * a[j][k];
    }
  }
  u[name[11]] = 1.0;
  for (int j = 10; j >= 0; j--) {
    double sum = 0.0;
    for (int k = j + 1; k < 12; k++) sum += a[j][k] * u[name[k]];
    u[name[j]] = a[j][j] != 0.0 ? -sum / a[j][j] : 0.0;
  }
}

/* Difference of two poses (metre, radian) as a twist from the one to the other, at the tool. */
static double chasles_general_error(const double *T, const double *at, double *e)
{
  double w[3] = {0.0}, trace = 0.0, position = 0.0, sine = 0.0;
  for (int k = 0; k < 3; k++) {
    const double a[3] = {at[k], at[4 + k], at[8 + k]}, b[3] = {T[k], T[4 + k], T[8 + k]};
    w[0] += 0.5 * (a[1] * b[2] - a[2] * b[1]);
    w[1] += 0.5 * (a[2] * b[0] - a[0] * b[2]);
    w[2] += 0.5 * (a[0] * b[1] - a[1] * b[0]);
    trace += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    e[k] = T[4 * k + 3] - at[4 * k + 3];
    position += e[k] * e[k];
  }
  sine = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double angle = atan2(sine, 0.5 * (trace - 1.0));
  const double factor = sine > 0.0 ? angle / sine : 1.0;
  for (int k = 0; k < 3; k++) e[3 + k] = factor * w[k];
  position = sqrt(position);
  return position > angle ? position : angle;
}

/* The other joints at an angle s of the suppressed one. */
static void chasles_general_back(const chasles_general_arm *arm,
    const chasles_general_system *system, const double *T, double along, double *q)
{
  const double cs = cos(along), ss = sin(along);
  double u[12], r[3] = {0.0}, local[5];
  chasles_general_null(system, cs, ss, u);
  /* u is a product of two vectors: their directions, from the largest row. */
  int row = 0;
  double most = -1.0;
  for (int i = 0; i < 4; i++) {
    const double size = u[3 * i] * u[3 * i] + u[3 * i + 1] * u[3 * i + 1] +
        u[3 * i + 2] * u[3 * i + 2];
    if (size > most) most = size, row = i;
  }
  for (int i = 0; i < 4; i++) {
    const double weight = u[3 * i] * u[3 * row] + u[3 * i + 1] * u[3 * row + 1] +
        u[3 * i + 2] * u[3 * row + 2];
    for (int k = 0; k < 3; k++) r[k] += weight * u[3 * i + k];
  }
  const double sign = copysign(1.0, r[0]);
  const double w = atan2(sign * r[2], sign * r[1]);
  const double v = 2.0 * atan2(u[9] * r[0] + u[10] * r[1] + u[11] * r[2],
      u[6] * r[0] + u[7] * r[1] + u[8] * r[2]);
  const double of_v[3] = {1.0, cos(v), sin(v)}, of_w[3] = {1.0, cos(w), sin(w)};
  double y[8];
  for (int i = 7; i >= 0; i--) {
    double sum = 0.0;
    for (int k = 0; k < 9; k++) {
      sum += of_v[k / 3] * of_w[k % 3] * (system->head[0][i][k] + cs * system->head[1][i][k] +
          ss * system->head[2][i][k]);
    }
    for (int k = i + 1; k < 8; k++) sum -= system->factor[i][k] * y[k];
    y[i] = system->factor[i][i] != 0.0 ? sum / system->factor[i][i] : 0.0;
  }
  local[0] = atan2(y[5], y[2]), local[1] = atan2(y[1], y[0]);
  local[2] = along, local[3] = v, local[4] = w;
  for (int k = 0; k < 5; k++) q[arm->joint[k]] = chasles_general_wrapped(arm->sign[k] * local[k]);
  /* The last turns what is left of the pose about its axis. */
  const int last = arm->joint[5];
  double at[16], J[36], axis[3], vector[3] = {0.0}, trace = 0.0;
  q[last] = 0.0;
  arm->pose_jacobian(q, at, J);
  for (int k = 0; k < 3; k++) {
    const double a[3] = {at[k], at[4 + k], at[8 + k]}, b[3] = {T[k], T[4 + k], T[8 + k]};
    axis[k] = J[6 * (3 + k) + last];
    vector[0] += a[1] * b[2] - a[2] * b[1];
    vector[1] += a[2] * b[0] - a[0] * b[2];
    vector[2] += a[0] * b[1] - a[1] * b[0];
    trace += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  q[last] = atan2(axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2], trace - 1.0);
}

/* Starts for Newton's steps, one a root; how many. Also how far M was from being singular. */
static int chasles_general_starts(const chasles_general_arm *arm, const double *T,
    chasles_general_start *starts, double *ratio)
{
  static const double from[] = {0.4, 2.5, -1.7, 1.45, -2.75, -0.65};
  chasles_general_system system;
  double H[16][16], best[16][16], re[16], im[16], at = 0.0;
  *ratio = -1.0;
  chasles_general_eliminate(arm, T, &system);
  for (int k = 0; k < 6 && *ratio < CHASLES_PIVOT; k++) {
    const double own = chasles_general_companion(arm, &system, from[k], H);
    if (own > *ratio) {
      *ratio = own, at = from[k];
      memcpy(best, H, sizeof H);
    }
  }
  if (!(*ratio > 0.0)) return 0;
  chasles_general_balance(best);
  chasles_general_hessenberg(best);
  const int count = chasles_general_eigenvalues(best, re, im);
  for (int k = 0; k < count; k++) {
    const double x = re[k], y = im[k];
    chasles_general_start *start = starts + k;
    start->along = at + atan2(x, 1.0 - y) + atan2(x, 1.0 + y);
    start->imaginary = y == 0.0 ? 0.0
        : 0.5 * log(((1.0 + y) * (1.0 + y) + x * x) / ((1.0 - y) * (1.0 - y) + x * x));
    if (y < 0.0) {
      memcpy(start->q, starts[k - 1].q, sizeof start->q);
    } else {
      chasles_general_back(arm, &system, T, start->along, start->q);
    }
  }
  return count;
}

/* Solves a x = b, n = 6, in place; returns the determinant, 0 where a is singular. */
static double chasles_general_solve(double (*a)[7], double *x)
{
  double determinant = 1.0;
  for (int j = 0; j < 6; j++) {
    int p = j;
    for (int i = j + 1; i < 6; i++) {
      if (fabs(a[i][j]) > fabs(a[p][j])) p = i;
    }
    if (!(fabs(a[p][j]) > 0.0)) return 0.0;
    if (p != j) {
      determinant = -determinant;
      for (int k = 0; k < 7; k++) {
        const double kept = a[p][k];
        a[p][k] = a[j][k], a[j][k] = kept;
      }
    }
    determinant *= a[j][j];
    const double inverse = 1.0 / a[j][j];
    for (int i = j + 1; i < 6; i++) {
      const double factor = a[i][j] * inverse;
      for (int k = j; k < 7; k++) a[i][k] -= factor * a[j][k];
    }
  }
  for (int j = 5; j >= 0; j--) {
    double sum = a[j][6];
    for (int k = j + 1; k < 6; k++) sum -= a[j][k] * x[k];
    x[j] = sum / a[j][j];
  }
  return determinant;
}

/* One step towards the pose: Newton's where damping is 0, else Levenberg and Marquardt's. */
static void chasles_general_step(const double *J, const double *e, double length, double damping,
    double *step)
{
  double a[6][7], b[6][7];
  for (int i = 0; i < 6; i++) {
    const double weight = i < 3 ? 1.0 / length : 1.0;
    for (int k = 0; k < 6; k++) a[i][k] = weight * J[6 * i + k];
    a[i][6] = weight * e[i];
  }
  if (damping > 0.0) {
    for (int i = 0; i < 6; i++) {
      for (int k = 0; k < 7; k++) {
        b[i][k] = i == k ? damping : 0.0;
        for (int m = 0; m < 6; m++) b[i][k] += a[m][i] * a[m][k];
      }
    }
    memcpy(a, b, sizeof a);
  }
  memset(step, 0, 6 * sizeof *step);
  chasles_general_solve(a, step);
  double most = 0.0;
  for (int k = 0; k < 6; k++) most = fabs(step[k]) > most ? fabs(step[k]) : most;
  if (!(most <= 0.5)) {
    for (int k = 0; k < 6; k++) step[k] = most < DBL_MAX ? step[k] * 0.5 / most : 0.0;
  }
}

/* What is left of a pose as the sum of squares that steps make smaller. */
static double chasles_general_cost(const double *e, double length)
{
  double metres = 0.0, radians = 0.0;
  for (int k = 0; k < 3; k++) metres += e[k] * e[k], radians += e[3 + k] * e[3 + k];
  return metres / (length * length) + radians;
}

/* Steps q towards the pose; returns what is left (metre or radian, the larger). */
static double chasles_general_polish(const chasles_general_arm *arm, const double *T, int most,
    double *q, double *J)
{
  double at[16], e[6], step[6], next[6], next_J[36], damping = 0.0;
  arm->pose_jacobian(q, at, J);
  double left = chasles_general_error(T, at, e);
  double cost = chasles_general_cost(e, arm->length);
  for (int k = 0; k < most && left > CHASLES_CLOSED; k++) {
    double next_e[6];
    chasles_general_step(J, e, arm->length, damping, step);
    for (int i = 0; i < 6; i++) next[i] = q[i] + step[i];
    arm->pose_jacobian(next, at, next_J);
    const double then = chasles_general_error(T, at, next_e);
    const double cost_then = chasles_general_cost(next_e, arm->length);
    if (cost_then < cost) {
      const int slow = cost_then > 0.999999 * cost && left > CHASLES_NEAR;
      /* Where a step did much, the next may be Newton's. */
      damping = cost_then < 0.25 * cost || damping < 1e-13 ? 0.0 : 0.03 * damping;
      left = then, cost = cost_then;
      memcpy(q, next, sizeof next);
      memcpy(J, next_J, sizeof next_J);
      memcpy(e, next_e, sizeof e);
      if (slow) break;
    } else if (left < 1e-12 || damping > 1e3) {
      break;
    } else {
      damping = damping > 0.0 ? 30.0 * damping : left > CHASLES_NEAR ? 1e-5 : 1e-14;
    }
  }
  for (int i = 0; i < 6; i++) q[i] = chasles_general_wrapped(q[i]);
  return left;
}

/* |det J| over the product of its columns' lengths: 1 at best, 0 where J is singular. */
static double chasles_general_margin(const double *J, double length)
{
  double a[6][7], x[6], lengths = 1.0;
  for (int k = 0; k < 6; k++) {
    double sum = 0.0;
    for (int i = 0; i < 6; i++) {
      a[i][k] = i < 3 ? J[6 * i + k] / length : J[6 * i + k];
      sum += a[i][k] * a[i][k];
      a[i][6] = 0.0;
    }
    lengths *= sqrt(sum);
  }
  return fabs(chasles_general_solve(a, x)) / lengths;
}

/* Solutions found so far, none twice. */
typedef struct {
  int count;
  double q[CHASLES_ROOTS][6], residual[CHASLES_ROOTS], margin[CHASLES_ROOTS];
} chasles_general_found;

static void chasles_general_keep(const chasles_general_arm *arm, chasles_general_found *found,
    const double *q, double residual, const double *J)
{
  if (!(residual <= CHASLES_SOLVED)) return;
  const double margin = chasles_general_margin(J, arm->length);
  int own = 0;
  for (; own < found->count; own++) {
    double most = 0.0;
    for (int k = 0; k < 6; k++) {
      const double apart = fabs(chasles_general_wrapped(q[k] - found->q[own][k]));
      most = apart > most ? apart : most;
    }
    if (most < CHASLES_SAME) break;
  }
  if (own < found->count) {
    if (found->residual[own] <= residual) return;
  } else if (found->count < CHASLES_ROOTS) {
    found->count++;
  } else {
    /* One of infinitely many makes room for one that stands alone. */
    own = 0;
    for (int k = 1; k < CHASLES_ROOTS; k++) own = found->margin[k] < found->margin[own] ? k : own;
    if (found->margin[own] >= margin) return;
  }
  memcpy(found->q[own], q, 6 * sizeof *q);
  found->residual[own] = residual;
  found->margin[own] = margin;
}

/* The direction in which J moves the pose least, by one step of inverse iteration. */
static void chasles_general_least(const double *J, double length, double *direction)
{
  double a[6][7], norm = 0.0;
  for (int i = 0; i < 6; i++) {
    for (int k = 0; k < 6; k++) {
      a[i][k] = i == k ? 1e-10 : 0.0;
      for (int m = 0; m < 6; m++) {
        a[i][k] += J[6 * m + i] * J[6 * m + k] * (m < 3 ? 1.0 / (length * length) : 1.0);
      }
    }
    a[i][6] = 1.0 + 0.1 * i;
    direction[i] = 0.0;
  }
  chasles_general_solve(a, direction);
  for (int k = 0; k < 6; k++) norm += direction[k] * direction[k];
  norm = norm > 0.0 ? sqrt(norm) : 1.0;
  for (int k = 0; k < 6; k++) direction[k] /= norm;
}

/* Newton's steps from a start; from both sides of one where two roots are about to meet. */
static void chasles_general_try(const chasles_general_arm *arm, const double *T,
    const chasles_general_start *start, int most, chasles_general_found *found)
{
  double q[6], J[36], direction[6], at[16], e[6];
  if (start->imaginary == 0.0) {
    memcpy(q, start->q, sizeof q);
    const double left = chasles_general_polish(arm, T, most, q, J);
    chasles_general_keep(arm, found, q, left, J);
    return;
  }
  arm->pose_jacobian(start->q, at, J);
  chasles_general_least(J, arm->length, direction);
  const double apart = sqrt(chasles_general_error(T, at, e)) + fabs(start->imaginary);
  const double way = start->imaginary > 0.0 ? apart : -apart;
  for (int k = 0; k < 6; k++) q[k] = start->q[k] + way * direction[k];
  const double left = chasles_general_polish(arm, T, most, q, J);
  chasles_general_keep(arm, found, q, left, J);
}

/* The pose turned and moved a little, each time another way. */
static void chasles_general_nudged(const double *T, double length, double size, int way,
    double *near)
{
  static const double ways[][6] = {
    {0.6, -0.5, 0.4, 0.3, 0.7, -0.6}, {-0.3, 0.8, 0.5, -0.7, 0.2, 0.5},
    {0.7, 0.2, -0.6, 0.5, -0.4, -0.8}, {-0.5, -0.6, -0.2, -0.4, 0.6, 0.3},
  };
  const double *w = ways[way % 4];
  const double a = size * w[0], b = size * w[1], c = size * w[2];
  const double n = 1.0 / (1.0 + a * a + b * b + c * c);
  /* Cayley's rotation, so that the pose stays one. */
  const double R[3][3] = {
    {n * (1.0 + a * a - b * b - c * c), 2.0 * n * (a * b - c), 2.0 * n * (a * c + b)},
    {2.0 * n * (a * b + c), n * (1.0 - a * a + b * b - c * c), 2.0 * n * (b * c - a)},
    {2.0 * n * (a * c - b), 2.0 * n * (b * c + a), n * (1.0 - a * a - b * b + c * c)},
  };
  memcpy(near, T, 16 * sizeof *T);
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) {
      near[4 * i + k] = R[i][0] * T[k] + R[i][1] * T[4 + k] + R[i][2] * T[8 + k];
    }
    near[4 * i + 3] += size * length * w[3 + i];
  }
}

/* Every solution of a pose in sixteen slots: solutions first, by the suppressed joint; then what
 * lies nearest to a solution where there is none, with what it leaves of the pose. */
static void chasles_general_ik(const chasles_general_arm *arm, const double *T, double *q,
    double *residual, double *margin)
{
  chasles_general_start starts[CHASLES_ROOTS], others[CHASLES_ROOTS];
  chasles_general_found found;
  double J[36], near[16], ratio;
  found.count = 0;
  int count = 0, finite = 1;
  for (int k = 0; k < 16; k++) finite = finite && T[k] - T[k] == 0.0;
  if (!finite) {
    for (int k = 0; k < CHASLES_ROOTS; k++) {
      for (int i = 0; i < 6; i++) q[6 * k + i] = NAN;
      residual[k] = margin[k] = NAN;
    }
    return;
  }
  count = chasles_general_starts(arm, T, starts, &ratio);
  double nearest = count < CHASLES_ROOTS ? 0.0 : DBL_MAX;
  int real = 0;
  for (int k = 0; k < count; k++) {
    const double imaginary = fabs(starts[k].imaginary);
    nearest = imaginary < nearest ? imaginary : nearest;
    if (imaginary > 0.0) continue;
    chasles_general_try(arm, T, starts + k, 50, &found);
    real++;
  }
  const int unsure = found.count < real || !(ratio > CHASLES_SINGULAR);
  for (int k = 0; k < count; k++) {
    const double imaginary = fabs(starts[k].imaginary);
    if (imaginary > 0.0 && imaginary < CHASLES_NEARLY_REAL) {
      chasles_general_try(arm, T, starts + k, 50, &found);
    }
  }
  /* Solutions come in pairs: of an odd number, or of none, one may hide. So may some where roots
   * ran together or the equations fail; from poses nearby they are found. */
  for (int k = 0; k < 6 && nearest < CHASLES_HIDING; k++) {
    static const double sizes[] = {1e-5, 1e-3, 1e-4, 1e-2, 1e-3, 1e-2};
    if (!unsure && found.count > 0 && found.count % 2 == 0) break;
    chasles_general_nudged(T, arm->length, sizes[k], k, near);
    const int some = chasles_general_starts(arm, near, others, &ratio);
    for (int i = 0; i < some; i++) {
      if (fabs(others[i].imaginary) < CHASLES_NEARLY_REAL + 2.0 * sqrt(sizes[k])) {
        chasles_general_polish(arm, near, 3, others[i].q, J);
        chasles_general_try(arm, T, others + i, 50, &found);
      }
    }
  }
  /* Out of reach, or where several solutions run together and steps get short. */
  for (int k = 0; k < count && found.count == 0; k++) {
    if (starts[k].imaginary < 0.0) continue;
    double left = chasles_general_polish(arm, T, 200, starts[k].q, J);
    if (left < CHASLES_NEAR) left = chasles_general_polish(arm, T, 1000, starts[k].q, J);
    chasles_general_keep(arm, &found, starts[k].q, left, J);
  }
  for (int i = 0; i < found.count; i++) {
    int k = i;
    const int key = arm->joint[2];
    for (; k > 0 && q[6 * (k - 1) + key] > found.q[i][key]; k--) {
      memcpy(q + 6 * k, q + 6 * (k - 1), 6 * sizeof *q);
      residual[k] = residual[k - 1], margin[k] = margin[k - 1];
    }
    memcpy(q + 6 * k, found.q[i], 6 * sizeof *q);
    residual[k] = found.residual[i], margin[k] = found.margin[i];
  }
  int slot = found.count;
  for (int k = 0; k < count + CHASLES_ROOTS && slot < CHASLES_ROOTS; k++) {
    double *own = q + 6 * slot;
    memset(own, 0, 6 * sizeof *q);
    if (k < count) memcpy(own, starts[k].q, 6 * sizeof *q);
    residual[slot] = chasles_general_polish(arm, T, 0, own, J);
    margin[slot] = -residual[slot];
    slot += residual[slot] > CHASLES_SOLVED && (k >= count || starts[k].imaginary != 0.0);
  }
}

#endif
