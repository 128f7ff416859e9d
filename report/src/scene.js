// The 3D view: terrain, blocks, structures, trajectories, impact forces. Shows one instant; who drives the time is main.js.
import {
  AmbientLight, ArrowHelper, BatchedMesh, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, HemisphereLight, LineBasicMaterial, LineSegments,
  Matrix4, Mesh, MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, Points, PointsMaterial, Quaternion, Raycaster, Scene, Vector2, Vector3, WebGLRenderer, Sphere, Box3,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { array, before, blocks, frames, impacts, meta, nb, nf, origin, pose, structures, ground } from "./data.js";
import { color, palette } from "./colors.js";

const region = meta.region || [-10, -10, -10, 10, 10, 10];
const low = new Vector3(region[0], region[1], region[2]), high = new Vector3(region[3], region[4], region[5]);
export const extent = Math.max(high.x - low.x, high.y - low.y, high.z - low.z) || 4;
const middle = low.clone().add(high).multiplyScalar(0.5);

export const view = { field: "damage", exaggeration: 1, trajectories: true, follow: -1, fastest: 1 };
let renderer, scene, camera, controls, sun, dirty = true, batch, markers, lines, software = false, shownTime = NaN;
const bodies = [];      // structures
const edges = [];       // outlines of blocks
const arrows = [];
let selected = { kind: "", index: -1 };

const rock = (b) => {
  // A few blocks get telling colours; many get the tones of rock.
  const c = new Color();
  if (nb <= 9) return c.set(palette[b % palette.length]).lerp(new Color("#8d8578"), 0.12);
  const h = Math.sin(b * 12.9898) * 43758.5453, f = h - Math.floor(h);
  return c.setHSL(0.07 + 0.03 * f, 0.22 + 0.18 * f, 0.44 + 0.2 * f);
};

function terrainMaterial() {
  const material = new MeshStandardMaterial({ color: 0xffffff, roughness: 0.97, metalness: 0, side: DoubleSide });
  const drop = Math.max(high.z - low.z, 1);
  const interval = [0.5, 1, 2, 5, 10, 20, 50, 100].find((i) => drop / i < 16) || 200;
  // Ground by slope, and contour lines at heights above sea, not above the local origin.
  material.onBeforeCompile = (shader) => {
    shader.uniforms.interval = { value: interval };
    shader.uniforms.base = { value: ((origin[2] % (interval * 5)) + interval * 5) % (interval * 5) };
    shader.vertexShader = shader.vertexShader.replace("#include <common>", "#include <common>\nvarying vec3 ground; varying vec3 up;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nground = position; up = normal;");
    shader.fragmentShader = shader.fragmentShader.replace("#include <common>", "#include <common>\nvarying vec3 ground; varying vec3 up; uniform float interval; uniform float base;\nfloat speck(vec2 p) { return fract(sin(dot(p, vec2(127.1, 311.7))) * 43758.5453); }\nfloat soft(vec2 p) { vec2 i = floor(p), f = fract(p); f = f * f * (3. - 2. * f); return mix(mix(speck(i), speck(i + vec2(1, 0)), f.x), mix(speck(i + vec2(0, 1)), speck(i + vec2(1, 1)), f.x), f.y); }")
      .replace("#include <color_fragment>", `#include <color_fragment>
        float steep = 1. - abs(normalize(up).z);
        float n = .6 * soft(ground.xy * .11) + .4 * soft(ground.xy * .61);
        vec3 grass = mix(vec3(.42, .47, .31), vec3(.55, .55, .39), n), scree = mix(vec3(.56, .53, .47), vec3(.66, .63, .57), n), cliff = mix(vec3(.43, .41, .39), vec3(.52, .49, .46), n);
        vec3 tone = mix(grass, scree, smoothstep(.06, .2, steep + .05 * (n - .5)));
        tone = mix(tone, cliff, smoothstep(.22, .45, steep));
        float z = (ground.z + base) / interval, w = fwidth(z);
        float line = 1. - smoothstep(w * .5, w * 1.4, abs(fract(z - .5) - .5));
        float z5 = z / 5., w5 = fwidth(z5);
        float major = 1. - smoothstep(w5 * .7, w5 * 1.8, abs(fract(z5 - .5) - .5));
        float fade = 1. - smoothstep(.15, .5, w);
        fade *= smoothstep(1e-5, 4e-5, w);   // level ground at the height of a contour would be all line, or noise
        major *= smoothstep(1e-5, 4e-5, w);
        tone *= 1. - .17 * line * fade - .16 * major * (1. - smoothstep(.15, .5, w5));
        diffuseColor.rgb = tone * tone;`);
  };
  return material;
}

function addTerrain() {
  const vertices = array("terrain_vertices"), triangles = array("terrain_triangles");
  const material = terrainMaterial();
  const put = (v, t) => {
    const g = new BufferGeometry();
    g.setAttribute("position", new BufferAttribute(v, 3));
    g.setIndex(new BufferAttribute(t, 1));
    g.computeVertexNormals();
    const mesh = new Mesh(g, material);
    mesh.receiveShadow = true;
    scene.add(mesh);
    return mesh;
  };
  if (triangles.length) put(vertices, triangles);
  for (const [px, py, pz, nx, ny, nz] of meta.planes || []) {
    // A square of the unbounded plane, around what happened.
    const n = new Vector3(nx, ny, nz), u = Math.abs(nz) > 0.999 ? new Vector3(1, 0, 0) : new Vector3(-ny, nx, 0).normalize(), w = n.clone().cross(u);
    const p = new Vector3(px, py, pz), c = middle.clone().sub(n.clone().multiplyScalar(n.dot(middle.clone().sub(p)))), r = 1.1 * extent, k = 24;
    const v = new Float32Array((k + 1) * (k + 1) * 3), t = new Uint32Array(k * k * 6);
    for (let j = 0, a = 0; j <= k; j++) for (let i = 0; i <= k; i++) {
      const q = c.clone().addScaledVector(u, r * (2 * i / k - 1)).addScaledVector(w, r * (2 * j / k - 1));
      v[a++] = q.x; v[a++] = q.y; v[a++] = q.z;
    }
    for (let j = 0, a = 0; j < k; j++) for (let i = 0; i < k; i++) {
      const m = j * (k + 1) + i;
      t.set([m, m + 1, m + k + 2, m, m + k + 2, m + k + 1], a);
      a += 6;
    }
    put(v, t);
  }
}

function addBlocks() {
  const v = array("block_vertices"), t = array("block_triangles"), vo = array("block_vertex_offset"), to = array("block_triangle_offset");
  if (!nb || !t.length) return;
  // Triangles of their own, so that every face is flat.
  batch = new BatchedMesh(nb, t.length, 0, new MeshStandardMaterial({ roughness: 0.82, metalness: 0, flatShading: true, color: 0xffffff }));
  batch.castShadow = batch.receiveShadow = true;
  batch.frustumCulled = false;
  batch.perObjectFrustumCulled = nb > 300;
  batch.sortObjects = false;
  for (let b = 0; b < nb; b++) {
    const n = to[b + 1] - to[b], x = new Float32Array(9 * Math.max(n, 1)), normal = new Float32Array(x.length);
    for (let k = 0; k < 3 * n; k++) { const i = t[3 * to[b] + k] * 3; x[3 * k] = v[i]; x[3 * k + 1] = v[i + 1]; x[3 * k + 2] = v[i + 2]; }
    const g = new BufferGeometry();
    g.setAttribute("position", new BufferAttribute(x, 3));
    g.setAttribute("normal", new BufferAttribute(normal, 3));
    g.computeVertexNormals();
    const id = batch.addGeometry(g);
    batch.addInstance(id);
    batch.setColorAt(b, rock(b));
    if (nb <= 150) edges.push(outline(v, t, to[b], to[b + 1], b));
    g.dispose();
  }
  scene.add(batch);
  for (const e of edges) scene.add(e);

  // A dot of constant size, so that a boulder of two metres is seen on a slope of a kilometre.
  const g = new BufferGeometry(), c = new Float32Array(3 * nb);
  for (let b = 0; b < nb; b++) rock(b).toArray(c, 3 * b);
  g.setAttribute("position", new BufferAttribute(new Float32Array(3 * nb), 3));
  g.setAttribute("color", new BufferAttribute(c, 3));
  g.boundingSphere = new Sphere(new Vector3(), 1e9);
  markers = new Points(g, new PointsMaterial({ size: nb > 200 ? 2.5 : 7, sizeAttenuation: false, vertexColors: true, depthTest: true, transparent: true, opacity: 0.95 }));
  markers.material.onBeforeCompile = (s) => {
    s.fragmentShader = s.fragmentShader.replace("#include <clipping_planes_fragment>", "#include <clipping_planes_fragment>\nif (length(gl_PointCoord - .5) > .5) discard;");
  };
  scene.add(markers);
}

// Edges between faces that are not coplanar.
function outline(v, t, first, last, b) {
  const faces = new Map(), p = (i) => new Vector3(v[3 * i], v[3 * i + 1], v[3 * i + 2]), out = [];
  for (let k = first; k < last; k++) {
    const id = [t[3 * k], t[3 * k + 1], t[3 * k + 2]], n = p(id[1]).sub(p(id[0])).cross(p(id[2]).sub(p(id[0]))).normalize();
    for (let e = 0; e < 3; e++) {
      const a = id[e], c = id[(e + 1) % 3], key = a < c ? a * 1e7 + c : c * 1e7 + a;
      if (!faces.has(key)) faces.set(key, n);
      else if (faces.get(key).dot(n) < 0.9995) out.push(...p(a).toArray(), ...p(c).toArray());
    }
  }
  const g = new BufferGeometry();
  g.setAttribute("position", new BufferAttribute(new Float32Array(out), 3));
  const line = new LineSegments(g, new LineBasicMaterial({ color: 0x15181c, transparent: true, opacity: 0.55 }));
  line.matrixAutoUpdate = false;
  line.frustumCulled = false;
  line.userData.block = b;
  return line;
}

function addTrajectories() {
  view.fastest = frames.speed.reduce((a, s) => (s > a ? s : a), 1e-9);
  // The blocks that went farthest, if there are too many to show.
  const chosen = [...Array(nb).keys()].filter((b) => (blocks[b].path_length || 0) > 0.02 * extent).sort((a, b) => blocks[b].path_length - blocks[a].path_length).slice(0, 150);
  const step = Math.max(1, Math.ceil((nf * chosen.length) / 24000)), points = [], tones = [], c = [0, 0, 0];
  for (const b of chosen) {
    let last = -1;
    for (let k = 0; k < nf; k = k + step < nf || k === nf - 1 ? k + step : nf - 1) {
      const i = (k * nb + b) * 3;
      if (!(frames.position[i] === frames.position[i])) continue;
      if (last >= 0) {
        const j = (last * nb + b) * 3, d = Math.hypot(frames.position[i] - frames.position[j], frames.position[i + 1] - frames.position[j + 1], frames.position[i + 2] - frames.position[j + 2]);
        if (d < 1e-4 * extent && k !== nf - 1) continue;
        points.push(frames.position[j], frames.position[j + 1], frames.position[j + 2], frames.position[i], frames.position[i + 1], frames.position[i + 2]);
        for (const m of [last, k]) { const s = color("speed", frames.speed[m * nb + b] / view.fastest, c); tones.push(s[0] ** 2.2, s[1] ** 2.2, s[2] ** 2.2); }
      }
      last = k;
    }
  }
  if (!points.length) return;
  const opacity = chosen.length > 30 ? 0.6 : 0.95;
  if (software) {   // lines of one pixel: wide ones are quads of their own, which took three quarters of a picture of the rock mass
    const g = new BufferGeometry();
    g.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    g.setAttribute("color", new BufferAttribute(new Float32Array(tones), 3));
    lines = new LineSegments(g, new LineBasicMaterial({ vertexColors: true, transparent: true, opacity }));
  } else {
    const g = new LineSegmentsGeometry();
    g.setPositions(points);
    g.setColors(tones);
    lines = new LineSegments2(g, new LineMaterial({ linewidth: chosen.length > 30 ? 1.3 : 2.6, vertexColors: true, transparent: true, opacity }));
  }
  lines.frustumCulled = false;
  scene.add(lines);
}

function addStructures() {
  structures.forEach((s, index) => {
    const group = new Group(), epochs = s.epochs.map((key) => {
      const nodes = array(`${key}_nodes`), quads = array(`${key}_quads`), n = quads.length / 4;
      const g = new BufferGeometry(), order = new Uint32Array(6 * n);
      for (let q = 0; q < n; q++) order.set([4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3], 6 * q);
      g.setAttribute("position", new BufferAttribute(new Float32Array(12 * n), 3));
      g.setAttribute("normal", new BufferAttribute(new Float32Array(12 * n), 3));
      g.setAttribute("color", new BufferAttribute(new Float32Array(12 * n), 3));
      g.setIndex(new BufferAttribute(order, 1));
      const mesh = new Mesh(g, new MeshStandardMaterial({ vertexColors: true, roughness: 0.85, metalness: 0, flatShading: true }));
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.frustumCulled = false;
      mesh.userData.structure = index;
      const wire = new BufferGeometry(), pairs = new Uint32Array(8 * n);
      for (let q = 0; q < n; q++) pairs.set([4 * q, 4 * q + 1, 4 * q + 1, 4 * q + 2, 4 * q + 2, 4 * q + 3, 4 * q + 3, 4 * q], 8 * q);
      wire.setAttribute("position", g.getAttribute("position"));
      wire.setIndex(new BufferAttribute(pairs, 1));
      const net = new LineSegments(wire, new LineBasicMaterial({ color: 0x101418, transparent: true, opacity: n > 8000 ? 0.1 : 0.2 }));
      net.frustumCulled = false;
      mesh.add(net);
      mesh.visible = false;
      group.add(mesh);
      return { mesh, nodes, quads };
    });
    scene.add(group);
    const times = Float64Array.from(s.frames, (f) => f.time);
    bodies.push({ s, epochs, times, state: "", bars: s.bars ? addBars(s.bars) : null });
  });
}

// Reinforcement as lines, shown with the field "bars" through a concrete of glass.
function addBars(bars) {
  const segments = array(`${bars.key}_segments`), g = new BufferGeometry();
  g.setAttribute("position", new BufferAttribute(new Float32Array(3 * segments.length), 3));
  g.setAttribute("color", new BufferAttribute(new Float32Array(3 * segments.length), 3));
  const net = new LineSegments(g, new LineBasicMaterial({ vertexColors: true }));
  net.frustumCulled = false;
  net.visible = false;
  scene.add(net);
  return { bars, net, segments, nodes: array(`${bars.key}_nodes`), times: Float64Array.from(bars.frames, (f) => f.time), state: "" };
}

function showBars({ bars, net, segments, nodes, times }, t, on) {
  net.visible = on && times.length > 0;
  if (!net.visible) return;
  const f = bars.frames[before(times, t)], moved = array(`${f.data}_displacement`), strain = array(`${f.data}_strain`), scale = bars.unit * view.exaggeration;
  const x = net.geometry.getAttribute("position").array, tone = net.geometry.getAttribute("color").array, c = [0, 0, 0];
  for (let k = 0; k < segments.length; k++) {
    const i = 3 * segments[k];
    color("speed", strain[k >> 1] / 65535, c);
    for (let d = 0; d < 3; d++) { x[3 * k + d] = nodes[i + d] + scale * moved[i + d]; tone[3 * k + d] = c[d] ** 2.2; }
  }
  net.geometry.getAttribute("position").needsUpdate = net.geometry.getAttribute("color").needsUpdate = true;
}

export function structureBox(index) {
  const box = new Box3(), nodes = bodies[index] && bodies[index].epochs.length ? bodies[index].epochs[0].nodes : [];
  for (let i = 0; i < nodes.length; i += 3) box.expandByPoint(new Vector3(nodes[i], nodes[i + 1], nodes[i + 2]));
  return box;
}

// Where one looks for a structure: its middle and the upper corners, a little inside.
function pointsOf(box) {
  if (box.isEmpty()) return [];
  const c = box.getCenter(new Vector3()), h = box.getSize(new Vector3()).multiplyScalar(0.45);
  return [c, ...[-1, 1].flatMap((i) => [-1, 1].map((j) => new Vector3(c.x + i * h.x, c.y + j * h.y, c.z + h.z)))];
}
// Within what the view is made for, not in the fall of a block that left the model.
const inView = (p, i) => p[i] >= low.x - 1 && p[i] <= high.x + 1 && p[i + 1] >= low.y - 1 && p[i + 1] <= high.y + 1 && p[i + 2] >= low.z - 1 && p[i + 2] <= high.z + 1;

// Shape and colours of a structure at t; displacements linear between stored frames, cell values of the frame before.
function showStructure(body, t) {
  if (!body.times.length) return;
  const k = before(body.times, t), f = body.s.frames[k], next = body.s.frames[Math.min(k + 1, body.times.length - 1)];
  const same = next.epoch === f.epoch, gap = next.time - f.time, s = same && gap > 0 ? Math.min(Math.max((t - f.time) / gap, 0), 1) : 0;
  const state = [f.data, next.data, f.data === next.data ? 0 : s.toFixed(3), view.field, view.exaggeration].join();
  if (state === body.state) return;
  body.state = state;
  body.epochs.forEach((e, i) => {
    e.mesh.visible = i === f.epoch;
    const glass = view.field === "bars", m = e.mesh.material;
    if (m.transparent !== glass) { m.transparent = glass; m.opacity = glass ? 0.18 : 1; m.depthWrite = !glass; m.needsUpdate = true; }
  });
  if (body.bars) showBars(body.bars, t, view.field === "bars");
  const e = body.epochs[f.epoch], g = e.mesh.geometry, x = g.getAttribute("position").array, tone = g.getAttribute("color").array;
  const a = array(`${f.data}_displacement`), b = same ? array(`${next.data}_displacement`) : a, unit = body.s.displacement_max / 32767, scale = unit * view.exaggeration;
  const cells = view.field === "damage" ? array(`${f.data}_damage`) : view.field === "stress" ? array(`${f.data}_stress`) : view.field === "crack" ? array(`${f.data}_crack`) : null;
  const top = view.field === "damage" ? 255 : 65535, map = view.field === "damage" ? "damage" : view.field === "stress" || view.field === "crack" ? "load" : "displacement";
  const largest = body.s.displacement_max || 1, c = [0, 0, 0];
  for (let q = 0, n = e.quads.length; q < n; q++) {
    const i = 3 * e.quads[q];
    let size = 0;
    for (let d = 0; d < 3; d++) {
      const u = a.length ? a[i + d] + s * (b[i + d] - a[i + d]) : 0;
      x[3 * q + d] = e.nodes[i + d] + scale * u;
      size += u * u;
    }
    if (view.field === "displacement") color(map, Math.sqrt(size) * unit / largest, c);
    else if (!cells || !cells.length) { c[0] = 0.72; c[1] = 0.7; c[2] = 0.66; }
    else color(map, cells[q >> 2] / top, c);
    for (let d = 0; d < 3; d++) tone[3 * q + d] = c[d] ** 2.2;
  }
  g.getAttribute("position").needsUpdate = true;
  g.getAttribute("color").needsUpdate = true;
  g.boundingSphere = g.boundingBox = null;
}

function addArrows() {
  const fragment = new Set(blocks.filter((b) => b.fragment).map((b) => b.name));
  for (const m of impacts) {
    if (fragment.has(m.block)) continue;   // what breaks off presses on all sides of where it was
    const d = new Vector3(...m.impulse), p = new Vector3(m.point[0] - origin[0], m.point[1] - origin[1], m.point[2] - origin[2]);
    if (d.length() === 0) continue;
    const box = bodies.length ? structureBox(0).getSize(new Vector3()).length() : extent * 0.1, length = Math.max(0.35 * box, 1e-3);
    const a = new ArrowHelper(d.clone().normalize(), p.clone().addScaledVector(d.clone().normalize(), -length), length, 0xe0342b, 0.24 * length, 0.13 * length);
    a.line.material.depthTest = a.cone.material.depthTest = false;
    a.renderOrder = 5;
    a.visible = false;
    scene.add(a);
    arrows.push({ a, start: m.start, end: m.end });
  }
}

export const arrowCount = () => arrows.length;

const p = { position: [0, 0, 0], q: [1, 0, 0, 0], speed: 0, kinetic: 0 };
const matrix = new Matrix4(), quaternion = new Quaternion(), place = new Vector3(), one = new Vector3(1, 1, 1), gone = new Matrix4().makeScale(0, 0, 0), followed = new Vector3();
let following = false;

export function show(t) {
  if (!renderer || (t === shownTime && !dirty)) return;
  shownTime = t;
  const dots = markers ? markers.geometry.getAttribute("position") : null;
  for (let b = 0; batch && b < nb; b++) {
    const there = pose(b, t, p);
    if (there) {
      place.set(...p.position);
      matrix.compose(place, quaternion.set(p.q[1], p.q[2], p.q[3], p.q[0]), one);
      batch.setMatrixAt(b, matrix);
      dots.setXYZ(b, place.x, place.y, place.z);
      if (edges[b]) { edges[b].matrix.copy(matrix); edges[b].matrixWorldNeedsUpdate = true; edges[b].visible = true; }
      if (b === view.follow) {
        // The camera keeps its offset from the block.
        if (following) { const d = place.clone().sub(followed); camera.position.add(d); controls.target.add(d); }
        followed.copy(place);
        following = true;
      }
    } else {
      batch.setMatrixAt(b, gone);
      dots.setXYZ(b, 1e8, 1e8, 1e8);
      if (edges[b]) edges[b].visible = false;
    }
  }
  if (dots) dots.needsUpdate = true;
  for (const body of bodies) showStructure(body, t);
  for (const { a, start, end } of arrows) a.visible = t >= start && t <= end + 0.25;
  renderer.shadowMap.needsUpdate = true;
  dirty = true;
}

let glide = null;
function fly(position, target, quick) {
  view.follow = -1;
  following = false;
  if (quick) { camera.position.copy(position); controls.target.copy(target); controls.update(); dirty = true; return; }
  glide = { from: camera.position.clone(), to: position, a: controls.target.clone(), b: target, start: performance.now() };
}

// Where the blocks come from, seen from where they go: the overview looks up the slope from its side.
const travel = (() => {
  let x = 0, y = 0;
  blocks.forEach((b) => { if (b.end && b.start && !b.fixed) { x += b.end[0] - b.start[0]; y += b.end[1] - b.start[1]; } });
  const n = Math.hypot(x, y);
  return n > 1e-3 * extent ? new Vector3(x / n, y / n, 0) : new Vector3(1, 0, 0);
})();

// Height of the drawn terrain, which reaches farther than the map, on a grid of its nodes; made when first asked for.
const land = { n: 200, z: null };
function landHeight(x, y) {
  const v = array("terrain_vertices"), t = array("terrain_triangles"), n = land.n;
  if (!t.length) return ground(x, y);
  if (!land.z) {
    land.box = new Box3().setFromArray(v);
    land.z = new Float32Array(n * n).fill(NaN);
    const { min, max } = land.box, dx = (max.x - min.x) / (n - 1), dy = (max.y - min.y) / (n - 1);
    Object.assign(land, { dx, dy });
    for (let k = 0; k < t.length; k += 3) {
      const [a, b, c] = [3 * t[k], 3 * t[k + 1], 3 * t[k + 2]], area = (v[b] - v[a]) * (v[c + 1] - v[a + 1]) - (v[c] - v[a]) * (v[b + 1] - v[a + 1]);
      if (!area) continue;
      const span = (o, d, low) => [Math.max(0, Math.ceil((Math.min(v[a + o], v[b + o], v[c + o]) - low) / d)), Math.min(n - 1, Math.floor((Math.max(v[a + o], v[b + o], v[c + o]) - low) / d))];
      const [i0, i1] = span(0, dx, min.x), [j0, j1] = span(1, dy, min.y);
      for (let j = j0; j <= j1; j++)
        for (let i = i0; i <= i1; i++) {
          const p = min.x + i * dx, q = min.y + j * dy;
          const u = ((v[b] - p) * (v[c + 1] - q) - (v[c] - p) * (v[b + 1] - q)) / area, w = ((v[c] - p) * (v[a + 1] - q) - (v[a] - p) * (v[c + 1] - q)) / area;
          if (u < 0 || w < 0 || u + w > 1) continue;
          const z = u * v[a + 2] + w * v[b + 2] + (1 - u - w) * v[c + 2];
          if (!(land.z[j * n + i] >= z)) land.z[j * n + i] = z;
        }
    }
  }
  const i = Math.round((x - land.box.min.x) / land.dx), j = Math.round((y - land.box.min.y) / land.dy);
  return i < 0 || j < 0 || i >= n || j >= n ? NaN : land.z[j * n + i];
}

// True if the ground does not hide b from a, but for what b itself stands in.
function clear(a, b) {
  const q = new Vector3();
  for (let s = 0; s < 0.95; s += 0.01) {
    q.lerpVectors(a, b, s);
    if (landHeight(q.x, q.y) > q.z) return false;
  }
  return true;
}

// Of the places, in the order of preference, the first from which about as many of the points are seen as from any.
function lookout(places, points) {
  const seen = places.map((from) => points.filter((x) => clear(from, x)).length);
  return places[seen.findIndex((n) => n >= 0.85 * Math.max(...seen))];
}

// From where a sphere fills the view, looking against `direction`.
function stand(centre, radius, direction) {
  const half = (camera.fov * Math.PI) / 360, fit = Math.min(half, Math.atan(Math.tan(half) * camera.aspect));
  return centre.clone().addScaledVector(direction.clone().normalize(), (1.04 * radius) / Math.sin(fit));
}

export const cameras = {
  overview: (quick) => {
    const side = new Vector3(-travel.y, travel.x, 0), d = travel.clone().multiplyScalar(0.62).addScaledVector(side, -0.5).add(new Vector3(0, 0, 0.82));
    fly(stand(middle, high.clone().sub(low).length() / 2 || 1, d), middle, quick);
  },
  structure: (quick) => {
    if (!bodies.length) return;
    const hit = structures.findIndex((s) => impacts.some((m) => m.structure === s.name)), box = structureBox(Math.max(hit, 0)), c = box.getCenter(new Vector3()), r = box.getSize(new Vector3()).length();
    const side = new Vector3(-travel.y, travel.x, 0);
    // From the side that is hit; on steep ground from wherever the ground does not stand between.
    const ways = [[-0.55, -0.8, 0.42], [-0.55, 0.8, 0.42], [0.3, -0.9, 0.42], [0.3, 0.9, 0.42], [0.8, -0.4, 0.5], [0.8, 0.4, 0.5], [0.5, -0.5, 1.2], [0.5, 0.5, 1.2], [0.2, 0, 2.5]];
    const places = ways.map(([along, across, up]) => stand(c, 0.52 * r, travel.clone().multiplyScalar(along).addScaledVector(side, across).add(new Vector3(0, 0, up))));
    fly(lookout(places, pointsOf(box)), c, quick);
  },
  follow: (quick) => {
    const first = impacts.length ? blocks.findIndex((b) => b.name === impacts[0].block) : 0, b = selected.kind === "block" ? selected.index : Math.max(first, 0);
    if (!nb || !pose(b, shownTime || 0, p)) return;
    const c = new Vector3(...p.position), r = Math.max(7 * Math.cbrt(blocks[b].volume || 1), 0.02 * extent), side = new Vector3(-travel.y, travel.x, 0);
    camera.position.copy(c).addScaledVector(travel, 0.4 * r).addScaledVector(side, -1.5 * r).add(new Vector3(0, 0, 0.8 * r));
    controls.target.copy(c);
    controls.update();
    view.follow = b;
    followed.copy(c);
    following = true;
    glide = null;
    dirty = true;
  },
  top: (quick) => fly(stand(middle, Math.hypot(high.x - low.x, high.y - low.y) / 2, new Vector3(0, -0.002, 1)).add(new Vector3(0, 0, (high.z - low.z) / 2)), middle, quick),
  side: (quick) => {
    // As level as the ground allows, from either side.
    const places = [0.12, 0.4, 0.8, 1.4, 2.5].flatMap((up) => [1, -1].map((s) => stand(middle, high.clone().sub(low).length() / 2, new Vector3(s * travel.y, -s * travel.x, up))));
    const points = bodies.flatMap((body, i) => pointsOf(structureBox(i)));
    for (let b = 0; b < nb; b += Math.ceil(nb / 8))
      for (let k = 0; k < nf; k += Math.ceil(nf / 6)) { const i = 3 * (k * nb + b); if (inView(frames.position, i)) points.push(new Vector3(frames.position[i], frames.position[i + 1], frames.position[i + 2])); }
    fly(lookout(places, points), middle, quick);
  },
};

// How far what is seen at a point of the picture is, in [-1, 1]; 0: nothing is there. `ray` goes there afterwards.
function depthAt(x, y) {
  camera.updateMatrixWorld();
  ray.setFromCamera(new Vector2(x, y), camera);
  const bodiesHere = bodies.flatMap((b) => b.epochs.map((e) => e.mesh)).filter((m) => m.visible);
  if (batch) { batch.computeBoundingSphere(); bodiesHere.push(batch); }
  const hit = ray.intersectObjects(bodiesHere, false)[0], reach = camera.position.distanceTo(middle) + 2 * extent, n = 500, q = new Vector3();
  let best = hit ? hit.distance : Infinity;
  for (let k = 1; k <= n; k++) {
    const s = reach * (k / n) ** 2;
    if (s > best) break;
    ray.ray.at(s, q);
    if (landHeight(q.x, q.y) > q.z) best = s;
  }
  return isFinite(best) ? best : 0;
}

// The point that the view is turned about goes to the depth of what is seen there: the picture stays.
function lookInto(x, y) {
  const away = depthAt(x, y), forward = camera.getWorldDirection(new Vector3());
  if (away > 0) controls.target.copy(camera.position).addScaledVector(forward, away * forward.dot(ray.ray.direction));
}

// Towards or away from what is seen at a point of the picture, which stays where it is on the screen: distances times `nearer`. Not towards the point
// that the view is turned about: what lies before it would be passed through, and what lies behind never reached.
export function zoom(x, y, nearer) {
  const away = depthAt(x, y) || camera.position.distanceTo(controls.target), least = 2e-4 * extent, to = Math.max(away * nearer, Math.min(away, least));
  if (nearer > 1 && camera.position.distanceTo(middle) > controls.maxDistance) return;
  const forward = camera.getWorldDirection(new Vector3());
  camera.position.addScaledVector(ray.ray.direction, away - to);
  controls.target.copy(camera.position).addScaledVector(forward, to * forward.dot(ray.ray.direction));
  glide = null;
  controls.update();
  dirty = true;
}

export function distance(b, t) { return camera && pose(b, t, p) ? camera.position.distanceTo(new Vector3(...p.position)) : NaN; }

// By the keys: about the point that is looked at, across and up in radians; distances from what is in the middle times `nearer`.
export function turn(across, up, nearer) {
  if (nearer !== 1) return zoom(0, 0, nearer);
  const way = camera.position.clone().sub(controls.target), level = Math.hypot(way.x, way.y), length = way.length();
  const azimuth = Math.atan2(way.y, way.x) + across, height = Math.min(Math.max(Math.atan2(way.z, level) + up, -1.5), 1.5);
  camera.position.copy(controls.target).add(new Vector3(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height)).multiplyScalar(length));
  glide = null;
  controls.update();
  dirty = true;
}

export function select(kind, index) {
  if (batch && selected.kind === "block") batch.setColorAt(selected.index, rock(selected.index));
  selected = { kind, index };
  if (batch && kind === "block") batch.setColorAt(index, new Color("#ffd166"));
  dirty = true;
}

const ray = new Raycaster();
function pick(event, canvas) {
  const r = canvas.getBoundingClientRect();
  camera.updateMatrixWorld();
  ray.setFromCamera(new Vector2(((event.clientX - r.left) / r.width) * 2 - 1, 1 - ((event.clientY - r.top) / r.height) * 2), camera);
  const targets = bodies.flatMap((b) => b.epochs.map((e) => e.mesh)).filter((m) => m.visible);
  if (batch) { batch.computeBoundingSphere(); targets.push(batch); }
  const hit = ray.intersectObjects(targets, false)[0];
  if (hit) return hit.object === batch ? { kind: "block", index: hit.batchId } : { kind: "structure", index: hit.object.userData.structure };
  // Near misses count: a boulder far away is a few pixels wide.
  let best = 14, index = -1;
  for (let b = 0; b < nb; b++) {
    if (!pose(b, shownTime, p)) continue;
    const q = new Vector3(...p.position).project(camera);
    if (q.z > 1) continue;
    const d = Math.hypot(((q.x + 1) / 2) * r.width + r.left - event.clientX, ((1 - q.y) / 2) * r.height + r.top - event.clientY);
    if (d < best) { best = d; index = b; }
  }
  return index >= 0 ? { kind: "block", index } : null;
}

// Where a block is on the screen, for tests and labels: [x, y] in page pixels, or null.
export function onScreen(b, t) {
  if (!camera || !pose(b, t, p)) return null;
  camera.updateMatrixWorld();
  const r = renderer.domElement.getBoundingClientRect(), q = new Vector3(...p.position).project(camera);
  return q.z > 1 ? null : [((q.x + 1) / 2) * r.width + r.left, ((1 - q.y) / 2) * r.height + r.top];
}

export function picture() {
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL("image/png");
}

export function refresh() {
  for (const b of bodies) b.state = "";
  if (lines) lines.visible = view.trajectories;
  dirty = true;
  const t = shownTime;
  shownTime = NaN;
  show(t);
}

export function theme(dark) {
  if (!renderer) return;
  scene.getObjectByName("sky").intensity = dark ? 1.75 : 2.3;
  sun.intensity = dark ? 1.7 : 2.1;
  dirty = true;
}

// Whether the processor draws in place of a graphics card; every pixel costs there. Throws where there is no WebGL.
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) throw new Error("no WebGL 2");
  const names = gl.getExtension("WEBGL_debug_renderer_info"), name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

// Throws where there is no WebGL.
export function open(canvas, onPick, onIdleWheel) {
  software = drawnBySoftware();
  renderer = new WebGLRenderer({ canvas, antialias: !software, alpha: true, preserveDrawingBuffer: false });
  renderer.setPixelRatio(software ? 1 : Math.min(devicePixelRatio || 1, 2));
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.autoUpdate = false;   // the light stands still: only what moves changes the shadows
  renderer.shadowMap.type = PCFShadowMap;
  scene = new Scene();
  camera = new PerspectiveCamera(38, 1, extent * 1e-3, extent * 40);
  camera.up.set(0, 0, 1);
  controls = new OrbitControls(camera, canvas);
  controls.enableDamping = true;
  controls.dampingFactor = 0.12;
  controls.zoomToCursor = true;
  controls.maxDistance = extent * 12;
  controls.addEventListener("change", () => { dirty = true; });
  controls.addEventListener("start", () => { glide = null; });

  const sky = new HemisphereLight(0xdfe9f5, 0x8b8172, 1.1);
  sky.name = "sky";
  scene.add(sky, new AmbientLight(0xffffff, 0.12));
  // Light from the north-west, as on maps.
  sun = new DirectionalLight(0xfff3e2, 2.6);
  sun.position.copy(middle).add(new Vector3(-0.75, 0.75, 1.0).multiplyScalar(extent));
  sun.target.position.copy(middle);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  const s = sun.shadow.camera;
  s.left = s.bottom = -0.8 * extent;
  s.right = s.top = 0.8 * extent;
  s.near = 0.01 * extent;
  s.far = 4 * extent;
  sun.shadow.bias = -0.0004;
  sun.shadow.normalBias = 0.0006 * extent;
  scene.add(sun, sun.target);

  addTerrain();
  addBlocks();
  addStructures();
  addTrajectories();
  addArrows();

  // The wheel scrolls the page until the view is chosen by a click: a page that stops scrolling where the pointer happens to be is no page. Pinching a touchpad
  // comes as a wheel with ctrl.
  const at = (e) => { const r = canvas.getBoundingClientRect(); return [((e.clientX - r.left) / r.width) * 2 - 1, 1 - ((e.clientY - r.top) / r.height) * 2]; };
  canvas.addEventListener("wheel", (e) => {
    e.stopImmediatePropagation();
    if (document.activeElement !== canvas && !e.ctrlKey && !e.metaKey && !document.fullscreenElement) { onIdleWheel(); return; }
    e.preventDefault();
    const lines = e.deltaMode === 1 ? 33 : e.deltaMode === 2 ? 500 : 1, turned = Math.min(Math.max(e.deltaY * lines, -300), 300);
    zoom(...at(e), Math.exp(turned * (e.ctrlKey && Math.abs(e.deltaY) < 50 ? 0.01 : 0.0018)));   // a notch of a wheel is about 100: a fifth
  }, { capture: true, passive: false });
  canvas.style.touchAction = "pan-y";   // one finger up or down scrolls the page, across it turns; two fingers zoom

  let down = null;
  canvas.addEventListener("pointerdown", (e) => {
    down = [e.clientX, e.clientY];
    canvas.focus({ preventScroll: true });
    lookInto(...at(e));
  }, { capture: true });
  canvas.addEventListener("pointerup", (e) => {
    if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 5) onPick(pick(e, canvas));
    down = null;
  });
  const resize = () => {
    const w = canvas.parentElement.clientWidth, h = canvas.parentElement.clientHeight;
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    camera.updateProjectionMatrix();
    dirty = true;
  };
  resize();
  new ResizeObserver(resize).observe(canvas.parentElement);
}

// Draws if something has changed; called every animation frame.
export function draw() {
  if (glide) {
    const s = Math.min((performance.now() - glide.start) / 650, 1), e = s * s * (3 - 2 * s);
    camera.position.lerpVectors(glide.from, glide.to, e);
    controls.target.lerpVectors(glide.a, glide.b, e);
    if (s === 1) glide = null;
    dirty = true;
  }
  controls.update();
  if (!dirty) return;
  dirty = false;
  // The camera stays above the ground, and comes as near to it as to what it looks at.
  const d = camera.position.distanceTo(controls.target), z = ground(camera.position.x, camera.position.y), least = Math.min(0.004 * extent, 0.1 * d);
  if (z === z && camera.position.z < z + least) camera.position.z = z + least;
  camera.near = Math.max(d * 0.01, extent * 1e-5);
  camera.far = d + extent * 8;
  camera.updateProjectionMatrix();
  renderer.render(scene, camera);
}
