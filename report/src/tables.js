// Tables that copy to a spreadsheet: tab-separated, full digits, SI, whatever the screen shows.
import { number, text } from "./format.js";

// On a phone what is long comes folded.
export const narrow = matchMedia("(max-width: 640px)").matches;

const make = (tag, props = {}, ...children) => { const e = Object.assign(document.createElement(tag), props); e.append(...children); return e; };

async function copy(content, button) {
  try {
    await navigator.clipboard.writeText(content);
  } catch {
    const area = make("textarea", { value: content });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  const old = button.textContent;
  button.textContent = "Copied";
  setTimeout(() => { button.textContent = old; }, 1400);
}

// columns: [{ name, unit, get(row), text, long, detail, digits, html }]; what is `detail` stands in a line of its own below the row.
export function table(parent, title, note, columns, rows, { limit = 25, onPick } = {}) {
  if (!rows.length) return;
  const plain = () => [columns.map((c) => (c.unit ? `${c.name} [${c.unit}]` : c.name)).join("\t"),
    ...rows.map((r) => columns.map((c) => { const v = c.get(r); return v === null || v === undefined || (typeof v === "number" && !isFinite(v)) ? "" : String(v).replace(/[\t\n]/g, " "); }).join("\t"))].join("\n");
  const button = make("button", { className: "copy", textContent: "Copy", title: "Copy for a spreadsheet" });
  button.addEventListener("click", () => copy(plain(), button));
  const body = make("tbody"), across = columns.filter((c) => !c.detail), details = columns.filter((c) => c.detail);
  const detail = (r) => make("tr", { className: "detail" }, Object.assign(make("td", { className: "text" }, ...details.flatMap((c) => [make("b", { textContent: `${c.name} ` }), `${c.get(r)}  `])), { colSpan: across.length }));
  const fill = (n) => {
    body.replaceChildren(...rows.slice(0, n).flatMap((r, i) => {
      const tr = make("tr", {}, ...across.map((c) => {
        const v = c.get(r), td = make("td", { className: c.long ? "text long" : c.text ? "text" : "" });
        if (c.level) td.append(make("span", { className: `level ${v}`, textContent: v }));
        else td.textContent = c.text || typeof v !== "number" ? v ?? "–" : c.show ? text(v, c.unit, c.digits) : number(v, c.digits || 4);
        return td;
      }));
      if (onPick) {
        tr.className = "pick";
        tr.tabIndex = 0;
        tr.addEventListener("click", () => onPick(r, i));
        tr.addEventListener("keydown", (e) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); e.stopPropagation(); onPick(r, i); } });
      }
      return details.length ? [tr, detail(r)] : [tr];
    }));
  };
  fill(limit);
  const box = make("details", { className: "table", open: !narrow },
    make("summary", {}, make("b", { textContent: title }), make("span", { textContent: note || "" })), button,
    make("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: title }, make("table", { className: "data" }, make("thead", {}, make("tr", {}, ...across.map((c) => make("th", { className: c.text || c.long ? "text" : "", scope: "col", textContent: c.unit && !c.show ? `${c.name} [${c.unit.replaceAll(" ", "\u00a0")}]` : c.name })))), body)));
  if (rows.length > limit) {
    const more = make("button", { className: "more", textContent: `Show all ${rows.length}` });
    more.addEventListener("click", () => { fill(rows.length); more.remove(); });
    box.append(more);
  }
  parent.append(box);
}
