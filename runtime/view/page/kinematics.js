// The motion of a skeleton: poses of all bodies from the configuration z, and z from the sliders.
// Matrices are arrays of 16 numbers, row by row.
"use strict";

const CLOSED = 1e-12; // residual of the closures, in parts of the robot's size, that counts as closed
const MOST_STEPS = 20; // iterations; a good start takes four
const PROBE = 1e-6; // step of the numeric derivative [rad, parts of the robot's size]
const STRIDE = 0.05; // largest move of a slider's coordinate at once [rad, parts of the robot's size]
const NEAR = 3; // strides that a joint moves in one of a slider, beyond which it is another branch
const SMALLEST_STRIDE = 1e-3; // part of a stride below which the loops are said not to close

function product(A, B) {
  const C = new Array(16);
  for (let i = 0; i < 4; i++) {
    for (let j = 0; j < 4; j++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += A[4 * i + k] * B[4 * k + j];
      C[4 * i + j] = sum;
    }
  }
  return C;
}

function moved(T, p) {
  return [0, 4, 8].map((i) => T[i] * p[0] + T[i + 1] * p[1] + T[i + 2] * p[2] + T[i + 3]);
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const column = (T, k) => [T[k], T[4 + k], T[8 + k]];

// The motion of a joint by a value, in the frame of its body.
function motion(joint, value) {
  const [x, y, z] = joint.axis;
  if (joint.kind === "prismatic") {
    return [1, 0, 0, value * x, 0, 1, 0, value * y, 0, 0, 1, value * z, 0, 0, 0, 1];
  }
  const c = Math.cos(value), s = Math.sin(value), v = 1 - c;
  const T = [
    c + v * x * x, v * x * y - s * z, v * x * z + s * y, 0,
    v * x * y + s * z, c + v * y * y, v * y * z - s * x, 0,
    v * x * z - s * y, v * y * z + s * x, c + v * z * z, 0,
    0, 0, 0, 1,
  ];
  const turned = moved(T, joint.at);
  for (let i = 0; i < 3; i++) {
    T[4 * i + 3] = joint.at[i] - turned[i] + joint.advance * value * joint.axis[i];
  }
  return T;
}

class Kinematics {
  constructor(robot) {
    this.robot = robot;
    this.z = robot.z.slice();
    this.driven = robot.sliders.map((slider) => slider.index);
    const used = [...robot.bodies.map((body) => body.joint), ...robot.struts]
      .map((part) => (part ? part.coordinate : -1))
      .filter((k) => k >= 0 && !this.driven.includes(k));
    this.free = robot.closures.length + robot.struts.length ? [...new Set(used)] : [];
  }

  // The poses of all bodies; parts of struts lie between the points that they join.
  poses(z = this.z) {
    const T = [];
    for (const body of this.robot.bodies) {
      if (body.span) T.push(this.spanned(body.span, T));
      else if (body.joint === null) T.push(body.placement.slice());
      else {
        const { coordinate, ratio, offset } = body.joint;
        const value = coordinate < 0 ? 0 : ratio * z[coordinate] + offset;
        const fixed = product(T[body.parent], body.placement);
        T.push(body.joint.kind === "fixed" ? fixed : product(fixed, motion(body.joint, value)));
      }
    }
    return T;
  }

  spanned(span, T) {
    const a = moved(T[span.bodies[0]], span.ends[0]), b = moved(T[span.bodies[1]], span.ends[1]);
    const origin = span.from_end ? b : a;
    const way = minus(b, a), length = Math.hypot(...way) || 1;
    const z = way.map((w) => w / length);
    const side = minus(moved(T[span.bodies[0]], span.across), column(T[span.bodies[0]], 3));
    const along = dot(side, z);
    const rest = side.map((s, i) => s - along * z[i]), size = Math.hypot(...rest) || 1;
    const y = rest.map((r) => r / size), x = cross(y, z);
    return [x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2],
      0, 0, 0, 1];
  }

  // What keeps the loops open, in metres, and angles times the robot's size.
  residual(z) {
    const T = this.poses(z), out = [], size = this.robot.size;
    for (const strut of this.robot.struts) {
      const a = moved(T[strut.bodies[0]], strut.ends[0]);
      const b = moved(T[strut.bodies[1]], strut.ends[1]);
      const longer = strut.coordinate < 0 ? 0 : z[strut.coordinate];
      out.push(Math.hypot(...minus(b, a)) - strut.length - longer);
    }
    for (const closure of this.robot.closures) {
      const A = product(T[closure.bodies[0]], closure.frames[0]);
      const B = product(T[closure.bodies[1]], closure.frames[1]);
      const gap = minus(column(B, 3), column(A, 3));
      const [x, y, w] = [0, 1, 2].map((k) => column(A, k));
      out.push(dot(gap, x), dot(gap, y));
      if (closure.kind !== "slider") out.push(dot(gap, w));
      if (closure.kind !== "ball") out.push(size * dot(x, column(B, 2)), size * dot(y, column(B, 2)));
      if (closure.kind === "weld" || closure.kind === "slider") out.push(size * dot(x, column(B, 1)));
    }
    return out;
  }

  // Closes the loops with Gauss and Newton's iteration, from a configuration nearby.
  closed(start) {
    const z = start.slice();
    for (let step = 0; step < MOST_STEPS; step++) {
      const r = this.residual(z);
      if (Math.max(...r.map(Math.abs), 0) < CLOSED * this.robot.size) return z;
      const columns = this.free.map((k) => {
        const h = PROBE * this.robot.scales[k], there = z.slice();
        there[k] += h;
        const further = this.residual(there);
        there[k] -= 2 * h;
        const back = this.residual(there);
        // Columns in scaled unknowns: angles count the robot's size.
        return further.map((f, i) => ((f - back[i]) / (2 * h)) * this.robot.scales[k]);
      });
      const move = leastSquares(columns, r);
      this.free.forEach((k, j) => (z[k] -= move[j] * this.robot.scales[k]));
    }
    return null;
  }

  // Follows the loops to new values of the sliders [rad or m]; false where they do not close.
  moveTo(q) {
    const { sliders, scales } = this.robot;
    const goal = q.map((value, i) => value * sliders[i].ratio);
    const from = this.driven.map((k) => this.z[k]);
    const far = goal.map((g, i) => Math.abs(g - from[i]) / scales[this.driven[i]]);
    const stride = Math.min(1, STRIDE / Math.max(...far, 1e-300));
    if (this.free.length === 0) {
      this.driven.forEach((k, i) => (this.z[k] = goal[i]));
      return true;
    }
    let done = 0, step = stride;
    while (done < 1) {
      const part = Math.min(1, done + step), z = this.z.slice();
      this.driven.forEach((k, i) => (z[k] = from[i] + part * (goal[i] - from[i])));
      const found = this.closed(z);
      if (found && this.isNear(found, z)) {
        this.z = found;
        done = part;
        step = Math.min(stride, 2 * step);
      } else {
        step /= 2;
        if (step < SMALLEST_STRIDE * stride) return false;
      }
    }
    return true;
  }

  // Whether no joint jumped: a far solution is another branch.
  isNear(found, z) {
    return this.free.every((k) => Math.abs(found[k] - z[k]) < NEAR * STRIDE * this.robot.scales[k]);
  }
}

// The least move x with A x = r in least squares, A by columns: normal equations with pivots that
// leave out directions in which nothing moves.
function leastSquares(columns, r) {
  const n = columns.length, M = [];
  for (let i = 0; i < n; i++) {
    M.push(columns.map((c) => inner(columns[i], c)));
    M[i].push(inner(columns[i], r));
  }
  const most = Math.max(...M.map((row, i) => row[i]), 1e-300), order = [];
  const rest = new Set(columns.keys());
  while (rest.size) {
    const k = [...rest].reduce((a, b) => (M[a][a] >= M[b][b] ? a : b));
    rest.delete(k);
    if (M[k][k] < 1e-12 * most) break;
    order.push(k);
    for (let i = 0; i < n; i++) {
      if (i === k) continue;
      const factor = M[i][k] / M[k][k];
      for (let j = 0; j <= n; j++) M[i][j] -= factor * M[k][j];
    }
  }
  const x = new Array(n).fill(0);
  for (const k of order) x[k] = M[k][n] / M[k][k];
  return x;
}

function inner(a, b) {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
}
