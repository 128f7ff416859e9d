import * as data from "./data.js";
import * as scene from "./scene.js";
import * as map from "./map.js";
import { chart, charts, completeInTurn, forget, onSeek, playhead, repaint } from "./plots.js";
import { narrow, table } from "./tables.js";
import { downloads } from "./download.js";
import { gradient, palette } from "./colors.js";
import { norm, number, quantity, text } from "./format.js";

const { summary, meta, blocks, structures, impacts, frames, nb, nf, array } = data;
const $ = (id) => document.getElementById(id);
const make = (tag, props = {}, ...children) => { const e = Object.assign(document.createElement(tag), props); e.append(...children); return e; };

const icons = {
  play: '<svg viewBox="0 0 20 20"><path d="M5 2.5v15l13-7.5z"/></svg>', pause: '<svg viewBox="0 0 20 20"><path d="M4 3h4v14H4zM12 3h4v14h-4z"/></svg>',
  sun: '<svg viewBox="0 0 20 20"><circle cx="10" cy="10" r="3.6"/><path d="M10 1.500v2M10 16.500v2M1.500 10h2M16.500 10h2M4 4l1.400 1.400M14.600 14.600 16 16M4 16l1.400-1.400M14.600 5.400 16 4"/></svg>',
  moon: '<svg viewBox="0 0 20 20"><path d="M16.500 12.200A7 7 0 0 1 7.800 3.500a7 7 0 1 0 8.700 8.700z"/></svg>',
};

// ---- theme
const root = document.documentElement;
const store = { get: (k) => { try { return localStorage.getItem(k); } catch { return null; } }, set: (k, v) => { try { localStorage.setItem(k, v); } catch { /* private windows */ } } };
function setTheme(name) {
  root.dataset.theme = name;
  $("theme").innerHTML = name === "dark" ? icons.sun : icons.moon;
  repaint();
  map.paint();
  scene.theme(name === "dark");
}
root.dataset.theme = store.get("talus-theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
$("theme").addEventListener("click", () => { const n = root.dataset.theme === "dark" ? "light" : "dark"; store.set("talus-theme", n); setTheme(n); });

// Paper is white: a page printed from the dark theme would have light letters on it.
let beforePrint = "", folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  for (const d of folded) d.open = true;
  beforePrint = root.dataset.theme;
  setTheme("light");
  map.complete();
});
addEventListener("afterprint", () => { setTheme(beforePrint); for (const d of folded) d.open = false; });

// ---- summary
$("title").textContent = summary.title || "Results";
const states = { done: ["finished", "good"], "at rest": ["at rest", "good"], "all left": ["all blocks left", "warn"], interrupted: ["interrupted", "warn"], unfinished: ["unfinished", "warn"], failed: ["failed", "bad"] };
// A rock fall that ends by its duration while blocks move has no run-out yet.
const goesOn = summary.status === "done" && !(summary.structures || []).length && (summary.headline || []).find((line) => /still moves? at the end/.test(line));
const [word, kind] = goesOn ? ["still moving", "warn"] : states[summary.status] || [summary.status, "warn"];
$("status").textContent = word;
$("status").className = `chip ${kind}`;
if (summary.message || goesOn) $("status").title = summary.message || goesOn;
// A number keeps its unit on the same line.
const tidy = (line) => line.replaceAll("m^3", "m³").replace(/(\d) (?=(s|m\/s|[GMkmµu]?(N|J|Pa)( [ms])?|m|m³)\b)/g, "$1\u00a0").replace(/\b([kMG]?N) ([ms])\b/g, "$1\u00a0$2");
// How bad stands beside how fast; the sentences themselves follow.
const said = summary.headline || [], strike = (said[0] || "").match(/^.+ struck (.+) at [^(]+(?= \()/), damage = said.map((line) => line.match(/^(.+?): (damage class \d of 4, [^(]+?) \(/)).find(Boolean);
(strike && damage ? [`${strike[0]}${strike[1] === damage[1] ? "" : `; ${damage[1]}`}: ${damage[2]}.`, ...said] : said).forEach((line, i) => (i ? $("words") : $("headline")).append(make("p", { className: i ? "" : "first", textContent: tidy(line) })));
if (summary.message) $("headline").append(make("p", { textContent: summary.message }));
$("words").hidden = $("words").children.length < 2;
// Warnings lie below the 3D view, one folded line each: what they are about first, without the place in the scene's file; all of it unfolded.
const warnings = (summary.warnings || []).map(tidy);
for (const line of warnings) {
  const short = line.replace(/^\S+?(:\d+:\d+: |: (?=warning|error))((warning|error): )?/, "").split(/[;.] /)[0];
  $("warning-list").append(make("details", { className: "warning" }, make("summary", { textContent: short }), make("p", { textContent: line })));
}
$("warnings").hidden = !warnings.length;
$("warnings-title").textContent = warnings.length === 1 ? "One warning" : `${warnings.length} warnings`;

const force = (m) => m.filtered_force ?? m.peak_force;   // results of earlier versions hold the single sub-step's only

function card(label, value, unit, note, extra = "", digits = 3) {
  const [v, u] = typeof value === "string" ? [value, ""] : quantity(value, unit, digits);
  $("cards").append(make("div", { className: `stat ${extra}` }, make("div", { className: "k", textContent: label }), make("div", { className: "v" }, v, make("small", { textContent: u })), make("div", { className: "n", textContent: note || " ", title: note || "" })));
}
// The first four: what was struck, how bad, will it stand, how sure.
function answer(question, value, note, kind = "") {
  $("answers").append(make("div", { className: `answer ${kind}` }, make("dt", { textContent: question }), make("dd", {}, make("b", { textContent: value }), make("span", { textContent: tidy(note) }))));
}
function answers(judged, graded, strike, loaded) {
  const touched = summary.structures.filter((s) => s.hit || s.loaded || s.loaded_through), name = strike && (strike.member && strike.member !== strike.structure ? `${strike.member} of ${strike.structure}` : strike.structure);
  if (strike) answer("What was struck?", name, `by ${strike.block} at ${number(strike.start, 4)} s, ${text(strike.speed, "m/s")}, ${text(strike.kinetic, "J")}`, "hit");
  else answer("What was struck?", loaded ? "Nothing; it was loaded" : "Nothing", loaded ? "by a prescribed traction" : "no block met a structure", loaded ? "" : "safe");
  if (!touched.length) return;
  const bare = touched.filter((s) => !(s.damage_max > 0) && !graded.some((m) => m.of === s.name)).length === touched.length;
  const worst = graded.length ? graded.reduce((a, b) => (b.damage_class > a.damage_class ? b : a)) : null;
  const sheared = judged.length ? judged.reduce((a, b) => (b.shear_utilisation_design.value > a.shear_utilisation_design.value ? b : a)) : null;
  if (worst) answer("How bad?", `${worst.label}: ${worst.damage_class_name}`, `damage class ${worst.damage_class} of 4${worst.damage_class_basis ? `: ${worst.damage_class_basis}` : ""}${worst.damage_class_range && worst.damage_class_range[0] < worst.damage_class_range[1] ? `; near a limit, class ${worst.damage_class_range.join(" to ")} with other time steps or cells` : ""}`, worst.damage_class >= 3 ? "hit" : worst.damage_class === 0 ? "safe" : "");
  else answer("How bad?", bare ? "Not computed" : "Damaged", bare ? `no damage law${sheared ? `; V_dyn/V_Rd ${number(sheared.shear_utilisation_design.value, 3)} at ${sheared.label}` : ""}` : `greatest damage ${number(Math.max(...touched.map((s) => s.damage_max)), 2)}`, sheared && sheared.shear_utilisation_design.value > 1 ? "hit" : "");
  const reserves = (meta.capacity || []).filter((r) => typeof r.reserve === "number"), lost = graded.filter((m) => m.damage_class === 4), gone = (meta.capacity || []).filter((r) => r.lost);
  if (lost.length || gone.length) answer("Will it stand?", "No", `${lost.length ? lost.map((m) => m.label).join(", ") : gone.map((r) => r.member).join(", ")} lost`, "hit");
  else if (reserves.length) {
    const least = reserves.reduce((a, b) => (b.reserve < a.reserve ? b : a));
    const severe = worst && worst.damage_class >= 3;
    answer("Will it stand?", least.reserve < 1 ? "No" : severe ? "In doubt" : "Yes",
      `${severe ? `${worst.label} is ${worst.damage_class_name}; ` : ""}pressed along its axis between plates that hold its ends ${least.member} bears ${number(least.reserve, 3)} times its permanent load, which says nothing of bending and shear`,
      least.reserve < 1 || severe ? "hit" : "safe");
  } else if (worst && worst.damage_class >= 3) answer("Will it stand?", "In doubt", "severe damage; talus capacity DIR computes what its members still bear", "hit");
  else answer("Will it stand?", worst ? "It does at the end" : "Not computed", worst ? "what it still bears: talus capacity DIR" : "a damage law and talus capacity DIR tell");
  const levels = (summary.confidence || []).filter((c) => c.level === "extrapolated" && /damage|base force|section|peak contact|impulse/.test(c.quantity)).map((c) => c.quantity.replace(/ \(.*/, ""));
  answer("How sure?", levels.length ? "Extrapolated in part" : "Verified", `${levels.length ? levels.join("; ") : "closed forms"}${warnings.length ? `; ${warnings.length} warning${warnings.length > 1 ? "s" : ""} below` : ""}`, levels.length || warnings.length ? "doubt" : "safe");
}
if (summary.structures && summary.structures.length) {
  const hits = summary.structures.filter((s) => s.hit).length, loaded = summary.structures.filter((s) => s.loaded).length, many = summary.structures.length > 1;
  const through = summary.structures.filter((s) => s.loaded_through).map((s) => `${s.name} loaded through ${s.loaded_through}`).join(", ");
  if (many || through) card(loaded && !hits ? "Structures loaded" : "Structures hit", `${hits || loaded} of ${summary.structures.length}`, "", [hits ? `first at ${number(impacts[0].start, 4)} s` : loaded ? "by a prescribed traction" : "", through].filter(Boolean).join("; "), hits ? "hit" : "safe");
  const broken = new Set(blocks.filter((b) => b.fragment).map((b) => b.name)), blows = impacts.filter((m) => !broken.has(m.block));
  const strikes = blows.length ? blows : impacts, greatest = (of) => strikes.reduce((a, m) => (!a || of(m) > of(a) ? m : a), null);
  const worst = greatest(force), hardest = greatest((m) => m.kinetic);   // what rolls on and presses may have the greatest force of all
  // How bad, before how fast: a member's class, and its shear against what it can bear.
  const judged = summary.structures.filter((s) => s.hit || s.loaded || s.loaded_through || s.damage_max > 0).flatMap((s) => (s.members || []).filter((m) => m.shear_utilisation_design).map((m) => ({ ...m, of: s.name, label: m.name === s.name ? m.name : `${s.name}, ${m.name}` })));
  const graded = judged.filter((m) => m.damage_class !== null && m.damage_class !== undefined);
  answers(judged, graded, hardest, loaded);
  if (judged.length) {
    const m = judged.reduce((a, b) => (b.shear_utilisation_design.value > a.shear_utilisation_design.value ? b : a)), use = m.shear_utilisation_design;
    card("Shear V_dyn / V_Rd", use.value, "1", `${m.label} at station ${number(use.station, 3)} m, ${number(use.time, 4)} s; design resistance by EN 1992-1-1 6.2, means over 1.5 ms`, use.value > 1 ? "hit" : "");
  }
  // The deck: what its spans may still carry.
  const spans = summary.structures.flatMap((s) => (s.members || []).filter((m) => m.span && m.function).map((m) => ({ ...m, of: s.name })));
  if (spans.length) {
    const rank = ["open", "restricted", "closed"], least = spans.reduce((a, b) => (rank.indexOf(b.function) > rank.indexOf(a.function) ? b : a));
    const count = rank.map((r) => [r, spans.filter((m) => m.function === r).map((m) => m.name)]).filter(([, names]) => names.length);
    card(spans.length > 1 ? `Deck, ${spans.length} spans` : "Deck", least.function, "", least.function === "open" ? `${least.name}: ${least.function_basis}` : count.reverse().map(([r, names]) => `${names.join(", ")} ${r}`).join("; ") + ` (${least.name}: ${least.function_basis})`, { closed: "hit", open: "safe" }[least.function] || "");
  }
  if (worst) {
    card("Impact speed", hardest.speed, "m/s", `${hardest.block} at ${number(hardest.start, 4)} s with ${text(hardest.kinetic, "J")}${hardest.kinetic_rotational === undefined ? "" : `, ${text(hardest.kinetic_rotational, "J")} of it rotation`}${strikes.length > 1 ? `, the most of all strikes${blows.length && blows.length < impacts.length ? " by blocks" : ""}` : ""}`);
    card("Contact force", force(worst), "N", worst.filtered_force === undefined ? `${worst.block}, single sub-step` : `${worst.block}, mean over 1.5 ms; single sub-step ${text(worst.peak_force, "N")}, depends on cells and contact law`);
    card("Impulse of this strike", norm(worst.impulse), "N s", `${worst.block} at ${number(worst.start, 4)} s, in ${text(worst.end - worst.start, "s", 3)}, mean ${text(worst.mean_force, "N")}`);
  }
  const top = (key) => summary.structures.reduce((a, s) => (s[key] > a[key] ? s : a));
  // A slab or a beam lies on supports; what stands has a base.
  const lies = summary.structures.every((s) => s.form === "slab" || s.form === "beam");
  const held = summary.structures.some((s) => s.peak_base_force > 0);   // what nothing holds has no reaction
  if (held && (hits || loaded) && lies) card("Support reaction, added", top("peak_base_force").peak_base_force, "N", `mean over 1.5 ms, at ${number(top("peak_base_force").peak_base_force_time, 4)} s`);
  if (held && (hits || loaded) && !lies) {
    card("Base shear, added", top("peak_base_shear").peak_base_shear, "N", `mean over 1.5 ms, at ${number(top("peak_base_shear").peak_base_shear_time, 4)} s`);
    card("Base moment, added", top("peak_base_moment").peak_base_moment, "N m", `mean over 1.5 ms, at ${number(top("peak_base_moment").peak_base_moment_time, 4)} s`);
  }
  // A probe stays behind with what came off; the drift of a member does not.
  const moves = summary.structures.flatMap((s) => [
    ...s.probes.map((p) => ({ name: `${s.name} ${p.name}`, peak: p.peak_displacement, note: `${text(norm(p.final_displacement), "m")} at the end` })),
    ...(s.members || []).map((m) => ({ name: `${m.name}, ${m.span ? "middle against its ends" : s.form === "slab" || s.form === "beam" ? "one end against the other" : "top against base"}`, peak: m.peak_drift, note: "" }))]);
  if (moves.length) {
    const p = moves.reduce((a, b) => (b.peak > a.peak ? b : a));
    card("Largest displacement", p.peak, "m", [p.name, p.note].filter(Boolean).join(", "));
  }
  const d = top("damage_max");
  if (d.damage_max > 0) card("Greatest damage", d.damage_max, "1", `${text(d.damaged_volume, "m^3")} above one half`, d.damage_max > 0.5 ? "hit" : "");
  const lost = summary.structures.reduce((a, s) => a + s.spalled_volume, 0);
  if (lost > 0) card("Lost concrete", lost, "m^3", "eroded or come off", "hit");
} else if (blocks.length) {
  const moving = blocks.filter((b) => b.end && !b.fixed), most = (key) => moving.reduce((a, b) => (b[key] > a[key] ? b : a), moving[0]);
  if (moving.length) {
    card("Blocks", String(moving.length), "", text(moving.reduce((a, b) => a + b.volume, 0), "m^3") + " in all");
    card(goesOn ? "Farthest so far" : "Farthest run-out", most("runout").runout, "m", goesOn ? `${most("runout").name}; ${goesOn.replace(/\.$/, "")}` : most("runout").name);
    card("Greatest drop", most("drop").drop, "m", most("drop").name);
    card("Greatest speed", most("max_speed").max_speed, "m/s", most("max_speed").name);
    card("Greatest energy", most("max_kinetic").max_kinetic, "J", most("max_kinetic").name);
  }
}
const lostNumerically = summary.energy && summary.energy.algorithmic_warned;
if (lostNumerically) card(summary.energy.algorithmic - (summary.energy.step_dependence || 0) < 0 ? "Numerical energy gain" : "Numerical dissipation", `${number(100 * summary.energy.algorithmic_relative, 2)} %`, "", "of the energy that was moved: more than the scheme should take; see the warning below", "hit");
else if (summary.energy) card("Energy residual", `${number(100 * summary.energy.residual_relative, 2)} %`, "", "worst, of the greatest kinetic energy (of that at 1 cm/s where nothing got so fast)");
if (summary.time && summary.time.wall_seconds) card("Computed in", summary.time.wall_seconds, "s", `${number(summary.time.end, 4)} s simulated`);
// Rows of about the same length: nine cards are five and four, not seven and two.
function level() {
  const n = $("cards").children.length, most = Math.max(2, Math.floor(($("cards").clientWidth + 10) / 182)), rows = Math.ceil(n / most);
  if (n) $("cards").style.gridTemplateColumns = `repeat(${Math.ceil(n / rows)}, minmax(0, 1fr))`;
}
new ResizeObserver(level).observe($("cards"));
level();

// ---- time
let time = data.start, playing = false, lastTick = 0, speed = 1, open3d = false;
const length = Math.max(data.end - data.start, 1e-9);
const slider = $("time");
slider.min = data.start;
slider.max = data.end;
for (const s of [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10]) $("speed").append(make("option", { value: s, textContent: `${s}×` }));
speed = length > 40 ? 2 : length < 0.5 ? 0.05 : length < 2 ? 0.25 : 1;
$("speed").value = speed;
$("speed").addEventListener("change", (e) => { speed = +e.target.value; });
if (!impacts.length) { $("slow-label").hidden = true; $("prev-impact").hidden = true; $("next-impact").hidden = true; }
for (const m of impacts.slice(0, 200)) $("marks").append(make("i", { title: `${m.block} on ${m.structure}, ${number(m.start, 5)} s`, style: `left:${(100 * (m.start - data.start)) / length}%` }));

const pose = { position: [0, 0, 0], q: [1, 0, 0, 0], speed: 0, kinetic: 0 };
let mapTime = 0;
function setTime(t, fromSlider) {
  time = Math.min(Math.max(t, data.start), data.end);
  if (!fromSlider) slider.value = time;
  const clock = $("clock");
  clock.replaceChildren(`${time.toFixed(length < 1 ? 4 : 3)} s`, make("small", { textContent: ` / ${number(data.end, 4)}` }));
  if (open3d) scene.show(time);
  playhead(time);
  if (performance.now() - mapTime > 60) { map.now(time); mapTime = performance.now(); }
  readout();
}
function readout() {
  const b = scene.view.follow >= 0 ? scene.view.follow : chosen.kind === "block" ? chosen.index : nb === 1 ? 0 : impacts.length ? Math.max(blocks.findIndex((x) => x.name === impacts[0].block), 0) : -1;
  const box = $("readout");
  if (b < 0 || !data.pose(b, time, pose)) { box.replaceChildren(); return; }
  box.replaceChildren(make("b", { textContent: blocks[b].name }), ` ${number(pose.speed, 3)} m/s`, make("br"), make("span", { className: "dim", textContent: text(pose.kinetic, "J") }));
}
function play(on) {
  if (on && time >= data.end - 1e-9) setTime(data.start);
  playing = on;
  $("play").innerHTML = on ? icons.pause : icons.play;
  $("play").setAttribute("aria-label", on ? "Pause" : "Play");
  lastTick = performance.now();
}
$("play").addEventListener("click", () => play(!playing));
slider.addEventListener("input", () => setTime(+slider.value, true));
function jump(direction) {
  const list = impacts.map((m) => m.start - 0.02).sort((a, b) => a - b), eps = 1e-6;
  const t = direction > 0 ? list.find((x) => x > time + eps) : list.filter((x) => x < time - 0.03).pop();
  if (t !== undefined) setTime(t);
}
$("prev-impact").addEventListener("click", () => jump(-1));
$("next-impact").addEventListener("click", () => jump(1));
onSeek((t) => { play(false); setTime(t); });

function tick(now) {
  if (playing) {
    let rate = speed;
    // A contact of twenty milliseconds in a run of half a minute would go by unseen.
    if ($("slow").checked) for (const m of impacts) if (time > m.start - 0.06 && time < Math.min(m.end, m.start + 0.3) + 0.25) rate = Math.min(rate, 0.08);
    setTime(time + (Math.min(now - lastTick, 100) / 1000) * rate);
    if (time >= data.end) play(false);
  }
  lastTick = now;
  if (open3d) scene.draw();
  requestAnimationFrame(tick);
}

// ---- selection
let chosen = { kind: "", index: -1 }, panelPlots = [];
function close() {
  forget(panelPlots);
  panelPlots = [];
  $("panel").hidden = true;
  chosen = { kind: "", index: -1 };
  if (open3d) scene.select("", -1);
}
function blockSeries(b) {
  const t = frames.time, n = nf, y = { speed: new Array(n), kinetic: new Array(n), height: new Array(n) };
  for (let k = 0; k < n; k++) {
    const i = k * nb + b, there = frames.position[3 * i] === frames.position[3 * i];
    y.speed[k] = there ? frames.speed[i] : null;
    y.kinetic[k] = there ? frames.kinetic[i] : null;
    y.height[k] = there ? frames.position[3 * i + 2] - (data.ground(frames.position[3 * i], frames.position[3 * i + 1]) || NaN) : null;
    if (!(y.height[k] === y.height[k])) y.height[k] = null;
  }
  return [Array.from(t), y];
}
const list = (pairs) => make("dl", {}, ...pairs.filter((p) => p[1] !== undefined).flatMap(([k, v]) => [make("dt", { textContent: k }), make("dd", { textContent: v })]));
function choose(pick) {
  close();
  if (!pick) return;
  chosen = pick;
  if (open3d) scene.select(pick.kind, pick.index);
  const panel = $("panel");
  panel.hidden = false;
  const shut = make("button", { className: "icon close", textContent: "✕", title: "Close (Esc)" });
  shut.setAttribute("aria-label", "Close");
  shut.addEventListener("click", close);
  panel.replaceChildren(shut);
  const plot = (spec) => { const f = make("figure", { style: "margin:10px 0 0" }); panel.append(f); panelPlots.push(chart(f, { height: 150, time: true, ...spec })); };
  if (pick.kind === "block") {
    const b = blocks[pick.index], [t, y] = blockSeries(pick.index);
    panel.append(make("h2", { textContent: b.name }), make("p", { className: "sub", textContent: `${b.fragment ? "fragment" : "block"}, ${text(b.mass, "kg")}, ${text(b.volume, "m^3")}` }),
      list([["greatest speed", text(b.max_speed, "m/s")], ["greatest energy", text(b.max_kinetic, "J")], ["run-out in plan", text(b.runout, "m")], ["drop", text(b.drop, "m")], ["path", text(b.path_length, "m")], ["speed at the end", text(b.final_speed, "m/s")]]));
    const c = nb <= 9 ? palette[pick.index % palette.length] : palette[0];
    plot({ title: "Speed", unit: "m/s", data: [t, y.speed], series: [{ label: "speed", color: c }] });
    plot({ title: "Kinetic energy", unit: "J", data: [t, y.kinetic], series: [{ label: "energy", color: c }] });
    if (y.height.some((v) => v !== null)) plot({ title: "Centroid above ground", unit: "m", data: [t, y.height], series: [{ label: "height", color: c }] });
  } else {
    const s = structures[pick.index], r = (summary.structures || []).find((x) => x.name === s.name) || {};
    panel.append(make("h2", { textContent: s.name }), make("p", { className: "sub", textContent: r.hit ? "was hit" : r.loaded ? "under its prescribed load" : r.loaded_through ? `was not struck itself, loaded through ${r.loaded_through}` : r.met ? `met ${r.met.with}; no block struck it` : "was not hit" }),
      list([["impulse", text(norm(r.impulse), "N s")], ["peak contact force, single sub-step", text(r.peak_force, "N")], ["base shear, added", text(r.peak_base_shear, "N")], ["base moment, added", text(r.peak_base_moment, "N m")], ["greatest damage", number(r.damage_max)], ["damaged volume", text(r.damaged_volume, "m^3")]]));
    for (const c of meta.curves || []) if (c.structure === s.name && !c.member) plot(spec(c));
  }
  readout();
}
// What is chosen in a table is looked at above it, where the keys go on.
function chooseFromTable(kind, index) {
  if (index < 0) return;
  choose({ kind, index });
  location.hash = "#playback";
  $("view").focus({ preventScroll: true });
}
// Structures, then blocks, by the keys: what a click picks in the view.
function chooseBeside(direction) {
  const all = [...structures.keys()].map((index) => ({ kind: "structure", index })).concat([...blocks.keys()].map((index) => ({ kind: "block", index })));
  const at = all.findIndex((x) => x.kind === chosen.kind && x.index === chosen.index);
  if (all.length) choose(all[at < 0 ? (direction > 0 ? 0 : all.length - 1) : (at + direction + all.length) % all.length]);
}

// ---- 3D view
const view = scene.view;
const hasDamage = structures.some((s) => s.frames.length && (summary.structures || []).some((x) => x.damage_max > 0));
view.field = hasDamage ? "damage" : structures.some((s) => s.stress_max > 0) ? "stress" : "displacement";
// Colours end where nineteen of twenty pieces of the bars lie; a piece at a crack that stands open is stretched far more.
function strainTop() {
  const top = Math.max(...structures.map((s) => (s.bars ? s.bars.strain_max : 0))), most = Math.max(...structures.map((s) => (s.bars ? s.bars.strain_greatest || 0 : 0)));
  const permille = (v) => `${number(1000 * v, 3)} \u2030`;
  return most > 1.001 * top ? [`, greatest ${permille(most)}`, `\u2265 ${permille(top)}`] : ["", permille(top)];
}
function legend() {
  const box = $("legend");
  box.replaceChildren();
  const add = (title, name, low, high) => box.append(make("div", { className: "legend" }, make("div", { className: "t", textContent: title }), make("div", { className: "bar", style: `background:${gradient(name)}` }), make("div", { className: "s" }, make("span", { textContent: low }), make("span", { textContent: high }))));
  if (structures.length) {
    if (view.field === "damage") add("Damage [–]", "damage", "0 sound", "1 cracked or crushed");
    const d = Math.max(...structures.map((s) => s.displacement_max)), q = Math.max(...structures.map((s) => s.stress_max));
    if (view.field === "displacement") add("Displacement", "displacement", "0", text(d, "m"));
    const w = Math.max(...structures.map((s) => s.crack_max || 0));
    if (view.field === "crack") add("Crack width", "load", "0", text(w, "m"));
    if (view.field === "stress") add("Von Mises stress", "load", "0", text(q, "Pa"));
    if (view.field === "bars") add(`Strain of the bars, size${strainTop()[0]}`, "speed", "0", strainTop()[1]);
  }
  if (scene.arrowCount()) {
    const arrow = make("div", { className: "legend arrow" });
    arrow.innerHTML = '<svg viewBox="0 0 26 10" width="26" height="10" aria-hidden="true"><path d="M1 5h16" stroke="#e0342b" stroke-width="2"/><path d="m16 1 9 4-9 4z" fill="#e0342b"/></svg>';
    arrow.append("Impulse of an impact: where and which way; all drawn of one length");
    box.append(arrow);
  }
  if (view.trajectories && nb) add("Speed along the path", "speed", "0", text(view.fastest, "m/s"));
}
function options() {
  const box = $("options");
  const pick = (label, items, value, set) => {
    const s = make("select", {}, ...items.map(([v, t]) => make("option", { value: v, textContent: t, selected: String(v) === String(value) })));
    s.addEventListener("change", () => { set(s.value); scene.refresh(); legend(); });
    box.append(make("label", {}, label, s));
    return s;
  };
  if (structures.length) {
    const items = [["damage", "damage"], ...(structures.some((s) => s.crack_max > 0) ? [["crack", "crack width"]] : []), ["displacement", "displacement"], ["stress", "stress"], ...(structures.some((s) => s.bars) ? [["bars", "bars"]] : []), ["plain", "plain"]];
    pick("structure", items, view.field, (v) => { view.field = v; }).id = "field";
    pick("deformed", [1, 5, 10, 20, 50, 100, 200].map((v) => [v, `×${v}`]), 1, (v) => { view.exaggeration = +v; }).id = "exaggeration";
  }
  const c = make("input", { type: "checkbox", checked: true });
  c.addEventListener("change", () => { view.trajectories = c.checked; scene.refresh(); legend(); });
  box.append(make("label", { className: "check" }, c, "paths"));
}
const presets = [["overview", "Overview"], ...(structures.length ? [["structure", "Structure"]] : []), ...(nb ? [["follow", "Follow"]] : []), ["top", "Top"], ["side", "Side"]];
function preset(name, quick) {
  if (!open3d) return;
  scene.cameras[name](quick);
  for (const b of $("presets").children) b.setAttribute("aria-pressed", b.dataset.name === name);
  readout();
}
presets.forEach(([name, label], i) => {
  const b = make("button", { textContent: label, title: `${label} (${i + 1})` });
  b.dataset.name = name;
  b.addEventListener("click", () => preset(name));
  $("presets").append(b);
});
let hintTimer = 0;
function hintOfZoom() {
  $("zoom-hint").hidden = false;
  clearTimeout(hintTimer);
  hintTimer = setTimeout(() => { $("zoom-hint").hidden = true; }, 3000);
}
function screenshot() {
  if (!open3d) return;
  const a = make("a", { href: scene.picture(), download: `${(summary.title || "talus").replace(/[^\w-]+/g, "-")}-${time.toFixed(3)}s.png` });
  a.click();
}
$("shot").addEventListener("click", screenshot);
const fullscreen = () => (document.fullscreenElement ? document.exitFullscreen() : $("playback").requestFullscreen && $("playback").requestFullscreen());
$("full").addEventListener("click", fullscreen);

// ---- plots
// What the cards state of a curve, and why a reading off the plot differs from it: rows of the histories are single steps, with the permanent load; cards are means.
function reading(c) {
  const of = (summary.structures || []).find((s) => s.name === c.structure), at = (k) => array(`${c.key}_${k}`), most = (f) => Array.from(at(0)).reduce((a, _, i) => Math.max(a, f(i) || 0), 0);
  if (c.group === "impact") return `filtered peak ${text(c.filtered_peak, "N")}, as in the table of impacts`;
  if (c.key === "residual" && summary.energy) return `worst ${text(summary.energy.residual_worst, "J")}${lostNumerically ? `, ${number(100 * summary.energy.residual_relative, 2)} % of ` : "; the card gives it over "}${summary.energy.kinetic_peak > 0 ? `the greatest kinetic energy, ${text(summary.energy.kinetic_peak, "J")}` : "the energy at 1 cm/s"}`;
  if (!of) return undefined;
  const m = c.member && (of.members || []).find((x) => x.name === c.member);
  if (m) {
    const [stated, unit] = c.key.endsWith("shear") ? [m.peak_shear, "N"] : [m.peak_moment, "N m"];
    return stated && stated.value > 0 ? `table: ${text(stated.value, unit)} at station ${number(stated.station, 3)} m, mean over 1.5 ms of every step; plotted are rows, single steps at three sections` : undefined;
  }
  const added = { force: [of.peak_base_shear, "N", "base shear"], moment: [of.peak_base_moment, "N m", "base moment"] }[/^structure_\d+_(force|moment)$/.test(c.key) ? c.key.split("_")[2] : ""];
  if (added && added[0] > 0) return `card: ${added[2]} added ${text(added[0], added[1])}, ${added[2] === "base moment" ? "the greatest of one foot about its own centroid" : "horizontal"}, mean over 1.5 ms of every step; plotted are rows, single steps, with the permanent load`;
  const probe = of.probes && of.probes.find((q) => c.title.endsWith(`displacement of ${q.name}`));
  if (probe) {
    const plotted = most((i) => Math.hypot(at(0)[i], at(1)[i], at(2)[i]));
    return Math.abs(plotted - probe.peak_displacement) > 0.01 * probe.peak_displacement ? `greatest of every step ${text(probe.peak_displacement, "m")}, of the rows ${text(plotted, "m")}` : `greatest ${text(probe.peak_displacement, "m")}`;
  }
  return undefined;
}
const column = (name) => Array.from(array(name), (v) => (isFinite(v) ? v : null));
function spec(c) {
  return { title: c.title, unit: c.unit, time: true, data: [Array.from(array(`${c.key}_time`)), ...c.series.map((_, i) => column(`${c.key}_${i}`))], note: reading(c),
    series: c.series.map((label, i) => (c.group === "impact" ? { label, color: i ? palette[0] : "#8d98a6", width: i ? 2.2 : 1 } : { label })) };
}
function addChart(grid, s) {
  const f = make("figure", { className: "card" });
  grid.append(f);
  return chart(f, { height: 260, ...s });
}
// On a phone the groups come folded.
function group(title) {
  const grid = make("div", { className: "plots" }), at = $("plot-groups"), box = make("details", { className: "group", open: !narrow }, make("summary", {}, make("h3", { textContent: title })));
  at.append(box);
  box.append(grid);
  return [grid, box];
}

// Section forces of a member over its height (a span: along it): at rest, in the row nearest to the greatest load, extremes of all rows; and the greatest means, as the table has them.
function sectionPlots(m) {
  const r = ((summary.structures || []).find((s) => s.name === m.structure) || { members: [] }).members.find((x) => x.name === m.name) || {}, x = Array.from(array(`${m.key}_station`));
  const label = m.structure === m.name ? m.name : `${m.structure}, ${m.name}`, axis = r.span ? "along the span [m]" : "from the base [m]";
  const nearest = (station) => x.reduce((a, v, i) => (Math.abs(v - station) < Math.abs(x[a] - station) ? i : a), 0), point = (peak) => x.map((_, i) => (i === nearest(peak.station) ? peak.value : null));
  const curves = (what, title, unit, peak, extremes, more = []) => ({ title: `${label}: ${title}`, unit, x: axis, height: 240,
    data: [x, ...["first", "then", ...extremes].map((k) => column(`${m.key}_${what}_${k}`)), ...more.map((e) => e.data), ...(peak ? [point(peak)] : [])],
    series: [{ label: "permanent load", color: "#8d98a6", dash: [5, 4] }, { label: `at ${number(m.time, 5)} s`, color: palette[0], width: 2.2 }, ...extremes.map((k, i) => ({ label: k === "most" ? "greatest of the run" : "least of the run", color: palette[i + 1], width: 1.2 })), ...more.map((e) => e.series), ...(peak ? [{ label: "greatest mean over 1.5 ms (table)", color: "#c0307a", dots: true }] : [])] });
  const [a, b] = m.shear_design, limits = a > 0 ? (Math.abs(a / b - 1) < 0.01 ? [["V_Rd, design", a]] : [["V_Rd along axis x, design", a], ["along axis y", b]]) : [];
  const why = "rows are single steps; the table's means over 1.5 ms hold between rows too";
  return [{ ...curves("shear", "shear force V", "N", r.peak_shear, ["most"], limits.map(([name, v], i) => ({ data: x.map(() => v), series: { label: name, color: i ? "#a5483f" : "#b3261e", dash: [9, 4] } }))), note: why },
    { ...curves("moment", "bending moment M", "N m", r.peak_moment, ["most"]), note: why }, { ...curves("axial", "axial force N", "N", null, ["least", "most"]), note: "compression positive" }];
}
// One member at a time: a viaduct of thirty has a hundred and fifty plots.
function memberPlots() {
  const members = meta.members || [], curves = (meta.curves || []).filter((c) => c.member);
  if (!members.length) return;
  const [grid, box] = group("Section forces of a member");
  let shown = [];
  const use = (m) => { const r = ((summary.structures || []).find((s) => s.name === m.structure) || { members: [] }).members.find((x) => x.name === m.name) || {}; return [r.damage_class ?? -1, r.shear_utilisation_design ? r.shear_utilisation_design.value : 0, r.peak_shear ? r.peak_shear.value : 0]; };
  const worst = members.reduce((a, b) => { const [u, v] = [use(b), use(a)], k = u.findIndex((x, i) => x !== v[i]); return k >= 0 && u[k] > v[k] ? b : a; });
  const show = (m) => {
    forget(shown);
    grid.replaceChildren();
    shown = [...sectionPlots(m), ...curves.filter((c) => c.structure === m.structure && c.member === m.name).map(spec)].map((s) => addChart(grid, s));
  };
  if (members.length > 1) {
    const pick = make("select", { id: "member" }, ...members.map((m, i) => make("option", { value: i, textContent: m.structure === m.name ? m.name : `${m.structure}, ${m.name}`, selected: m === worst })));
    pick.addEventListener("change", () => { show(members[+pick.value]); completeInTurn(() => {}); });
    grid.before(make("label", { className: "select member" }, "Member ", pick, make("span", { className: "dim", textContent: ` the worst of ${members.length} comes first` })));
  }
  show(worst);
}
function plots() {
  const groups = [["impact", "Contact force at each impact"], ["structure", "Structures"], ["energy", "Energy and momentum"]];
  for (const [key, title] of groups) {
    if (key === "energy") memberPlots();
    const curves = (meta.curves || []).filter((c) => c.group === key && !c.member);
    if (!curves.length) continue;
    const [grid] = group(title), left = meta.impacts_left_out;
    if (key === "impact" && left) grid.before(make("p", { className: "lead", textContent: `${curves.length} of ${impacts.length} impacts are plotted. ${[left.weak ? `${left.weak} brought less than a hundredth of the greatest impact's energy` : "", left.more ? `${left.more} more are weaker in force than the ${curves.length} shown` : ""].filter(Boolean).join("; ")}. The table of impacts has them all.` }));
    for (const c of curves) {
      const s = spec(c);
      // What stays zero is named in the tables, and hidden here.
      s.series.forEach((x, i) => { if (s.series.length > 3 && !s.data[i + 1].some((v) => v !== 0)) x.show = false; });
      addChart(grid, s);
    }
  }
}

function profile() {
  const moved = blocks.map((b, i) => i).filter((i) => blocks[i].end && !blocks[i].fixed && blocks[i].path_length > 0), whole = moved.filter((i) => !blocks[i].fragment);
  const order = (whole.length ? whole : moved).sort((a, b) => blocks[b].runout - blocks[a].runout).slice(0, 9);
  if (!order.length) { $("profile").hidden = $("deviation").hidden = true; return; }
  const stride = Math.max(1, Math.floor(nf / 1200)), tables = [], labels = [], dev = [], zero = data.origin[2];
  const lead = order[0], walk = (b) => {
    const x = [], z = [], g = [];
    let s = 0, px = NaN, py = NaN;
    for (let k = 0; k < nf; k += k + stride < nf || k === nf - 1 ? stride : nf - 1 - k || 1) {
      const i = 3 * (k * nb + b), a = frames.position[i], c = frames.position[i + 1];
      if (!(a === a)) continue;
      if (px === px) s += Math.hypot(a - px, c - py);
      px = a; py = c;
      if (x.length && s <= x[x.length - 1]) continue;
      x.push(s); z.push(frames.position[i + 2] + zero);
      const h = data.ground(a, c);
      g.push(h === h ? h + zero : null);
    }
    return [x, z, g];
  };
  const [gx, , gz] = walk(lead);
  if (gz.some((v) => v !== null)) { tables.push([gx, gz]); labels.push({ label: `ground under ${blocks[lead].name}`, color: "#8a7f70", width: 1.2, fill: "#8a7f7022" }); }
  for (const b of order) { const [x, z] = walk(b); tables.push([x, z]); labels.push({ label: blocks[b].name, color: nb <= 9 ? palette[b % palette.length] : undefined }); }
  // Straight line in plan from the mean release to the mean deposit of all that moved.
  const sum = order.reduce((a, b) => a.map((v, k) => v + (k < 2 ? blocks[b].start[k] : blocks[b].end[k - 2]) / order.length), [0, 0, 0, 0]);
  const dx = sum[2] - sum[0], dy = sum[3] - sum[1], n = Math.hypot(dx, dy) || 1, ox = sum[0] - data.origin[0], oy = sum[1] - data.origin[1];
  for (const b of order) {
    // As far as it gets along the line: what turns back would be drawn over itself.
    const x = [], y = [];
    for (let k = 0; k < nf; k += stride) {
      const i = 3 * (k * nb + b), a = frames.position[i] - ox, c = frames.position[i + 1] - oy, along = (a * dx + c * dy) / n;
      if (a === a && !(x.length && along <= x[x.length - 1])) { x.push(along); y.push((-a * dy + c * dx) / n); }
    }
    dev.push([x, y]);
  }
  const join = (list) => {
    const xs = [...new Set(list.flatMap((t) => t[0]))].sort((a, b) => a - b), at = new Map(xs.map((x, i) => [x, i]));
    return [xs, ...list.map(([x, y]) => { const out = new Array(xs.length).fill(null); x.forEach((v, i) => { out[at.get(v)] = y[i]; }); return out; })];
  };
  chart($("profile"), { title: "Profile of the trajectories", unit: "m", x: "distance travelled in plan [m]", data: join(tables), series: labels, height: 250 });
  chart($("deviation"), { title: "Lateral deviation", unit: "m", least: 0.01, x: "along the line to the mean deposit [m]", data: join(dev), series: order.map((b) => ({ label: blocks[b].name, color: nb <= 9 ? palette[b % palette.length] : undefined })), height: 210, note: "from the line between mean release and mean deposit, left positive" });
}

// ---- tables
function tables() {
  const moved = data.mapOrigin.some((v) => v !== 0), system = `${moved ? "map coordinates" : "scene coordinates"}${summary.map && summary.map.crs ? `, ${summary.map.crs}` : ""}`;
  const onMap = (v, i) => (v ? v[i] + data.mapOrigin[i] : null), digits = moved ? 9 : 7;
  const at = $("table-list"), n = (name, unit, get, digits) => ({ name, unit, get, digits }), t = (name, get) => ({ name, get, text: true });
  table(at, "How sure", "verified: closed form; validated: experiment; extrapolated: neither", [t("quantity", (r) => r.quantity), { name: "level", get: (r) => r.level, text: true, level: true }, { name: "basis", get: (r) => r.basis, long: true }], summary.confidence || []);
  table(at, "Impacts", `force as a mean over 1.5 ms, and over the hardest single sub-step, which depends on cells and contact law; point of contact in ${system}`, [t("block", (r) => r.block), t("structure", (r) => r.structure), n("start", "s", (r) => r.start, 6), n("duration", "s", (r) => r.end - r.start), n("speed", "m/s", (r) => r.speed), n("energy", "kJ", (r) => r.kinetic / 1e3), n("of rotation", "kJ", (r) => (r.kinetic_rotational === undefined ? null : r.kinetic_rotational / 1e3)), n("force, 1.5 ms", "kN", (r) => force(r) / 1e3), n("single sub-step", "kN", (r) => r.peak_force / 1e3),
    n("at", "s", (r) => r.peak_time, 6), n("mean force", "kN", (r) => r.mean_force / 1e3), n("impulse x", "N s", (r) => r.impulse[0]), n("y", "N s", (r) => r.impulse[1]), n("z", "N s", (r) => r.impulse[2]), n("point x", "m", (r) => onMap(r.point, 0), digits), n("y", "m", (r) => onMap(r.point, 1), digits), n("z", "m", (r) => onMap(r.point, 2), 7)], impacts, { onPick: (r) => { setTime(r.start); location.hash = "#playback"; } });
  table(at, "Structures", "base reactions without the preload, greatest means over 1.5 ms; click a row to select the structure", [t("name", (r) => r.name), t("hit", (r) => (r.hit ? "yes" : r.loaded_through ? `no, loaded through ${r.loaded_through}` : "no")), n("single sub-step force", "kN", (r) => r.peak_force / 1e3), n("impulse", "N s", (r) => norm(r.impulse)), n("support reaction", "kN", (r) => r.peak_base_force / 1e3), n("base shear", "kN", (r) => r.peak_base_shear / 1e3), n("at", "s", (r) => r.peak_base_shear_time, 5), n("base moment", "kN m", (r) => r.peak_base_moment / 1e3), n("at", "s", (r) => r.peak_base_moment_time, 5), n("damage", "", (r) => r.damage_max), n("damaged volume", "m³", (r) => r.damaged_volume)], summary.structures || [], { onPick: (r) => chooseFromTable("structure", structures.findIndex((s) => s.name === r.name)) });
  const members = (summary.structures || []).flatMap((s) => (s.members || []).map((m) => ({ ...m, of: s.name })));
  if (members.length) table(at, "Members", "V and M are greatest means over 1.5 ms; V_Rd by EN 1992-1-1 6.2, accidental design values; stations count from the base, or from one end of what lies; damage class 0 none to 4 lost", [t("structure", (r) => r.of), t("member", (r) => r.name), n("N permanent", "kN", (r) => r.axial_preload / 1e3), n("peak V", "kN", (r) => r.peak_shear.value / 1e3), n("at station", "m", (r) => r.peak_shear.station), n("peak M", "kN m", (r) => r.peak_moment.value / 1e3), n("at station", "m", (r) => r.peak_moment.station), n("V_dyn/V_Rd", "", (r) => r.shear_utilisation_design && r.shear_utilisation_design.value), n("residual drift", "%", (r) => (r.residual_drift_ratio === null || r.residual_drift_ratio === undefined ? null : r.residual_drift_under_load ? `${number(100 * r.residual_drift_ratio, 2)} (load still on it)` : 100 * r.residual_drift_ratio)), n("widest crack", "mm", (r) => 1e3 * r.crack_width_peak), n("bars yielded", "", (r) => r.bars_yielded), n("broken", "", (r) => r.bars_broken), n("lost volume", "m³", (r) => r.lost_volume), t("damage", (r) => (r.damage_class !== null ? `${r.damage_class} ${r.damage_class_name}` : r.damage_class_basis ? "not computed (elastic)" : "–"))], members);
  const spans = members.filter((m) => m.span && m.function);
  if (spans.length) table(at, "Deck", "what a span may carry after the run, our own rule: closed from damage class 3, its own or that of a pier below it, an end moved by 50 mm, or a residual deflection of 1/250 of the span; restricted from class 2 or 1/1000", [t("structure", (r) => r.of), t("span", (r) => r.name), t("function", (r) => r.function), { name: "because", get: (r) => r.function_basis, long: true }, n("residual deflection", "mm", (r) => (r.residual_drift ? 1e3 * norm(r.residual_drift) : null)), n("end moved by", "mm", (r) => 1e3 * r.end_shift), n("ends off their bearings", "", (r) => r.ends_unseated)], spans);
  const place = (k) => (m) => m[k];
  if ((meta.members || []).length) table(at, "Places of the members", `${system}; a pier from the centre of its foot to that of its head, a span from bearings to bearings`, [t("structure", (m) => m.structure), t("member", (m) => m.name), ...["base", "end"].flatMap((k) => ["x", "y", "z"].map((c, i) => n(i ? c : `${k === "base" ? "from" : "to"} ${c}`, "m", (m) => place(k)(m)[i] + data.mapOrigin[i], 9)))], meta.members);
  const crossed = (meta.lines || []).flatMap((l) => l.rows.map((r) => ({ ...r, line: l.name })));
  if ((meta.lines || []).length) table(at, "Lines", "passages of the blocks' centroids in plan, either way", [t("line", (l) => l.name), n("passages", "", (l) => l.rows.length, 6), n("blocks", "", (l) => new Set(l.rows.map((r) => r.block)).size, 6), n("first", "s", (l) => (l.rows.length ? Math.min(...l.rows.map((r) => r.time)) : null), 5), n("greatest speed", "m/s", (l) => (l.rows.length ? Math.max(...l.rows.map((r) => r.speed)) : null)), n("greatest energy", "kJ", (l) => (l.rows.length ? Math.max(...l.rows.map((r) => r.kinetic)) / 1e3 : null)), n("greatest height", "m", (l) => (l.rows.some((r) => r.height !== null) ? Math.max(...l.rows.map((r) => r.height ?? -Infinity)) : null))], meta.lines);
  table(at, "Crossings of lines", `of the centroid, in ${system}; height above the ground`, [t("line", (r) => r.line), t("block", (r) => r.block), n("time", "s", (r) => r.time, 6), n("speed", "m/s", (r) => r.speed), n("energy", "kJ", (r) => r.kinetic / 1e3), n("of rotation", "kJ", (r) => r.kinetic_rotational / 1e3), n("height", "m", (r) => r.height), n("x", "m", (r) => r.at[0] + data.mapOrigin[0], 9), n("y", "m", (r) => r.at[1] + data.mapOrigin[1], 9), n("z", "m", (r) => r.at[2] + data.mapOrigin[2], 7)], crossed, { onPick: (r) => { setTime(r.time); location.hash = "#playback"; } });
  if (meta.capacity) table(at, "Residual axial capacity", "greatest load on the top of each member between rigid plates; reserve: capacity now over permanent load; lost: not to be counted on as a pier, and what its stump bears between plates that neither move aside nor tilt is no reserve", [t("structure", (r) => r.structure), t("member", (r) => r.member), n("as built", "kN", (r) => r.capacity_built / 1e3), n("now", "kN", (r) => (r.capacity_now === null ? null : r.capacity_now / 1e3)), n("now/built", "", (r) => r.ratio), n("N permanent", "kN", (r) => r.axial_preload / 1e3), n("reserve", "", (r) => r.reserve), ...(meta.capacity.some((r) => r.lost) ? [n("stump", "kN", (r) => (typeof r.capacity_of_rest === "number" ? r.capacity_of_rest / 1e3 : null))] : []), t("damage", (r) => (r.damage_class === null ? (r.lost ? "lost" : "") : `${r.damage_class} ${r.damage_class_name}`))], meta.capacity);
  table(at, "Probes", "", [t("structure", (r) => r.of), t("probe", (r) => r.name), n("peak displacement", "mm", (r) => 1e3 * r.peak_displacement), n("at", "s", (r) => r.peak_time, 5), n("at the end x", "mm", (r) => 1e3 * r.final_displacement[0]), n("y", "mm", (r) => 1e3 * r.final_displacement[1]), n("z", "mm", (r) => 1e3 * r.final_displacement[2])], (summary.structures || []).flatMap((s) => s.probes.map((p) => ({ ...p, of: s.name }))));
  table(at, "Design cross-checks", "formulas for the blow with the most energy on each structure, with the speed along the contact normal; computed: the blow's hardest single sub-step beside a peak, its mean beside an equivalent static force, its greatest mean over 1.5 ms beside a static resistance", [t("structure", (r) => r.structure), t("block", (r) => r.block), t("formula", (r) => r.name), t("symbol", (r) => r.symbol), n("formula's value", "kN", (r) => (r.value === null ? null : r.value / 1e3)), t("is a", (r) => r.kind), n("computed", "kN", (r) => r.computed / 1e3), t("which is", (r) => r.computed_is || ""), n("computed / formula", "", (r) => (r.value === null ? null : r.computed / r.value), 3), n("computed, 1.5 ms", "kN", (r) => r.computed_filtered / 1e3),
    { name: "equation", get: (r) => r.equation, detail: true }, { name: "inputs", get: (r) => r.inputs, detail: true }, { name: "source", get: (r) => `${r.source} (${r.status})`, detail: true }, { name: "note", get: (r) => r.note, detail: true }], summary.formulas || []);
  table(at, "Blocks", `end in ${system}; click a row to select the block`, [t("name", (r) => r.name), n("mass", "kg", (r) => r.mass), n("volume", "m³", (r) => r.volume), n("run-out", "m", (r) => r.runout), n("drop", "m", (r) => r.drop), n("path", "m", (r) => r.path_length), n("greatest speed", "m/s", (r) => r.max_speed), n("greatest energy", "kJ", (r) => r.max_kinetic / 1e3), n("final speed", "m/s", (r) => r.final_speed), n("left the model", "s", (r) => r.left), n("end x", "m", (r) => onMap(r.end, 0), digits), n("y", "m", (r) => onMap(r.end, 1), digits), n("z", "m", (r) => onMap(r.end, 2), 7)], blocks, { onPick: (r) => chooseFromTable("block", blocks.indexOf(r)) });
  const e = summary.energy || {};
  table(at, "Energy ledger", "work since the start; dissipation positive", [t("entry", (r) => r[0]), n("energy", "kJ", (r) => r[1] / 1e3, 6)], [["energy at the start", e.start], ["external work", e.external_work], ["energy at the end", e.end], ["dissipated by friction", e.friction_work], ["dissipated by damping and restitution", e.damping_work], ["dissipated by damage", e.damage_work], ["dissipated by yielding ground", e.yield_work || undefined], ["dissipated by ploughing", e.ploughing_work || undefined], ["dissipated by vegetation", e.vegetation_work || undefined], ["numerical dissipation (negative: gain)", e.algorithmic], ["of this step dependence of the leapfrog energy, no loss", e.step_dependence], ["residual at the end", e.residual_end], ["worst residual", e.residual_worst]].filter((r) => r[1] !== undefined && r[1] !== null));
  const a = summary.audit;
  if (a) table(at, "Audit of the interface", "both sides of every contact", [t("check", (r) => r[0]), n("value", "", (r) => r[1])], [["force imbalance, relative", a.force_imbalance], ["moment imbalance, relative", a.moment_imbalance], ["impulse against momentum change, relative", a.impulse_defect], ["work on blocks [J]", a.work_on_blocks], ["work on structures [J]", a.work_on_structure]]);
  const c = summary.counters;
  if (c) table(at, "Run", "", [t("counter", (r) => r[0]), n("value", "", (r) => r[1], 6)], Object.entries(c).filter(([, v]) => typeof v === "number").map(([k, v]) => [k.replaceAll("_", " "), v]));
}

for (const line of summary.plan || []) {
  const out = /left out|not |none/.test(line), i = line.indexOf(":"), li = make("li", { className: out ? "out" : "" });
  if (i > 0 && i < 40) li.append(make("b", { textContent: line.slice(0, i) }), line.slice(i));
  else li.textContent = line;
  $("plan-list").append(li);
}
if (!(summary.plan || []).length) $("plan").hidden = true;
$("footer").textContent = `Written by Talus. Coordinates are those of the scene; the view is shifted by (${data.origin.join(", ")}) m. ${nf} instants and ${meta.terrain ? `${meta.terrain.shown} of ${meta.terrain.triangles} triangles of the terrain` : "no terrain"} are kept here; results.h5 holds everything.`;

// ---- keyboard
const keys = [["space", "play or pause"], ["← →", "one step back or on (with shift: ten)"], [", .", "impact before, next impact"], ["home end", "first, last instant"], ["- +", "slower, faster"], ["1 … 5", "camera"], ["w a s d", "turn the view"], ["i o", "nearer to what is in the middle, farther"], ["wheel", "nearer, farther where the pointer is, once the view is clicked (or with ctrl); else the page scrolls"], ["n b", "select the next structure or block, the one before"], ["c", "colour of the structure"], ["t", "dark or light"], ["f", "full screen"], ["p", "save a picture"], ["esc", "close the selection"], ["?", "this help"]];
const dialog = $("help");
// Letters that act wherever one types them are in the way of speech input and of readers' own keys (WCAG 2.1.4).
let shortcuts = store.get("talus-shortcuts") !== "off";
const everywhere = make("input", { type: "checkbox", checked: shortcuts, id: "shortcuts" });
everywhere.addEventListener("change", () => { shortcuts = everywhere.checked; store.set("talus-shortcuts", shortcuts ? "on" : "off"); });
dialog.setAttribute("aria-labelledby", "help-title");
const shutHelp = make("button", { className: "icon close", textContent: "✕", title: "Close (Esc)" });
shutHelp.setAttribute("aria-label", "Close");
shutHelp.addEventListener("click", () => dialog.close());
dialog.append(shutHelp, make("h2", { textContent: "Keyboard", id: "help-title" }), make("label", { className: "check" }, everywhere, "shortcuts act everywhere on the page; off: only while the 3D view has the focus"), make("dl", {}, ...keys.flatMap(([k, v]) => [make("dt", {}, ...k.split(" ").map((x) => make("kbd", { textContent: x }))), make("dd", { textContent: v })])));
dialog.addEventListener("click", (e) => { if (e.target === dialog) dialog.close(); });
$("help-button").addEventListener("click", () => dialog.showModal());
document.addEventListener("keydown", (e) => {
  if (dialog.open || e.ctrlKey || e.metaKey || e.altKey || /^(SELECT|TEXTAREA)$/.test(e.target.tagName)) return;
  if (e.target.tagName === "BUTTON" && (e.key === " " || e.key === "Enter")) return;
  if (e.target.tagName === "INPUT" && e.target !== slider) return;
  if (e.target.tagName === "SUMMARY" && (e.key === " " || e.key === "Enter")) return;
  if (!shortcuts && e.key !== "Escape" && e.target !== $("view")) return;
  const step = nf > 1 ? length / (nf - 1) : 0.01, select = $("speed"), camera = presets[+e.key - 1];
  const turn = (across, up, nearer = 1) => { if (open3d) scene.turn(across * 0.15, up * 0.1, nearer); };
  const actions = {
    " ": () => play(!playing), ArrowLeft: () => setTime(time - step * (e.shiftKey ? 10 : 1)), ArrowRight: () => setTime(time + step * (e.shiftKey ? 10 : 1)), Home: () => setTime(data.start), End: () => setTime(data.end),
    a: () => turn(-1, 0), d: () => turn(1, 0), w: () => turn(0, 1), s: () => turn(0, -1), i: () => turn(0, 0, 0.8), o: () => turn(0, 0, 1.25), n: () => chooseBeside(1), b: () => chooseBeside(-1),
    ",": () => jump(-1), ".": () => jump(1), "?": () => dialog.showModal(), t: () => $("theme").click(), f: fullscreen, p: screenshot, Escape: close,
    "-": () => { select.selectedIndex = Math.max(0, select.selectedIndex - 1); speed = +select.value; }, "+": () => { select.selectedIndex = Math.min(select.length - 1, select.selectedIndex + 1); speed = +select.value; },
    c: () => { const f = $("field"); if (f) { f.selectedIndex = (f.selectedIndex + 1) % f.length; f.dispatchEvent(new Event("change")); } },
  };
  const act = camera ? () => preset(camera[0]) : actions[e.key];
  if (!act) return;
  e.preventDefault();
  act();
});

// ---- start
function start3d() {
  const note = $("no-webgl");
  note.hidden = true;
  try {
    scene.open($("view"), choose, hintOfZoom);
    open3d = true;
    options();
    legend();
    preset("overview", true);
    scene.theme(root.dataset.theme === "dark");
    if (chosen.kind) scene.select(chosen.kind, chosen.index);
    setTime(time);
  } catch (error) {
    $("view").hidden = $("presets").hidden = $("legend").hidden = true;
    $("stage").classList.add("without");
    note.hidden = false;
    note.textContent = "This browser offers no WebGL, so there is no 3D view. The map below moves with the time slider; all plots and tables are here.";
    console.warn(`3D view unavailable: ${error.message}`);
  }
  $("shot").disabled = !open3d;
}
map.open($("map"), $("map-tip"), $("map-note"));
if (meta.map) $("map").closest("figure").querySelector("figcaption").append(downloads("Map", map.picture, map.rows));
plots();
profile();
tables();
setTheme(root.dataset.theme);
setTime(data.start);
play(false);
requestAnimationFrame(tick);
// The 3D view comes after the first picture of the page: without a graphics card its start alone takes many seconds.
$("shot").disabled = true;
$("no-webgl").hidden = false;
$("no-webgl").textContent = "Setting up the 3D view \u2026";
const ready = new Promise((resolve) => requestAnimationFrame(() => setTimeout(() => { start3d(); resolve(open3d); completeInTurn(map.complete); })));

// For tests of the page. `ready` resolves when the 3D view is there, or cannot be.
window.talus = { ready, get time() { return time; }, get playing() { return playing; }, get webgl() { return open3d; }, setTime, play, choose, preset, charts, onScreen: (b) => scene.onScreen(b, time), distance: (b) => scene.distance(b, time), get chosen() { return chosen; } };
