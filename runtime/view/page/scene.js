// The page: the robot's bodies in three.js, its sliders, and what both say to each other.
"use strict";

const robot = JSON.parse(document.getElementById("robot").textContent);
const kinematics = new Kinematics(robot);
const canvas = document.getElementById("canvas");
const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(40, 1, robot.size / 100, 100 * robot.size);
camera.up.set(0, 0, 1);

function decoded(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}

function surface(part) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(decoded(part.vertices, Float32Array), 3));
  geometry.setIndex(new THREE.BufferAttribute(decoded(part.faces, Uint16Array), 1));
  geometry.computeVertexNormals();
  const material = new THREE.MeshLambertMaterial({ color: part.colour, side: THREE.DoubleSide });
  return new THREE.Mesh(geometry, material);
}

const bodies = robot.bodies.map((body, k) => {
  const group = new THREE.Group();
  group.name = body.name;
  group.matrixAutoUpdate = false;
  robot.surfaces.filter((part) => part.body === k).forEach((part) => group.add(surface(part)));
  scene.add(group);
  return group;
});

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
  bodies.forEach((body) => box.expandByObject(body));
  const centre = box.getCenter(new THREE.Vector3());
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const half = (camera.fov * Math.PI) / 360;
  const across = Math.atan((Math.tan(half) * (window.innerWidth - panel())) / window.innerHeight);
  const away = radius / Math.sin(Math.min(half, across));
  camera.position.copy(centre).add(new THREE.Vector3(0.75, -1, 0.6).setLength(0.9 * away));
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.target.copy(centre);
  controls.addEventListener("change", draw);
  controls.update();
}

function draw() {
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
  // The panel covers the right side: the robot stands in the middle of the rest.
  const [width, height] = [window.innerWidth, window.innerHeight];
  camera.setViewOffset(width, height, panel() / 2, 0, width, height);
  camera.updateProjectionMatrix();
  draw();
}

function show() {
  kinematics.poses().forEach((T, k) => {
    bodies[k].matrix.set(...T);
    bodies[k].matrixWorldNeedsUpdate = true;
  });
  const { body, placement } = robot.tool;
  const tool = product(kinematics.poses()[body], placement);
  const where = [3, 7, 11].map((i) => (1000 * tool[i]).toFixed(1)).join(", ");
  document.getElementById("tool").textContent = `tool: ${where} mm`;
  draw();
  return tool;
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
    value.textContent = `${(q * slider.factor).toFixed(1)} ${slider.unit}`;
  });
}

function follow() {
  setCoordinates(inputs.map(({ input }) => Number(input.value)));
}

// Moves the robot; where a loop does not close, it stays at the last posture that does.
function setCoordinates(q) {
  const closes = kinematics.moveTo(q);
  document.getElementById("message").textContent = closes ? "" : "A loop does not close further on.";
  write();
  show();
  return closes;
}

document.getElementById("home").addEventListener("click", () => {
  kinematics.z = robot.z.slice();
  document.getElementById("message").textContent = "";
  write();
  show();
});

lightAndGround();
write();
show();
look();
fit();
window.addEventListener("resize", fit);
