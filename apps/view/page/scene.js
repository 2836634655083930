// The page: the robot's bodies in three.js and its sliders, which update each other.
"use strict";

const THERE = 1e-4; // tool error that is reported [relative to the robot size, and rad]

const robot = JSON.parse(document.getElementById("robot").textContent);
const DIGITS = Math.max(1, Math.ceil(-Math.log10(robot.size))); // of millimeters
const kinematics = new Kinematics(robot);
const canvas = document.getElementById("canvas");
const renderer = rendererOn(canvas);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(40, 1, robot.size / 100, 100 * robot.size);
camera.up.set(0, 0, 1);
const inverse = new Inverse(kinematics);
const handle = new Handle(robot.size, camera, canvas, {
  grabbed: () => (controls.enabled = false),
  dragged: dragTo,
  released: () => {
    controls.enabled = true;
    say("");
    show();
  },
});

function rendererOn(canvas) {
  try {
    return new THREE.WebGLRenderer({ canvas, antialias: true });
  } catch (error) {
    say("The robot is not drawn: this browser has no WebGL, or has it switched off.");
    throw error;
  }
}

function decoded(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}

function geometryOf(part) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(decoded(part.vertices, Float32Array), 3));
  geometry.setIndex(new THREE.BufferAttribute(decoded(part.faces, Uint16Array), 1));
  geometry.computeVertexNormals();
  return geometry;
}

const geometries = robot.bodies.map(() => []);
const symbols = robot.sliders.map(() => []); // materials of the joint of each coordinate
const bodies = robot.bodies.map((body) => {
  const group = new THREE.Group();
  group.name = body.name;
  group.matrixAutoUpdate = false;
  scene.add(group);
  return group;
});
for (const part of robot.surfaces) {
  const geometry = geometryOf(part);
  const material = new THREE.MeshLambertMaterial({ color: part.colour, side: THREE.DoubleSide });
  geometries[part.body].push(geometry);
  bodies[part.body].add(new THREE.Mesh(geometry, material));
  if (part.moves !== null) symbols[part.moves].push(material);
}

const ghosts = new Ghosts(inverse, geometries, scene, draw);

function lightAndGround() {
  scene.background = new THREE.Color(0xffffff);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8c8c8c, 0.75));
  const sun = new THREE.DirectionalLight(0xffffff, 0.45);
  sun.position.set(1, -2, 3);
  scene.add(sun);
  const grid = new THREE.GridHelper(2 * robot.size, 20, 0x999999, 0xdddddd);
  grid.rotation.x = Math.PI / 2;
  grid.position.z = -robot.size / 500; // below plates on the ground
  scene.add(grid);
}

function look() {
  const box = new THREE.Box3().setFromObject(bodies[0]);
  [...bodies, handle.group].forEach((part) => box.expandByObject(part));
  const center = box.getCenter(new THREE.Vector3());
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const half = (camera.fov * Math.PI) / 360;
  const across = Math.atan((Math.tan(half) * (window.innerWidth - panel())) / window.innerHeight);
  const away = radius / Math.sin(Math.min(half, across));
  camera.position.copy(center).add(new THREE.Vector3(0.75, -1, 0.6).setLength(0.9 * away));
  controls = new THREE.OrbitControls(camera, canvas);
  controls.target.copy(center);
  controls.addEventListener("change", draw);
  controls.update();
}

let isDue = false;
let controls = null;

// Requests one redraw at the next frame; repeated calls have no effect.
function draw() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(render);
}

function render() {
  isDue = false;
  renderer.render(scene, camera);
}

// The width that the panel covers [pixels].
function panel() {
  return window.innerWidth > 640 ? 290 : 0;
}

function fit() {
  renderer.setPixelRatio(window.devicePixelRatio);
  renderer.setSize(window.innerWidth, window.innerHeight, false);
  camera.aspect = window.innerWidth / window.innerHeight;
  // The panel covers the right side; the robot is centered in the rest.
  const [width, height] = [window.innerWidth, window.innerHeight];
  camera.setViewOffset(width, height, panel() / 2, 0, width, height);
  camera.updateProjectionMatrix();
  draw();
}

function show() {
  const T = kinematics.poses();
  T.forEach((pose, k) => {
    bodies[k].matrix.set(...pose);
    bodies[k].matrixWorldNeedsUpdate = true;
  });
  inverse.nearness(kinematics.z).forEach((nearness, i) => {
    symbols[i].forEach((material) => material.color.setHex(NEARNESS_COLOURS[nearness]));
  });
  const tool = kinematics.toolPose(T);
  const where = [3, 7, 11].map((i) => (1000 * tool[i]).toFixed(DIGITS)).join(", ");
  document.getElementById("tool").textContent = `tool: ${where} mm`;
  if (handle.drag === null) handle.place(tool);
  ghosts.follow(kinematics.z);
  scene.updateMatrixWorld();
  draw();
}

const inputs = robot.sliders.map((slider) => {
  const label = document.createElement("label");
  const input = document.createElement("input");
  const [name, value] = [document.createElement("span"), document.createElement("output")];
  name.append(slider.name, value);
  Object.assign(input, { type: "range", step: "any", name: slider.name });
  Object.assign(input, { min: slider.lower, max: slider.upper });
  input.setAttribute("aria-label", slider.name);
  input.addEventListener("input", follow);
  label.append(name, input);
  document.getElementById("sliders").append(label);
  return { input, value, slider };
});

function coordinates() {
  return kinematics.driven.map((k, i) => kinematics.z[k] / robot.sliders[i].ratio);
}

function write() {
  coordinates().forEach((q, i) => {
    const { input, value, slider } = inputs[i];
    input.value = q;
    value.textContent = `${(q * slider.factor).toFixed(slider.unit === "mm" ? DIGITS : 1)} ${slider.unit}`;
  });
}

function follow() {
  setCoordinates(inputs.map(({ input }) => Number(input.value)));
}

// Moves the robot; if a loop does not close, it stays at the last closed configuration.
function setCoordinates(q) {
  const closes = kinematics.moveTo(q);
  say(closes ? "" : "A loop does not close beyond this configuration.");
  write();
  show();
  return closes;
}

// Moves the tool to a pose, 16 numbers in row order; `first` is the dragged part, "position" or "turn".
function dragTo(pose, first) {
  const { z, position, turn } = inverse.follow(kinematics.z, pose, first);
  kinematics.z = z;
  const [mm, degrees] = [1000 * robot.size * position, (180 / Math.PI) * turn];
  const isThere = position < THERE && turn < THERE;
  say(isThere ? "" : `The pose is out of reach: errors ${mm.toFixed(1)} mm and ${degrees.toFixed(1)}°.`);
  write();
  show();
  return { position, turn };
}

function say(message) {
  document.getElementById("message").textContent = message;
}

document.getElementById("home").addEventListener("click", () => {
  kinematics.z = robot.z.slice();
  say("");
  write();
  show();
});
document.getElementById("ghosts").addEventListener("change", (event) => {
  ghosts.setShown(event.target.checked, kinematics.z);
});

scene.add(handle.group);
lightAndGround();
write();
show();
look();
fit();
window.addEventListener("resize", fit);
