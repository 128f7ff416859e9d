// Map in plan: shaded relief, trajectories, deposits, structures; and where the blocks are now.
import { array, blocks, frames, mapOrigin, meta, nb, nf, origin, pose, structures, summary } from "./data.js";
import { framed } from "./download.js";
import { css, palette } from "./colors.js";

const m = meta.map, height = array("map_height");
let canvas, context, base, ratio = 1, width = 0, tall = 0, scale = 1;
const px = (x) => (x - m.x0) * scale, py = (y) => tall - (y - m.y0) * scale;
const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function relief(dark) {
  const image = new ImageData(m.nx, m.ny), sun = [-0.5, 0.5, 0.7071];
  for (let j = 0; j < m.ny; j++)
    for (let i = 0; i < m.nx; i++) {
      const at = (a, b) => height[Math.min(Math.max(b, 0), m.ny - 1) * m.nx + Math.min(Math.max(a, 0), m.nx - 1)];
      const z = at(i, j), k = 4 * ((m.ny - 1 - j) * m.nx + i);
      if (!(z === z)) { image.data[k + 3] = 0; continue; }
      const gx = (at(i + 1, j) - at(i - 1, j)) / (2 * m.dx) || 0, gy = (at(i, j + 1) - at(i, j - 1)) / (2 * m.dy) || 0, n = 1 / Math.hypot(gx, gy, 1);
      const light = Math.min(Math.max((-gx * sun[0] - gy * sun[1] + sun[2]) * n, 0), 1);
      const tone = dark ? 32 + 70 * light : 118 + 128 * light;
      image.data.set(dark ? [tone * 0.94, tone, tone * 1.06, 255] : [tone, tone * 0.985, tone * 0.95, 255], k);
    }
  const c = document.createElement("canvas");
  c.width = m.nx;
  c.height = m.ny;
  c.getContext("2d").putImageData(image, 0, 0);
  return c;
}

function contours(g) {
  // Marching squares on the map's own grid; each cell knows which levels cross it.
  let low = Infinity, high = -Infinity;
  for (const z of height) if (z === z) { low = Math.min(low, z); high = Math.max(high, z); }
  const step = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200].find((s) => (high - low) / s < 22) || 500;
  const stride = Math.max(1, Math.round(m.nx / 180)), lines = new Map(), x = [0, 0, 0, 0], y = [0, 0, 0, 0], z = [0, 0, 0, 0];
  for (let j = 0; j + stride < m.ny; j += stride)
    for (let i = 0; i + stride < m.nx; i += stride) {
      for (let k = 0; k < 4; k++) {
        const a = i + (k === 1 || k === 2 ? stride : 0), b = j + (k > 1 ? stride : 0);
        x[k] = px(m.x0 + a * m.dx); y[k] = py(m.y0 + b * m.dy); z[k] = height[b * m.nx + a] + origin[2];
      }
      const top = Math.max(z[0], z[1], z[2], z[3]);   // NaN beside a hole: no level is below it
      for (let n = Math.ceil(Math.min(z[0], z[1], z[2], z[3]) / step); n * step <= top; n++) {
        if (!lines.has(n)) lines.set(n, new Path2D());
        const line = lines.get(n);
        for (let e = 0, open = false; e < 4; e++) {
          const f = (e + 1) % 4, a = z[e] - n * step, b = z[f] - n * step;
          if (a < 0 === b < 0) continue;
          const s = a / (a - b);
          line[open ? "lineTo" : "moveTo"](x[e] + s * (x[f] - x[e]), y[e] + s * (y[f] - y[e]));
          open = !open;
        }
      }
    }
  for (const [n, line] of lines) {
    g.lineWidth = n % 5 === 0 ? 1.1 : 0.6;
    g.stroke(line);
  }
}

function hull(points) {
  points.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const cross = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list) => { const h = []; for (const p of list) { while (h.length > 1 && cross(h[h.length - 2], h[h.length - 1], p) <= 0) h.pop(); h.push(p); } h.pop(); return h; };
  return half(points).concat(half(points.slice().reverse()));
}

// Paths coloured by speed: one line of the canvas for each tone, not for each segment.
function trajectories(g) {
  const step = Math.max(1, Math.ceil((nf * nb) / 400000)), tones = 32, lines = Array.from({ length: tones + 1 }, () => new Path2D());
  const fastest = frames.speed.reduce((a, s) => (s > a ? s : a), 1e-9);
  for (let b = 0; b < nb; b++) {
    let last = -1;
    for (let k = 0; k < nf; k += step) {
      const i = (k * nb + b) * 3, x = frames.position[i], y = frames.position[i + 1];
      if (!(x === x)) continue;
      if (last >= 0) {
        const j = (last * nb + b) * 3;
        if (Math.hypot(x - frames.position[j], y - frames.position[j + 1]) * scale < 0.4) continue;
        const line = lines[Math.round((tones * frames.speed[k * nb + b]) / fastest)];
        line.moveTo(px(frames.position[j]), py(frames.position[j + 1]));
        line.lineTo(px(x), py(y));
      }
      last = k;
    }
  }
  g.lineWidth = nb > 30 ? 0.7 : 1.8;
  g.globalAlpha = nb > 100 ? 0.35 : 0.9;
  g.lineCap = "round";
  lines.forEach((line, k) => { g.strokeStyle = css("speed", k / tones); g.stroke(line); });
}

// Painted when it is in sight, since most readers look at the summary first; else when there is time for it, and before printing.
let seen = false, stale = true;
export function paint() {
  stale = true;
  if (seen) complete();
}
export function complete() {
  if (!canvas || !stale) return;
  stale = false;
  const dark = document.documentElement.dataset.theme === "dark";
  width = canvas.parentElement.clientWidth;
  scale = width / ((m.nx - 1) * m.dx);
  tall = (m.ny - 1) * m.dy * scale;
  ratio = Math.min(devicePixelRatio || 1, 2);
  base = document.createElement("canvas");
  base.width = canvas.width = Math.round(width * ratio);
  base.height = canvas.height = Math.round(tall * ratio);
  canvas.style.height = `${tall}px`;
  const g = base.getContext("2d");
  g.scale(ratio, ratio);
  g.fillStyle = variable("--raise");
  g.fillRect(0, 0, width, tall);
  g.imageSmoothingQuality = "high";
  g.drawImage(relief(dark), 0, 0, width, tall);
  g.strokeStyle = dark ? "#ffffff26" : "#3a2a1438";
  contours(g);

  trajectories(g);
  g.globalAlpha = 1;
  const places = [], east = new Map();   // eastern edge of a structure on the map [px]
  for (const s of structures) {
    const nodes = s.epochs.length ? array(`${s.epochs[0]}_nodes`) : [], points = [];
    for (let i = 0; i < nodes.length; i += 3) points.push([nodes[i], nodes[i + 1]]);
    const h = hull(points);
    if (h.length < 3) continue;
    g.beginPath();
    h.forEach(([x, y], i) => (i ? g.lineTo(px(x), py(y)) : g.moveTo(px(x), py(y))));
    g.closePath();
    g.fillStyle = dark ? "#e8ebefcc" : "#1d2127cc";
    g.fill();
    east.set(s.name, px(h.reduce((a, p) => Math.max(a, p[0]), -Infinity)));
    if (!piers.some((p) => p.structure === s.name)) places.push({ lines: [s.name, coordinates(...middle(h))], x: east.get(s.name) + 5, y: py(h[0][1]) - 4 });
  }
  for (const p of piers) {
    const alone = piers.filter((q) => q.structure === p.structure).length === 1 && east.get(p.structure);   // beside it; of several each beside its foot
    places.push({ lines: [p.name, coordinates(p.base[0] - origin[0], p.base[1] - origin[1])], x: (alone || px(p.base[0] - origin[0])) + 6, y: py(p.base[1] - origin[1]) - 6, foot: p });
  }
  for (let b = 0; b < nb; b++) {
    const i = ((nf - 1) * nb + b) * 3, x = frames.position[i], y = frames.position[i + 1];
    if (!(x === x)) continue;
    g.fillStyle = nb <= 9 ? palette[b % palette.length] : "#c2541b";
    g.strokeStyle = dark ? "#000" : "#fff";
    g.lineWidth = 1;
    const r = nb > 300 ? 1.6 : nb > 30 ? 2.6 : 4.5;
    g.beginPath();
    g.rect(px(x) - r, py(y) - r, 2 * r, 2 * r);
    g.fill();
    g.stroke();
  }
  crossings(g, dark);
  name(g, places, dark);   // over the deposits, which lie where piers stood
  frame(g, dark);
  overlay();
}

// Piers by their names; spans lie over them.
const ends = new Set((summary.structures || []).flatMap((s) => (s.members || []).filter((x) => x.span).map((x) => `${s.name}\n${x.name}`)));
const piers = (meta.members || []).filter((p) => !ends.has(`${p.structure}\n${p.name}`));
const middle = (points) => points.reduce((a, p) => [a[0] + p[0] / points.length, a[1] + p[1] / points.length], [0, 0]);
const coordinates = (x, y) => [x + origin[0] + mapOrigin[0], y + origin[1] + mapOrigin[1]].map((v) => v.toFixed(1)).join(", ");

// Names with their coordinates; where two would lie on each other the later one loses first the coordinates, then goes below or away.
function name(g, places, dark) {
  const taken = [];
  for (const { lines, x, y, foot } of places) {
    if (foot) {
      g.beginPath();
      g.arc(px(foot.base[0] - origin[0]), py(foot.base[1] - origin[1]), 3.5, 0, 7);
      g.fillStyle = "#b3261e";
      g.fill();
      g.lineWidth = 1.2;
      g.strokeStyle = "#fff";
      g.stroke();
    }
    const tries = [[lines, y - 13], [lines, y + 20], [lines.slice(0, 1), y], [lines.slice(0, 1), y + 20]];
    for (const [shown, top] of tries) {
      const wide = Math.max(...shown.map((l, i) => { g.font = i ? "11px system-ui, sans-serif" : "600 12px system-ui, sans-serif"; return g.measureText(l).width; }));
      const left = Math.max(2, Math.min(x, width - wide - 4)), box = [left, top - 11, left + wide, top + 14 * (shown.length - 1) + 3];
      if (box[1] < 0 || box[3] > tall || taken.some((t) => box[0] < t[2] && box[2] > t[0] && box[1] < t[3] && box[3] > t[1])) continue;
      taken.push(box);
      shown.forEach((l, i) => label(g, l, left, top + 14 * i, dark, i ? "11px system-ui, sans-serif" : undefined));
      break;
    }
  }
}

// Where paths cross the lines of the scene.
function crossings(g, dark) {
  for (const l of meta.lines || [])
    l.rows.forEach((r, i) => {
      const x = px(r.at[0] - origin[0]), y = py(r.at[1] - origin[1]);
      g.beginPath();
      g.moveTo(x - 4, y - 4); g.lineTo(x + 4, y + 4); g.moveTo(x - 4, y + 4); g.lineTo(x + 4, y - 4);
      g.lineWidth = 2;
      g.strokeStyle = dark ? "#fff" : "#000";
      g.stroke();
      if (!i) label(g, l.name, x + 7, y + 4, dark);
    });
}

function label(g, text, x, y, dark, font = "600 12px system-ui, sans-serif") {
  g.font = font;
  g.lineWidth = 3;
  g.strokeStyle = dark ? "#0e1115" : "#fff";
  g.strokeText(text, x, y);
  g.fillStyle = dark ? "#e8ebef" : "#1d2127";
  g.fillText(text, x, y);
}

// Scale bar, north, and scene coordinates on the edge.
function frame(g, dark) {
  const length = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000].filter((l) => l * scale < width * 0.3).pop() || 1, y = tall - 16;
  g.strokeStyle = dark ? "#e8ebef" : "#1d2127";
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(14, y - 5); g.lineTo(14, y); g.lineTo(14 + length * scale, y); g.lineTo(14 + length * scale, y - 5);
  g.stroke();
  label(g, `${length} m`, 18, y - 7, dark);
  g.strokeStyle = dark ? "#e8ebef" : "#1d2127";
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(width - 20, 38); g.lineTo(width - 20, 16); g.moveTo(width - 25, 22); g.lineTo(width - 20, 14); g.lineTo(width - 15, 22);
  g.stroke();
  label(g, "N", width - 24.5, 53, dark);
}

let current = 0;
const p = { position: [0, 0, 0], q: [1, 0, 0, 0] };
export function now(t) {
  current = t;
  if (base && seen) overlay();
}
function overlay() {
  const dark = document.documentElement.dataset.theme === "dark";
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.drawImage(base, 0, 0);
  context.scale(ratio, ratio);
  for (let b = 0; b < nb; b++) {
    if (!pose(b, current, p)) continue;
    context.beginPath();
    context.arc(px(p.position[0]), py(p.position[1]), nb > 300 ? 1.5 : nb > 30 ? 2.5 : 5, 0, 7);
    context.fillStyle = nb <= 9 ? palette[b % palette.length] : dark ? "#ffd166" : "#7a2d00";
    context.fill();
    if (nb <= 300) { context.lineWidth = 1.5; context.strokeStyle = "#fff"; context.stroke(); }
  }
}

// The map as a file: the picture as it is seen, and the paths in numbers.
export function picture() {
  complete();
  return framed("Trajectories and deposits", canvas, ratio);
}
export function rows() {
  const out = [["block", "t [s]", "x [m]", "y [m]", "z [m]", "speed [m/s]"]];
  for (let b = 0; b < nb; b++)
    for (let k = 0; k < nf; k++) {
      const i = (k * nb + b) * 3, at = [0, 1, 2].map((c) => +(frames.position[i + c] + origin[c] + mapOrigin[c]).toFixed(4));
      if (at[0] === at[0]) out.push([blocks[b].name, frames.time[k], ...at, frames.speed[k * nb + b]]);
    }
  return out;
}

export function open(element, tip, note) {
  if (!m || m.nx < 2) { element.parentElement.parentElement.hidden = true; return; }
  const crs = (summary.map && summary.map.crs) || "", moved = mapOrigin.some((v) => v !== 0);
  note.textContent = `Coordinates: ${moved ? "of the map" : "of the scene"}${crs ? `, ${crs}` : ""}${moved ? `; of the scene they are less by (${mapOrigin.slice(0, 2).join(", ")}) m` : ""}.`;
  canvas = element;
  context = canvas.getContext("2d");
  // The place is kept, so that nothing jumps when the map appears.
  width = canvas.parentElement.clientWidth;
  canvas.style.height = `${(width * (m.ny - 1) * m.dy) / ((m.nx - 1) * m.dx)}px`;
  new IntersectionObserver((list) => {
    seen = list[list.length - 1].isIntersecting;
    if (seen && stale) complete(); else if (seen) now(current);
  }, { rootMargin: "400px" }).observe(canvas);
  let last = width;
  new ResizeObserver(() => { if (Math.abs(canvas.parentElement.clientWidth - last) > 1) { last = canvas.parentElement.clientWidth; paint(); } }).observe(canvas.parentElement);
  canvas.addEventListener("pointermove", (e) => {
    const r = canvas.getBoundingClientRect(), x = e.clientX - r.left, y = e.clientY - r.top;
    let best = 16, name = "";
    for (let b = 0; b < nb; b++)
      for (const k of [0, nf - 1]) {
        const i = (k * nb + b) * 3, d = Math.hypot(px(frames.position[i]) - x, py(frames.position[i + 1]) - y);
        if (d < best) { best = d; name = `${blocks[b].name}, ${k ? "deposit" : "release"} · `; }
      }
    tip.hidden = false;
    tip.textContent = `${name}${coordinates(x / scale + m.x0, (tall - y) / scale + m.y0)} m`;
    tip.style.left = `${Math.min(x + 14, width - tip.offsetWidth - 4)}px`;
    tip.style.top = `${Math.max(y - 34, 2)}px`;
  });
  canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
}
