// Files that the page hands out: pictures of canvases, tables of numbers.
import { summary } from "./data.js";

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const stem = (text) => text.normalize("NFKD").replace(/[^\w.-]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 80);

export function save(name, blob) {
  const url = URL.createObjectURL(blob);
  Object.assign(document.createElement("a"), { href: url, download: `${stem(summary.title || "talus")}-${name}` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

// Two buttons for a figure: `picture()` gives a canvas, `table()` rows of cells with the heads first.
export function downloads(title, picture, table) {
  const box = document.createElement("span");
  box.className = "downloads";
  const button = (label, work) => {
    const b = Object.assign(document.createElement("button"), { type: "button", textContent: label });
    b.setAttribute("aria-label", `${label} of ${title}`);
    b.title = label === "PNG" ? "Download the picture" : "Download the numbers";
    b.addEventListener("click", work);
    box.append(b);
  };
  button("PNG", () => picture().toBlob((blob) => save(`${stem(title)}.png`, blob), "image/png"));
  button("CSV", () => save(`${stem(title)}.csv`, new Blob([csv(table())], { type: "text/csv;charset=utf-8" })));
  return box;
}

// RFC 4180; what is missing or no number is an empty cell.
export function csv(rows) {
  const cell = (v) => (v === null || v === undefined || (typeof v === "number" && !isFinite(v)) ? "" : /[",\n]/.test(String(v)) ? `"${String(v).replaceAll('"', '""')}"` : String(v));
  return rows.map((r) => r.map(cell).join(",")).join("\r\n") + "\r\n";
}

// A plot on paper of its own: title above, names of the curves below. `entries`: { label, color }.
export function framed(title, canvas, ratio, entries = []) {
  const out = document.createElement("canvas"), g = out.getContext("2d"), wide = canvas.width / ratio, small = "12px system-ui, sans-serif";
  g.font = small;
  const places = [];
  let x = 12, line = 0;
  for (const e of entries) {
    const w = g.measureText(e.label).width + 34;
    if (x + w > wide && x > 12) { x = 12; line++; }
    places.push([x, line]);
    x += w;
  }
  const below = entries.length ? 20 * (line + 1) + 6 : 6;
  out.width = canvas.width;
  out.height = canvas.height + Math.round((34 + below) * ratio);
  g.scale(ratio, ratio);
  g.fillStyle = css("--panel");
  g.fillRect(0, 0, out.width, out.height);
  g.fillStyle = css("--text");
  g.font = "600 14px system-ui, sans-serif";
  g.fillText(title, 12, 22);
  g.drawImage(canvas, 0, 34, wide, canvas.height / ratio);
  g.font = small;
  entries.forEach((e, i) => {
    const [at, row] = places[i], y = 34 + canvas.height / ratio + 16 + 20 * row;
    g.fillStyle = e.color;
    g.fillRect(at, y - 6, 16, 3);
    g.fillStyle = css("--text");
    g.fillText(e.label, at + 21, y);
  });
  return out;
}
