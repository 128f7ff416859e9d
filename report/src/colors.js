// Colour maps as short tables, interpolated. Those of structures start at the tone of concrete and darken, so that what is not loaded looks as it
// is, and grey printing keeps the order.
const maps = {
  damage: ["#c9c4ba", "#e6c86e", "#ef9a3c", "#d9482b", "#a8182a", "#640e28"],
  displacement: ["#c9c4ba", "#a9d45f", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e", "#2c0a45"],
  load: ["#c9c4ba", "#f7b98a", "#f4695c", "#c83e73", "#8c2981", "#51127c", "#1b1044"],
  speed: ["#2c5fa8", "#2f9db0", "#63bf7c", "#e8cf4a", "#ef8a3c", "#d23a2f"],
};
const hex = (h) => [1, 3, 5].map((i) => parseInt(h.slice(i, i + 2), 16) / 255);
const tables = Object.fromEntries(Object.entries(maps).map(([k, v]) => [k, v.map(hex)]));

export function color(map, s, out = [0, 0, 0]) {
  const t = tables[map], x = Math.min(Math.max(s, 0), 1) * (t.length - 1), i = Math.min(Math.floor(x), t.length - 2), f = x - i;
  for (let c = 0; c < 3; c++) out[c] = t[i][c] + f * (t[i + 1][c] - t[i][c]);
  return out;
}
export const css = (map, s) => `rgb(${color(map, s).map((c) => Math.round(255 * c)).join(",")})`;
export const gradient = (map) => `linear-gradient(90deg, ${maps[map].join(",")})`;
export const palette = ["#e07b39", "#3d8bd4", "#2fa37c", "#b070d6", "#d1a92f", "#de5d7f", "#46b0c2", "#8a7355", "#7d8998"];
