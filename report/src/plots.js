import uPlot from "uplot";
import { palette } from "./colors.js";
import { downloads, framed } from "./download.js";
import { pretty, scaleOf, number, text } from "./format.js";

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const all = [];  // { make, plot, holder, time }
let seek = () => {};
export const onSeek = (f) => { seek = f; };
const sync = uPlot.sync("time"), time_label = "t [s]";

// What a curve shows, for who does not see it.
function inWords(spec) {
  const range = (y) => {
    let low = Infinity, high = -Infinity;
    for (const v of y) if (v !== null && isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
    return low > high ? "no values" : `${text(low, spec.unit)} to ${text(high, spec.unit)}`;
  };
  return `${spec.title}, over ${spec.x || time_label}. ${spec.series.map((s, i) => `${s.label}: ${range(spec.data[i + 1])}`).join("; ")}`;
}
// All numbers of the plot, in SI units, as they are before any prefix.
const rowsOf = (spec) => {
  const unit = spec.unit === "1" ? "-" : spec.unit;
  return [[spec.x || time_label, ...spec.series.map((s) => `${s.label} [${unit}]`)], ...Array.from(spec.data[0], (x, i) => [x, ...spec.series.map((_, k) => spec.data[k + 1][i])])];
};

// As wide as its longest label: a minus sign that is cut off is a wrong number.
function labelWidth(u, labels, axis) {
  u.ctx.font = u.axes[axis].font[0];
  const widest = (labels || []).reduce((w, l) => Math.max(w, u.ctx.measureText(l).width / devicePixelRatio), 0);
  return Math.max(58, Math.ceil(widest) + 18);
}

function build(holder, spec) {
  const width = Math.max(240, holder.clientWidth), least = spec.least || 0, size = spec.data.slice(1).reduce((m, y) => y.reduce((a, v) => (v === null || !isFinite(v) ? a : Math.max(a, Math.abs(v))), m), least);
  const [factor, p] = scaleOf(size, spec.unit);
  const unit = p + (spec.unit === "1" ? "" : pretty(spec.unit));
  const data = [spec.data[0], ...spec.data.slice(1).map((y) => (factor === 1 ? y : Array.from(y, (v) => (v === null ? null : v / factor))))];
  const axis = { stroke: css("--dim"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--line"), width: 1 }, font: "12px system-ui, sans-serif" };
  const labels = (u, ticks) => ticks.map((v) => (Math.abs(v) >= 1e5 ? v.toExponential(0) : String(+v.toPrecision(6))));
  const plot = new uPlot({
    width, height: spec.height || 250, padding: [10, 22, 0, 0],
    scales: { x: { time: false }, y: least ? { range: (u, low, high) => uPlot.rangeNum(Math.min(low, -least / factor), Math.max(high, least / factor), 0.1, true) } : {} },
    legend: { live: true },
    cursor: { drag: { x: true, y: false }, focus: { prox: 24 }, points: { size: 7 }, ...(spec.time ? { sync: { key: sync.key, setSeries: false } } : {}) },
    focus: { alpha: 0.35 },
    series: [
      { label: spec.x || time_label, value: (u, v) => (v === null ? "–" : number(v, 6)) },
      ...spec.series.map((s, i) => ({
        label: s.label, stroke: s.color || palette[i % palette.length], width: s.width || 1.6, dash: s.dash, show: s.show !== false, fill: s.fill, fillTo: s.fill ? (u) => u.scales.y.min : undefined,
        spanGaps: !s.dots && spec.gaps !== false, points: s.dots ? { show: true, size: 9, fill: s.color } : { show: false }, value: (u, v) => (v === null || v === undefined ? "–" : number(v, 4)),
      })),
    ],
    axes: [
      { ...axis, values: labels, label: spec.x ? spec.x : undefined, labelSize: 18, labelFont: "12px system-ui, sans-serif" },
      { ...axis, values: labels, size: labelWidth },
    ],
  }, data, holder);
  plot.ctx.canvas.setAttribute("role", "img");
  plot.ctx.canvas.setAttribute("aria-label", inWords(spec));
  // Curves are shown and hidden by a click on their names, or by the keys there.
  for (const name of plot.root.querySelectorAll(".u-legend .u-series:not(:first-child) th")) {
    name.tabIndex = 0;
    name.title = "Show or hide this curve";
    name.addEventListener("keydown", (e) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); e.stopPropagation(); name.click(); } });
  }
  if (spec.time) {
    const head = document.createElement("div");
    head.className = "playhead";
    plot.over.appendChild(head);
    plot.head = head;
    let down = 0;
    plot.over.addEventListener("pointerdown", (e) => { down = e.clientX; });
    plot.over.addEventListener("click", (e) => { if (Math.abs(e.clientX - down) < 4) seek(plot.posToVal(e.offsetX, "x")); });
  }
  return [plot, unit];
}

// spec: { title, unit, data: [x, y...], series: [{ label, color, fill (down to the lowest value shown) }], time, note, least (half the range of y, at the least) }
export function chart(parent, spec) {
  const caption = document.createElement("figcaption"), holder = document.createElement("div");
  holder.className = "plot";
  parent.append(caption, holder);
  const entry = { holder, spec, plot: null };
  const make = () => {
    if (entry.plot) entry.plot.destroy();
    const [plot, unit] = build(holder, spec);
    entry.plot = plot;
    caption.replaceChildren(Object.assign(document.createElement("span"), { textContent: spec.title }), Object.assign(document.createElement("span"), { className: "u", textContent: unit ? `[${unit}]` : "" }));
    const full = unit ? `${spec.title} [${unit}]` : spec.title;
    caption.append(downloads(spec.title, () => framed(full, entry.plot.ctx.canvas, entry.plot.ctx.canvas.width / entry.plot.width, spec.series.flatMap((x, i) => (entry.plot.series[i + 1].show ? [{ label: x.label, color: x.color || palette[i % palette.length] }] : []))), () => rowsOf(spec)));
    if (spec.note) caption.append(Object.assign(document.createElement("span"), { className: "note", textContent: spec.note }));
    head(entry, now);
  };
  entry.make = make;
  entry.width = 0;
  all.push(entry);
  // Built when it comes into sight, else when there is time for it: a report with forty plots opens as fast as one with four, and a print or a
  // picture of the whole page has them all.
  const see = new IntersectionObserver((list) => { if (list.some((e) => e.isIntersecting)) entry.see(); }, { rootMargin: "400px" });
  entry.see = () => {
    if (entry.plot || !all.includes(entry)) return;
    see.disconnect();
    make();
    entry.width = holder.clientWidth;
    new ResizeObserver(() => {
      if (entry.plot && Math.abs(holder.clientWidth - entry.width) > 1) {
        entry.width = holder.clientWidth;
        entry.plot.setSize({ width: Math.max(240, entry.width), height: spec.height || 250 });
        head(entry, now);
      }
    }).observe(holder);
  };
  holder.style.minHeight = `${(spec.height || 250) + 30}px`;
  see.observe(holder);
  return entry;
}

// Builds what is not in sight yet: all at once before printing, one after the other once the page stands.
export function complete() {
  for (const e of [...all]) e.see();
}
export function completeInTurn(then) {
  const next = all.find((e) => !e.plot);
  if (!next) { then(); return; }
  next.see();
  if (next.plot) setTimeout(completeInTurn, 30, then);
}
addEventListener("beforeprint", complete);

export function forget(entries) {
  for (const e of entries) {
    if (e.plot) e.plot.destroy();
    const i = all.indexOf(e);
    if (i >= 0) all.splice(i, 1);
  }
}

export const charts = () => all.map((e) => e.plot).filter(Boolean);

let now = 0;
function head(entry, t) {
  const u = entry.plot;
  if (!u || !u.head) return;
  const x = u.valToPos(t, "x");
  u.head.style.transform = `translateX(${x}px)`;
  u.head.style.display = x >= 0 && x <= u.over.clientWidth ? "" : "none";
}
export function playhead(t) {
  now = t;
  for (const e of all) head(e, t);
}
export function repaint() {
  for (const e of all) if (e.plot) e.make();
}
