const prefixes = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

export function prefix(size) {
  for (const [f, p] of prefixes) if (size >= f * 0.9999) return [f, p];
  return size > 0 ? [1e-12, "p"] : [1, ""];
}

// Units that take no prefix are shown as they are.
const plain = new Set(["", "1", "s", "m/s", "m^3", "rad/s", "kg m/s", "kg m^2/s"]);

export function number(v, digits = 3) {
  if (v === null || v === undefined || !isFinite(v)) return "–";
  if (v === 0) return "0";
  if (Number.isInteger(v) && Math.abs(v) < 1e9 && digits > 3) return String(v);
  const a = Math.abs(v);
  if (a >= 1e6 || a < 1e-3) return v.toExponential(digits - 1).replace("e+", "e");
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(a)));
  return v.toFixed(Math.min(decimals, 6)).replace(/^-(0(\.0+)?)$/, "$1");
}

// [text, unit] with an engineering prefix: 2.31e6, "N" -> ["2.31", "MN"].
export function quantity(v, unit, digits = 3) {
  if (v === null || v === undefined || !isFinite(v)) return ["–", ""];
  if (unit === "kg") return Math.abs(v) >= 1000 ? [number(v / 1000, digits), "t"] : [number(v, digits), "kg"];
  if (plain.has(unit)) return [number(v, digits), unit === "1" ? "" : pretty(unit)];
  const [f, p] = prefix(Math.abs(v));
  if (unit === "m" && f >= 1000) return [number(v, digits), "m"];
  return [number(v / f, digits), p + pretty(unit)];
}
export const text = (v, unit, digits) => quantity(v, unit, digits).join(" ").trim();
export const pretty = (unit) => unit.replace("^2", "²").replace("^3", "³").replace(" m", " m");
export const scaleOf = (size, unit) => (plain.has(unit) || unit === "kg" ? [1, ""] : unit === "m" && size >= 1 ? [1, ""] : prefix(size));
export const norm = (v) => Math.hypot(...(v || [0]));
