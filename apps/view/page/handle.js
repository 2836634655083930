// The draggable handle at the tool: arrows along its axes, squares in its planes, rings about its
// axes.
"use strict";

const HANDLE = 0.2; // length of an arrow relative to the robot size
const AXIS_COLOURS = [0xd55e00, 0x009e73, 0x0072b2];
const GRIP = 0.05; // radius of the invisible grips, in arrow lengths
const EDGE_ON = 0.08; // cosine between ray and plane normal below which a plane is viewed edge-on

class Handle {
  // `listener` is a listener with methods grabbed(), dragged(pose, first) and released().
  constructor(size, camera, canvas, listener) {
    Object.assign(this, { length: HANDLE * size, camera, canvas, listener, drag: null });
    this.group = new THREE.Group();
    this.group.matrixAutoUpdate = false;
    this.grips = [0, 1, 2].flatMap((k) => [this.arrow(k), this.square(k), this.ring(k)]);
    this.ray = new THREE.Raycaster();
    canvas.addEventListener("pointerdown", (event) => this.take(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.pull(event), { capture: true });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.letGo(event), { capture: true });
    }
  }

  // Moves the handle to a pose, 16 numbers in row order.
  place(pose) {
    this.pose = pose;
    this.group.matrix.set(...pose);
    this.group.matrixWorldNeedsUpdate = true;
  }

  arrow(k) {
    const { length } = this;
    const shaft = new THREE.CylinderGeometry(0.018 * length, 0.018 * length, 0.6 * length, 8);
    const head = new THREE.ConeGeometry(0.055 * length, 0.18 * length, 12);
    shaft.translate(0, 0.5 * length, 0);
    head.translate(0, 0.89 * length, 0);
    const grip = new THREE.CylinderGeometry(1.6 * GRIP * length, 1.6 * GRIP * length, 0.75 * length, 6);
    grip.translate(0, 0.62 * length, 0);
    return this.part(k, "arrow", [shaft, head], grip, [[0, 0, -1], [0, 0, 0], [1, 0, 0]][k]);
  }

  square(k) {
    const side = 0.16 * this.length, at = 0.3 * this.length;
    const geometry = new THREE.PlaneGeometry(side, side);
    geometry.translate(at, at, 0);
    return this.part(k, "square", [geometry], geometry.clone(), null);
  }

  ring(k) {
    const radius = 0.72 * this.length;
    const geometry = new THREE.TorusGeometry(radius, 0.012 * this.length, 6, 64);
    const grip = new THREE.TorusGeometry(radius, GRIP * this.length, 6, 48);
    return this.part(k, "ring", [geometry], grip, null);
  }

  // A part of the handle with an invisible, thicker grip. Arrow geometries are along y, square and
  // ring geometries are normal to z.
  part(k, kind, geometries, grip, quarter) {
    const turn = new THREE.Matrix4();
    if (kind === "arrow") {
      turn.makeRotationFromEuler(new THREE.Euler(...quarter.map((sign) => (sign * Math.PI) / 2)));
    } else {
      const [x, y, z] = [0, 1, 2].map((i) => new THREE.Vector3().setComponent((k + 1 + i) % 3, 1));
      turn.makeBasis(x, y, z);
    }
    const look = { color: AXIS_COLOURS[k], depthTest: false, transparent: true, side: THREE.DoubleSide };
    const material = new THREE.MeshBasicMaterial({ ...look, opacity: kind === "arrow" ? 0.95 : 0.6 });
    for (const geometry of geometries) {
      const mesh = new THREE.Mesh(geometry.applyMatrix4(turn), material);
      mesh.renderOrder = 10;
      this.group.add(mesh);
    }
    const held = new THREE.Mesh(grip.applyMatrix4(turn), new THREE.MeshBasicMaterial({ visible: false }));
    held.grip = { k, kind, material };
    this.group.add(held);
    return held;
  }

  aim(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - box.left)) / box.width - 1;
    const y = 1 - (2 * (event.clientY - box.top)) / box.height;
    this.ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
    return this.ray.ray;
  }

  // The part under the pointer; arrows take precedence over squares, squares over rings.
  gripAt(event) {
    this.aim(event);
    const order = ["arrow", "square", "ring"];
    const hits = this.ray.intersectObjects(this.grips, false).map((hit) => hit.object.grip);
    return hits.sort((a, b) => order.indexOf(a.kind) - order.indexOf(b.kind))[0] || null;
  }

  take(event) {
    const grip = event.button === 0 ? this.gripAt(event) : null;
    if (grip === null) return;
    event.stopImmediatePropagation();
    this.canvas.setPointerCapture(event.pointerId);
    const from = this.pose.slice();
    this.drag = { grip, from, start: this.along(grip, from, this.aim(event)) };
    this.listener.grabbed();
  }

  pull(event) {
    if (this.drag === null) {
      this.canvas.style.cursor = this.gripAt(event) ? "grab" : "";
      return;
    }
    event.stopImmediatePropagation();
    const { grip, from, start } = this.drag, now = this.along(grip, from, this.aim(event));
    if (start === null || now === null) return;
    this.place(grip.kind === "ring" ? turnedPose(from, grip.k, now[0] - start[0])
      : shiftedPose(from, minus(now, start)));
    this.listener.dragged(this.pose, grip.kind === "ring" ? "turn" : "position");
  }

  letGo(event) {
    if (this.drag === null) return;
    event.stopImmediatePropagation();
    this.drag = null;
    this.listener.released();
  }

  // The intersection of a ray with the line or plane of a grip: a point in tool axes, or the angle
  // about the axis; null without an intersection.
  along({ k, kind }, pose, ray) {
    const local = ray.clone().applyMatrix4(new THREE.Matrix4().set(...pose).invert());
    const o = local.origin.toArray(), d = local.direction.toArray();
    if (kind === "arrow") {
      // The point of the axis nearest to the ray.
      const across = 1 - d[k] * d[k];
      if (across < EDGE_ON ** 2) return null;
      const point = [0, 0, 0];
      point[k] = (o[k] - d[k] * dot(o, d)) / across;
      return point;
    }
    if (Math.abs(d[k]) < EDGE_ON) return null;
    const way = -o[k] / d[k];
    if (way < 0) return null;
    const point = o.map((value, i) => value + way * d[i]);
    if (kind === "square") return point;
    return [Math.atan2(point[(k + 2) % 3], point[(k + 1) % 3])];
  }
}

// A pose after a translation along its own axes.
function shiftedPose(T, shift) {
  const found = T.slice(), at = moved(T, shift);
  [3, 7, 11].forEach((i, k) => (found[i] = at[k]));
  return found;
}

// A pose after a rotation about one of its own axes.
function turnedPose(T, k, angle) {
  const axis = [0, 0, 0];
  axis[k] = 1;
  return product(T, motion({ kind: "revolute", axis, at: [0, 0, 0], advance: 0 }, angle));
}
