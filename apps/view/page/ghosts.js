// Ghosts: other configurations with the same tool pose, in pale colors. They follow while the robot
// moves, and are searched again when the robot is at rest.
"use strict";

const MAX_GHOSTS = 16;
const MAX_WITH_LOOPS = 8; // maximum number of ghosts with loops; all take 2 ms per frame
const SEEN = 1e-7; // maximum tool error of a ghost [relative to the robot size, and rad], not visible
const REST = 250; // time at rest before a search [ms]
const SLICE = 6; // duration of a slice of the search [ms], so that the page stays responsive
const NEARNESS_COLOURS = { free: 0x0072b2, near: 0xf0e442, beyond: 0xd55e00 };

class Ghosts {
  // `drawn` is called when ghosts have changed.
  constructor(inverse, geometries, scene, drawn) {
    Object.assign(this, { inverse, geometries, scene, drawn, found: [], places: [] });
    this.most = inverse.kinematics.free.length ? MAX_WITH_LOOPS : MAX_GHOSTS;
    this.timer = null;
    this.isShown = true;
    this.isSeeking = false;
  }

  // Moves the ghosts with the tool to configuration z; ghosts that cannot follow are hidden.
  follow(z) {
    const { kinematics } = this.inverse, goal = kinematics.toolPose(kinematics.frames(z));
    if (this.isShown) {
      const results = this.found.map((own) => this.inverse.follow(own, goal, "position", false, SEEN));
      const isThere = results.map(({ position, turn }) => Math.max(position, turn) < SAME);
      this.found = this.found.map((own, i) => (isThere[i] ? results[i].z : own));
      this.show(this.found.filter((own, i) => isThere[i] && !this.inverse.areSame(own, z)));
    }
    clearTimeout(this.timer);
    this.isSeeking = this.isShown;
    if (!this.isShown) return;
    this.timer = setTimeout(() => this.seek(this.inverse.others(z.slice()), []), REST);
  }

  // Runs a slice of a search and schedules the next slice.
  seek(starts, found) {
    const end = performance.now() + SLICE;
    while (performance.now() < end) {
      const { value, done } = starts.next();
      if (value) found.push(value);
      if (done || found.length === this.most) {
        this.found = found;
        this.isSeeking = false;
        this.show(found);
        return;
      }
    }
    this.timer = setTimeout(() => this.seek(starts, found), 0);
  }

  setShown(isShown, z) {
    this.isShown = isShown;
    this.found = [];
    this.show([]);
    this.follow(z);
  }

  show(configurations) {
    while (this.places.length < configurations.length) this.places.push(this.place());
    this.places.forEach(({ group, bodies, material }, i) => {
      group.visible = i < configurations.length;
      if (!group.visible) return;
      const nearness = this.inverse.nearness(configurations[i]);
      const worst = ["beyond", "near", "free"].find((own) => nearness.includes(own)) || "free";
      material.color.setHex(NEARNESS_COLOURS[worst]);
      this.inverse.kinematics.poses(configurations[i]).forEach((T, k) => {
        bodies[k].matrix.set(...T);
        bodies[k].matrixWorldNeedsUpdate = true;
      });
    });
    this.drawn();
  }

  // A pale robot without the ground.
  place() {
    // Drawn behind bodies at the same position, and only once per position.
    const behind = { polygonOffset: true, polygonOffsetFactor: 4, polygonOffsetUnits: 4 };
    const once = { depthFunc: THREE.LessDepth };
    const pale = { transparent: true, opacity: 0.25 };
    const material = new THREE.MeshLambertMaterial({ ...pale, ...behind, ...once });
    const group = new THREE.Group();
    const bodies = this.geometries.map((parts, k) => {
      const body = new THREE.Group();
      body.matrixAutoUpdate = false;
      if (k > 0) parts.forEach((geometry) => body.add(new THREE.Mesh(geometry, material)));
      group.add(body);
      return body;
    });
    this.scene.add(group);
    return { group, bodies, material };
  }
}
