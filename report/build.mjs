// node build.mjs SRC PAGE NODE_MODULES: bundles SRC/main.js and SRC/style.css into SRC/index.html, as one file.
import { createRequire } from "node:module";
import fs from "node:fs";
import path from "node:path";

const [src, page, modules] = process.argv.slice(2).map((p) => path.resolve(p));
const require = createRequire(path.join(modules, "x.js"));
const esbuild = require("esbuild");

const script = await esbuild.build({
  entryPoints: [path.join(src, "main.js")],
  bundle: true, minify: true, write: false, format: "iife", target: "es2020", charset: "utf8",
  nodePaths: [modules], legalComments: "none", logLevel: "warning",
});
const style = await esbuild.build({
  entryPoints: [path.join(src, "style.css")],
  bundle: true, minify: true, write: false, nodePaths: [modules], charset: "utf8", logLevel: "warning",
});
// A replacement function, because "$" means something in replacement strings; "</script" must not end the element early.
const js = script.outputFiles[0].text.replaceAll("</script", "<\\/script");
const html = fs.readFileSync(path.join(src, "index.html"), "utf8")
  .replace("/*STYLE*/", () => style.outputFiles[0].text)
  .replace("/*SCRIPT*/", () => js);
if (/https?:\/\/[^"'\s]*\.(js|css|woff2?)/.test(html.replace(/\/\*[\s\S]*?\*\//g, ""))) throw new Error("the page refers to a file on the network");
fs.writeFileSync(page, html);
