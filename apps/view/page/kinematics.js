// Kinematics of a skeleton: body poses from the configuration z, and z from the sliders.
// Matrices are arrays of 16 numbers in row order.
"use strict";

const CLOSED = 1e-12; // maximum residual of closed loops, relative to the robot size
const MAX_STEPS = 20; // maximum number of iterations; a good start needs four
const STILL = 1e-12; // relative pivot below which a direction is a null direction
const STRIDE = 0.05; // maximum step of a slider coordinate [rad, or relative to the robot size]
const NEAR = 3; // maximum joint motion per slider step, in steps; more is another branch
const SMALLEST_STRIDE = 1e-3; // minimum step relative to STRIDE; below it, loops do not close

// The product of two poses, unrolled, since it takes most of the time of a frame.
function product(A, B) {
  const a = A[0], b = A[1], c = A[2], p = A[3], d = A[4], e = A[5];
  const f = A[6], q = A[7], g = A[8], h = A[9], i = A[10], r = A[11];
  return [
    a * B[0] + b * B[4] + c * B[8], a * B[1] + b * B[5] + c * B[9],
    a * B[2] + b * B[6] + c * B[10], a * B[3] + b * B[7] + c * B[11] + p,
    d * B[0] + e * B[4] + f * B[8], d * B[1] + e * B[5] + f * B[9],
    d * B[2] + e * B[6] + f * B[10], d * B[3] + e * B[7] + f * B[11] + q,
    g * B[0] + h * B[4] + i * B[8], g * B[1] + h * B[5] + i * B[9],
    g * B[2] + h * B[6] + i * B[10], g * B[3] + h * B[7] + i * B[11] + r,
    0, 0, 0, 1,
  ];
}

function moved(T, p) {
  const v = turned(T, p);
  return [v[0] + T[3], v[1] + T[7], v[2] + T[11]];
}

function turned(T, v) {
  const x = v[0], y = v[1], z = v[2];
  return [
    T[0] * x + T[1] * y + T[2] * z,
    T[4] * x + T[5] * y + T[6] * z,
    T[8] * x + T[9] * y + T[10] * z,
  ];
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const column = (T, k) => [T[k], T[4 + k], T[8 + k]];

// The pose of a joint at a value, in the frame of its body.
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
    const equations = robot.closures.length + robot.struts.length + robot.couplings.length;
    this.free = equations ? [...new Set(used)] : [];
    this.paths = this.pathsFromTheGround();
  }

  // For each body, the bodies whose joints move it.
  pathsFromTheGround() {
    const paths = [];
    this.robot.bodies.forEach(({ joint, parent }, k) => {
      const before = joint === null ? [] : paths[parent];
      paths.push(joint !== null && joint.coordinate >= 0 ? [...before, k] : before);
    });
    return paths;
  }

  // The poses of all bodies; struts lie between their end points.
  poses(z = this.z) {
    const T = this.frames(z);
    for (const { span } of this.robot.bodies.slice(T.length)) T.push(this.spanned(span, T));
    return T;
  }

  // The poses of the ground and of the bodies on joints, which precede the struts.
  frames(z) {
    const T = [];
    for (const body of this.robot.bodies) {
      if (body.span) break;
      if (body.joint === null) {
        T.push(body.placement);
        continue;
      }
      const { coordinate, ratio, offset } = body.joint;
      const value = coordinate < 0 ? 0 : ratio * z[coordinate] + offset;
      const fixed = product(T[body.parent], body.placement);
      T.push(body.joint.kind === "fixed" ? fixed : product(fixed, motion(body.joint, value)));
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

  toolPose(T) {
    return product(T[this.robot.tool.body], this.robot.tool.placement);
  }

  // The twist of each body relative to its parent per unit of the coordinate: angular velocity w, and
  // velocity m of the body point at the base origin.
  twists(T) {
    return this.robot.bodies.map(({ joint }, k) => {
      if (joint === null || joint.coordinate < 0) return null;
      const axis = turned(T[k], joint.axis).map((a) => joint.ratio * a);
      if (joint.kind === "prismatic") return { w: [0, 0, 0], m: axis };
      const around = cross(moved(T[k], joint.at), axis);
      return { w: axis, m: around.map((v, i) => v + joint.advance * axis[i]) };
    });
  }

  // Rows of equations at a configuration, each with its value and its derivative with respect to z.
  rowsAt(T) {
    return new Rows(this, T, this.twists(T));
  }

  // The closure residual of the loops: lengths in meters, angles times the robot size.
  loops(z, T) {
    const rows = this.rowsAt(T), size = this.robot.size;
    for (const strut of this.robot.struts) {
      const [a, b] = strut.bodies.map((body, i) => moved(T[body], strut.ends[i]));
      const gap = minus(b, a), length = Math.hypot(...gap), way = gap.map((g) => g / length);
      rows.add(length - strut.length - (strut.coordinate < 0 ? 0 : z[strut.coordinate]));
      rows.moving(strut.bodies[1], b, way, 1);
      rows.moving(strut.bodies[0], a, way, -1);
      if (strut.coordinate >= 0) rows.last[strut.coordinate] -= 1;
    }
    for (const { kind, bodies, frames } of this.robot.closures) {
      const [A, B] = bodies.map((body, i) => product(T[body], frames[i]));
      const [x, y, w] = [0, 1, 2].map((k) => column(A, k));
      const met = { pin: [x, y, w], ball: [x, y, w], weld: [x, y, w], slider: [x, y] }[kind];
      const square = [[x, column(B, 2)], [y, column(B, 2)], [x, column(B, 1)]];
      met.forEach((axis) => rows.meeting(bodies, column(A, 3), column(B, 3), axis));
      square
        .slice(0, { pin: 2, ball: 0, weld: 3, slider: 3 }[kind])
        .forEach(([a, b]) => rows.square(bodies, a, b, size));
    }
    for (const { factors, total } of this.robot.couplings) {
      rows.add(factors.reduce((sum, factor, k) => sum + factor * z[k], -total));
      factors.forEach((factor, k) => (rows.last[k] += factor));
    }
    return rows;
  }

  // Closes the loops by Gauss-Newton iteration from a nearby configuration; only the entries of z in
  // `unknown` change. Null if the iteration does not converge.
  closed(start, unknown = this.free) {
    const z = start.slice(), { scales, size } = this.robot;
    for (let step = 0; step < MAX_STEPS; step++) {
      const T = this.frames(z), rows = this.loops(z, T), open = rows.largest();
      if (!(open < Infinity)) return null;
      if (open < CLOSED * size) return this.faces(T) ? z : null;
      const move = solved(rows.normal(unknown, scales), rows.against(unknown, scales));
      unknown.forEach((k, j) => (z[k] -= move[j][0] * scales[k]));
    }
    return null;
  }

  // Whether axes that closures connect have the same direction, not the opposite one.
  faces(T) {
    return this.robot.closures.every(({ kind, bodies, frames }) => {
      const [A, B] = bodies.map((body, i) => product(T[body], frames[i]));
      const held = { pin: [2], ball: [], weld: [0, 1], slider: [0, 1] }[kind];
      return held.every((k) => dot(column(A, k), column(B, k)) > 0);
    });
  }

  // The derivative of each free coordinate with respect to each driven one, in scaled units.
  following(z, T) {
    const { scales } = this.robot;
    if (this.free.length === 0) return [];
    const rows = this.loops(z, T);
    const by = rows.products(this.free, this.driven, scales);
    return solved(rows.normal(this.free, scales), by).map((row) => row.map((value) => -value));
  }

  // Moves to new slider values [rad or m] with closed loops; false if loops do not close.
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

  // Whether no joint jumped, which would be a change of branch.
  isNear(found, z) {
    return this.free.every((k) => Math.abs(found[k] - z[k]) < NEAR * STRIDE * this.robot.scales[k]);
  }
}

// Rows of equations: a value and its derivative with respect to z for each row.
class Rows {
  constructor(kinematics, T, twists) {
    Object.assign(this, { paths: kinematics.paths, bodies: kinematics.robot.bodies, T, twists });
    this.count = kinematics.z.length;
    this.values = [];
    this.by = [];
  }

  get last() {
    return this.by[this.by.length - 1];
  }

  add(value) {
    this.values.push(value);
    this.by.push(new Float64Array(this.count));
  }

  // Adds the velocity of a body point along a direction to the last row.
  moving(body, point, direction, factor) {
    const moment = cross(point, direction);
    for (const k of this.paths[body]) {
      const { w, m } = this.twists[k];
      this.last[this.bodies[k].joint.coordinate] += factor * (dot(w, moment) + dot(m, direction));
    }
  }

  // Adds the angular velocity of a body about a direction to the last row.
  turning(body, direction, factor) {
    for (const k of this.paths[body]) {
      this.last[this.bodies[k].joint.coordinate] += factor * dot(this.twists[k].w, direction);
    }
  }

  // Adds the row of two points on two bodies that coincide along an axis of the first body.
  meeting([a, b], from, to, axis) {
    const gap = minus(to, from);
    this.add(dot(gap, axis));
    this.moving(b, to, axis, 1);
    this.moving(a, from, axis, -1);
    this.turning(a, cross(axis, gap), 1);
  }

  // Adds the row of two perpendicular axes of two bodies.
  square([a, b], one, other, size) {
    const normal = cross(one, other);
    this.add(size * dot(one, other));
    this.turning(a, normal, size);
    this.turning(b, normal, -size);
  }

  largest() {
    return this.values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  }

  // A' A for the columns of some scaled entries of z.
  normal(entries, scales) {
    return this.products(entries, entries, scales);
  }

  products(entries, others, scales) {
    const M = entries.map(() => new Array(others.length).fill(0));
    for (const row of this.by) {
      const right = others.map((k) => scales[k] * row[k]);
      for (let a = 0; a < entries.length; a++) {
        const own = scales[entries[a]] * row[entries[a]], sums = M[a];
        if (own === 0) continue;
        for (let b = 0; b < right.length; b++) sums[b] += own * right[b];
      }
    }
    return M;
  }

  // A' r as a column.
  against(entries, scales) {
    return entries.map((k) => {
      let sum = 0;
      for (let i = 0; i < this.by.length; i++) sum += this.by[i][k] * this.values[i];
      return [scales[k] * sum];
    });
  }
}

// The solution X of M X = R for a positive semidefinite M; null directions are omitted.
function solved(M, R) {
  const n = M.length, rows = M.map((row, i) => [...row, ...R[i]]);
  const most = Math.max(...M.map((row, i) => row[i]), 1e-300), rest = [...rows.keys()];
  const X = R.map((row) => row.map(() => 0)), order = [];
  while (rest.length) {
    let best = 0;
    for (let a = 1; a < rest.length; a++) {
      if (rows[rest[a]][rest[a]] > rows[rest[best]][rest[best]]) best = a;
    }
    const [k] = rest.splice(best, 1), own = rows[k], pivot = own[k];
    if (!(pivot > STILL * most)) break;
    order.push(k);
    for (let i = 0; i < n; i++) {
      const row = rows[i], factor = row[k] / pivot;
      if (i === k || factor === 0) continue;
      for (let j = 0; j < row.length; j++) row[j] -= factor * own[j];
    }
  }
  for (const k of order) X[k] = rows[k].slice(n).map((value) => value / rows[k][k]);
  return X;
}
