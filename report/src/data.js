// What the run left: the summary and the arrays, decoded from the page itself.
function decode(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text).buffer;
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes.buffer;
}

const types = { f32: Float32Array, f64: Float64Array, i16: Int16Array, u16: Uint16Array, u8: Uint8Array, u32: Uint32Array };
export const meta = JSON.parse(document.getElementById("talus-meta").textContent);
export const summary = meta.summary;
const holder = document.getElementById("talus-data");
const buffer = decode(holder.textContent.trim());
holder.textContent = "";

const empty = new Float32Array(0);
export function array(name) {
  const a = meta.arrays[name];
  if (!a) return empty;
  return new types[a.type](buffer, a.offset, a.dims.reduce((p, d) => p * d, 1));
}

// Poses of the blocks at the kept instants.
export const frames = {
  time: array("frame_time"), position: array("frame_position"), orientation: array("frame_orientation"),
  speed: array("frame_speed"), kinetic: array("frame_kinetic"),
};
export const blocks = summary.blocks || [];
export const structures = meta.structures || [];
export const impacts = summary.impacts || [];
export const nb = blocks.length;
export const nf = frames.time.length;
export const start = nf ? frames.time[0] : 0;
export const end = nf ? frames.time[nf - 1] : 1;
export const origin = meta.origin || [0, 0, 0];
// Map coordinates of the scene's origin: added to scene coordinates where a place is named.
export const mapOrigin = (summary.map && summary.map.origin) || [0, 0, 0];

// Index of the last element of `times` that is not beyond t.
export function before(times, t) {
  let a = 0, b = times.length - 1;
  while (a < b) {
    const m = (a + b + 1) >> 1;
    if (times[m] <= t) a = m; else b = m - 1;
  }
  return a;
}

// Pose of block b at t: position linear, rotation normalised linear between frames. False before its birth.
export function pose(b, t, out) {
  const k = before(frames.time, t), n = Math.min(k + 1, nf - 1);
  const span = frames.time[n] - frames.time[k], s = span > 0 ? Math.min(Math.max((t - frames.time[k]) / span, 0), 1) : 0;
  const i = (k * nb + b) * 3, j = (n * nb + b) * 3, p = frames.position;
  if (!(p[i] === p[i])) return false;
  for (let c = 0; c < 3; c++) out.position[c] = p[i + c] + s * (p[j + c] - p[i + c]);
  const q = frames.orientation, u = (k * nb + b) * 4, v = (n * nb + b) * 4;
  const sign = q[u] * q[v] + q[u + 1] * q[v + 1] + q[u + 2] * q[v + 2] + q[u + 3] * q[v + 3] < 0 ? -1 : 1;
  let norm = 0;
  for (let c = 0; c < 4; c++) { out.q[c] = q[u + c] + s * (sign * q[v + c] - q[u + c]); norm += out.q[c] * out.q[c]; }
  norm = 1 / Math.sqrt(norm || 1);
  for (let c = 0; c < 4; c++) out.q[c] *= norm;
  const a = frames.speed[k * nb + b], z = frames.speed[n * nb + b];
  out.speed = a + s * (z - a);
  out.kinetic = frames.kinetic[k * nb + b] + s * (frames.kinetic[n * nb + b] - frames.kinetic[k * nb + b]);
  return true;
}

// Height of the ground at (x, y), bilinear; NaN outside.
const map = meta.map, height = array("map_height");
export function ground(x, y) {
  if (!map) return NaN;
  const u = (x - map.x0) / map.dx, v = (y - map.y0) / map.dy, i = Math.floor(u), j = Math.floor(v);
  if (i < 0 || j < 0 || i + 1 >= map.nx || j + 1 >= map.ny) return NaN;
  const a = u - i, b = v - j, k = j * map.nx + i;
  return (1 - b) * ((1 - a) * height[k] + a * height[k + 1]) + b * ((1 - a) * height[k + map.nx] + a * height[k + map.nx + 1]);
}
