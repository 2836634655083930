// Inverse kinematics on the page: damped least squares from the previous configuration, and a
// search from many starts for other configurations with the same tool pose.
"use strict";

const REACHED = 1e-11; // maximum tool error [relative to the robot size, and rad]
const MAX_DRAGS = 25; // maximum number of iterations; a typical drag needs three
const SECOND = 0.02; // weight of the part of the pose that is not dragged, for poses out of reach
const DAMPING = 1e-3; // damping of the normal equations relative to the squared error
const MIN_DAMPING = 1e-14; // minimum damping, at a reached pose
const FARTHEST = 0.3; // maximum step of a coordinate [rad, or relative to the robot size]
const WORSE = 12; // maximum number of increases of the damping in an iteration
const MIN_GAIN = 1e-3; // relative decrease of the error below which the iteration stops
const STARTS = 120; // number of starts of a search for other configurations
const SAME = 1e-6; // distance of bodies, relative to the robot size, of equal configurations
const NOT_ISOLATED = 1e-6; // ratio of pivots below which a configuration has a self-motion

// The rows of the tool error at a goal: position relative to the robot size, rotation in radians.
function toolRows(kinematics, T, goal, weights) {
  const { size, tool } = kinematics.robot, at = kinematics.toolPose(T);
  const rows = kinematics.rowsAt(T), here = column(at, 3);
  const off = minus(column(goal, 3), here), turn = rotationBetween(at, goal);
  [0, 1, 2].forEach((k) => {
    const axis = [0, 0, 0];
    axis[k] = 1;
    rows.add((weights.position * off[k]) / size);
    rows.moving(tool.body, here, axis, weights.position / size);
  });
  [0, 1, 2].forEach((k) => {
    const axis = [0, 0, 0];
    axis[k] = 1;
    rows.add(weights.turn * turn[k]);
    rows.turning(tool.body, axis, weights.turn);
  });
  return rows;
}

// The rotation vector from one pose to another, in base axes.
function rotationBetween(from, to) {
  const R = [0, 1, 2].map((i) => [0, 1, 2].map((j) =>
    [0, 1, 2].reduce((sum, k) => sum + to[4 * i + k] * from[4 * j + k], 0)));
  const twice = [R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]];
  const sine = Math.hypot(...twice) / 2, cosine = (R[0][0] + R[1][1] + R[2][2] - 1) / 2;
  const angle = Math.atan2(sine, cosine);
  if (sine > 1e-6) return twice.map((t) => (t / 2) * (angle / sine));
  if (cosine > 0) return twice.map((t) => t / 2);
  // Half a turn: the axis is the largest column of R + 1.
  const k = [0, 1, 2].reduce((a, b) => (R[a][a] > R[b][b] ? a : b));
  const axis = [0, 1, 2].map((i) => R[i][k] + (i === k ? 1 : 0)), length = Math.hypot(...axis);
  return axis.map((a) => (a / length) * angle);
}

class Inverse {
  constructor(kinematics) {
    const { sliders, scales } = kinematics.robot;
    this.kinematics = kinematics;
    this.scales = kinematics.driven.map((k) => scales[k]);
    const ends = sliders.map(({ limits, ratio }) => limits.map((end, i) =>
      (end === null ? (i ? Infinity : -Infinity) : end * ratio)));
    this.lower = ends.map((pair) => Math.min(...pair));
    this.upper = ends.map((pair) => Math.max(...pair));
  }

  // The configuration that follows the tool from z to a goal, with its errors at the goal.
  //
  // If the pose is out of reach, the dragged part ("position" or "turn") takes precedence. Loops stay
  // closed, and with `within` coordinates stay within their limits. The iteration stops at an error
  // of `reached`.
  follow(z, goal, first = "position", within = true, reached = REACHED) {
    const weights = { position: SECOND, turn: SECOND, [first]: 1 };
    let here = this.stateAt(z, goal, weights), damping = DAMPING;
    for (let step = 0; step < MAX_DRAGS && here.error > reached * SECOND; step++) {
      const next = this.better(here, goal, weights, damping, within);
      if (next === null) break;
      const gain = 1 - next.state.error / here.error;
      here = next.state;
      damping = next.damping;
      if (gain < MIN_GAIN) break;
    }
    const rows = toolRows(this.kinematics, here.T, goal, { position: 1, turn: 1 }).values;
    return { z: here.z, position: Math.hypot(...rows.slice(0, 3)), turn: Math.hypot(...rows.slice(3)) };
  }

  stateAt(z, goal, weights) {
    const T = this.kinematics.frames(z), rows = toolRows(this.kinematics, T, goal, weights);
    return { z, T, rows, error: Math.hypot(...rows.values) };
  }

  // A state with a smaller error, and its damping; null if there is none.
  better(here, goal, weights, damping, within) {
    const J = this.jacobian(here);
    for (let k = 0; k < WORSE; k++) {
      const move = this.moveOf(J, here, damping * here.error ** 2 + MIN_DAMPING, within);
      const z = this.after(here, move);
      const state = z && this.stateAt(z, goal, weights);
      if (state && state.error < here.error) {
        return { state, damping: Math.max(damping / 10, DAMPING / 1e4) };
      }
      damping *= 10;
    }
    return null;
  }

  // Rows of the tool Jacobian with respect to the scaled driven coordinates, with closed loops.
  jacobian(here) {
    const { driven, free, robot } = this.kinematics;
    here.follow = this.kinematics.following(here.z, here.T);
    return Array.from(here.rows.by, (row) => driven.map((k, i) => {
      const passive = free.reduce((sum, f, j) => sum + row[f] * robot.scales[f] * here.follow[j][i], 0);
      return row[k] * this.scales[i] + passive;
    }));
  }

  // The damped step of the scaled driven coordinates. A coordinate that would exceed its limit moves
  // to the limit, and the others compensate.
  moveOf(J, here, damping, within) {
    const n = this.scales.length, move = new Array(n).fill(0), fixed = new Set();
    for (let round = 0; round <= n; round++) {
      const kept = [...move.keys()].filter((i) => !fixed.has(i));
      const rest = here.rows.values.map((value, r) =>
        [...fixed].reduce((left, i) => left - J[r][i] * move[i], value));
      const M = kept.map((i) => kept.map((j) =>
        J.reduce((sum, row) => sum + row[i] * row[j], 0) + (i === j ? damping : 0)));
      const found = solved(M, kept.map((i) => [J.reduce((sum, row, r) => sum + row[i] * rest[r], 0)]));
      kept.forEach((i, a) => (move[i] = found[a][0]));
      const beyond = within ? kept.filter((i) => this.clipped(i, here, move[i]) !== move[i]) : [];
      if (beyond.length === 0) break;
      for (const i of beyond) {
        move[i] = this.clipped(i, here, move[i]);
        fixed.add(i);
      }
    }
    const most = Math.max(...move.map(Math.abs));
    return most > FARTHEST ? move.map((m) => (m * FARTHEST) / most) : move;
  }

  // The step, clipped at a limit; a coordinate beyond a limit may move back.
  clipped(i, here, move) {
    const now = here.z[this.kinematics.driven[i]];
    const low = Math.min(this.lower[i], now), high = Math.max(this.upper[i], now);
    const then = now + move * this.scales[i];
    if (then >= low && then <= high) return move;
    return ((then < low ? low : high) - now) / this.scales[i];
  }

  // The configuration with closed loops after a step; null if loops do not close nearby.
  after(here, move) {
    const { driven, free, robot } = this.kinematics, z = here.z.slice();
    driven.forEach((k, i) => (z[k] += move[i] * this.scales[i]));
    free.forEach((k, j) => {
      z[k] += robot.scales[k] * move.reduce((sum, m, i) => sum + here.follow[j][i] * m, 0);
    });
    if (free.length === 0) return z;
    const found = this.kinematics.closed(z);
    return found && this.kinematics.isNear(found, z) ? found : null;
  }

  // Whether the tool pose determines the coordinates up to the choice of a branch.
  isIsolated(z) {
    const T = this.kinematics.frames(z), goal = this.kinematics.toolPose(T);
    const rows = toolRows(this.kinematics, T, goal, { position: 1, turn: 1 });
    const J = this.jacobian({ z, T, rows }), entries = [...this.scales.keys()];
    const M = entries.map((i) => entries.map((j) => J.reduce((sum, row) => sum + row[i] * row[j], 0)));
    return smallestPivot(M) > NOT_ISOLATED ** 2;
  }

  // Other configurations with the same tool pose: a generator that yields after each start.
  *others(z, seed = 1) {
    const goal = this.kinematics.toolPose(this.kinematics.frames(z)), found = [z];
    if (!this.isIsolated(z)) return;
    const random = randomNumbers(seed);
    for (let k = 0; k < STARTS; k++) {
      const other = this.fromAnywhere(z, goal, random, k % 2 === 1);
      const isNew = other && found.every((own) => !this.areSame(own, other));
      if (isNew) found.push(other);
      yield isNew ? other : null;
    }
  }

  // A configuration with the tool at the goal, from a random start; null if the iteration fails. If
  // the tool is fixed, the joints that move the tool stay, and the others close the loops.
  fromAnywhere(z, goal, random, isHeld) {
    const { driven, free, robot, paths } = this.kinematics, start = z.slice();
    const carrying = paths[robot.tool.body].map((k) => robot.bodies[k].joint.coordinate);
    const drawn = [...driven, ...free].filter((k) => !(isHeld && carrying.includes(k)));
    for (const k of drawn) start[k] = this.anywhere(k, z[k], random());
    if (free.length === 0) return this.reaching(start, goal);
    const closed = this.kinematics.closed(start, isHeld ? drawn : free);
    return closed && this.reaching(closed, goal);
  }

  // A random value of a coordinate: in the slider range, or around the current value.
  anywhere(k, now, part) {
    const { driven, robot } = this.kinematics, i = driven.indexOf(k);
    if (i >= 0 && !this.turns(i)) {
      const { lower, upper, ratio } = robot.sliders[i];
      return ratio * (lower + part * (upper - lower));
    }
    return now + (part - 0.5) * (robot.scales[k] === 1 ? 2 * Math.PI : robot.scales[k] / 2);
  }

  reaching(start, goal) {
    const found = this.follow(start, goal, "position", false);
    return Math.max(found.position, found.turn) < SAME / 100 ? this.unwound(found.z) : null;
  }

  // Shifts driven joints by full turns into their limits, if possible.
  unwound(z) {
    const found = z.slice();
    this.kinematics.driven.forEach((k, i) => {
      if (!this.turns(i)) return;
      const [low, high] = [this.lower[i], this.upper[i]];
      const middle = Number.isFinite(low + high) ? (low + high) / 2 : 0;
      found[k] -= 2 * Math.PI * Math.round((found[k] - middle) / (2 * Math.PI));
    });
    return found;
  }

  // Whether the driven coordinates are equal up to full turns, or all body poses are equal.
  areSame(one, other) {
    const { driven, robot } = this.kinematics;
    const apart = driven.map((k, i) => {
      const gap = Math.abs(one[k] - other[k]), turn = 2 * Math.PI;
      return this.turns(i) ? Math.min(gap % turn, turn - (gap % turn)) : gap / this.scales[i];
    });
    if (Math.max(...apart) < SAME) return true;
    const [T, U] = [one, other].map((z) => this.kinematics.frames(z));
    return T.every((pose, k) => pose.every((value, i) =>
      Math.abs(value - U[k][i]) < SAME * (i % 4 === 3 ? robot.size : 1)));
  }

  // Whether a full turn of a driven coordinate restores all body poses.
  turns(i) {
    const { unit, ratio } = this.kinematics.robot.sliders[i];
    return unit === "°" && Math.abs(ratio) === 1;
  }

  // "beyond" a limit, "near" one (a twentieth of the range), or "free", for each driven coordinate.
  nearness(z) {
    return this.kinematics.driven.map((k, i) => {
      const gap = Math.min(z[k] - this.lower[i], this.upper[i] - z[k]);
      if (gap < -1e-9 * this.scales[i]) return "beyond";
      const range = this.upper[i] - this.lower[i];
      return Number.isFinite(range) && gap < 0.05 * range ? "near" : "free";
    });
  }
}

// The ratio of smallest to largest pivot of a positive semidefinite matrix.
function smallestPivot(M) {
  const rows = M.map((row) => row.slice()), rest = new Set(M.keys()), pivots = [];
  while (rest.size) {
    const k = [...rest].reduce((a, b) => (rows[a][a] >= rows[b][b] ? a : b));
    rest.delete(k);
    pivots.push(rows[k][k]);
    if (!(rows[k][k] > 0)) return 0;
    for (const i of rest) {
      const factor = rows[i][k] / rows[k][k];
      for (const j of rest) rows[i][j] -= factor * rows[k][j];
    }
  }
  return Math.min(...pivots) / Math.max(...pivots);
}

// Reproducible random numbers between 0 and 1: the upper bits of a linear congruential generator
// modulo 2^32 (Knuth, The Art of Computer Programming 2, 3.3.4, line 26).
function randomNumbers(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(1664525, state) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
