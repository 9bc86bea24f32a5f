// SPDX-License-Identifier: Apache-2.0
// The page in headless Chromium against a daemon of its own: what it weighs, when the first picture is there, how long a
// picture takes to follow the pointer, and the longest time without one in a drag at twice the pixel density.
//
//   node bench/page.mjs --programs build/release --web build/release/web --runs 5 > page.json
//
// --programs has blockwalk and blockwalkd, --web is where the page was built (with node_modules). A picture counts as
// there when the canvas has it, which is when the page acknowledges it; the screen follows within one of its own frames.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { createServer } from "node:net";
import { cpus, loadavg, tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { parseArgs } from "node:util";
import { gzipSync } from "node:zlib";

const { values: options } = parseArgs({
  options: {
    programs: { type: "string" },
    web: { type: "string" },
    page: { type: "string", default: "" }, // folder of the page; else that of the daemon
    demo: { type: "string", default: "fossil" },
    size: { type: "string", default: "256" },
    runs: { type: "string", default: "5" },
    seconds: { type: "string", default: "4" }, // of a drag
    chromium: { type: "string", default: "/usr/bin/chromium" },
  },
});
if (!options.programs || !options.web) throw new Error("--programs and --web must name folders");
const runs = Number(options.runs);
const seconds = Number(options.seconds);
if (!(Number.isInteger(runs) && runs >= 1 && runs <= 100)) throw new Error("--runs: 1 to 100");
if (!(seconds > 0 && seconds <= 60)) throw new Error("--seconds: above 0, at most 60");
const { chromium } = createRequire(join(resolve(options.web), "package.json"))("playwright-core");
const kFiles = ["index.html", "app.js", "style.css", "icon.svg"];
const kMoveMs = 1000 / 60;

async function freePort() {
  const probe = createServer();
  await new Promise((done) => probe.listen(0, "127.0.0.1", done));
  const { port } = probe.address();
  await new Promise((done) => probe.close(done));
  return port;
}

async function startDaemon(volume) {
  const port = await freePort();
  const more = options.page ? ["--web-root", resolve(options.page)] : [];
  const child = spawn(join(options.programs, "blockwalkd"), ["--listen", `127.0.0.1:${port}`, ...more, volume], { stdio: ["ignore", "ignore", "inherit"] });
  const address = `http://127.0.0.1:${port}/`;
  for (let waited = 0; waited < 600; waited++) {
    if (child.exitCode !== null) throw new Error(`blockwalkd ended with ${child.exitCode}`);
    if (await fetch(`${address}readyz`).then((answer) => answer.ok, () => false)) return { child, address };
    await new Promise((done) => setTimeout(done, 100));
  }
  throw new Error("blockwalkd is not ready after 60 s");
}

// In the page: when pointers moved, when views left and which pictures were drawn.
function watch() {
  const log = { moves: [], views: [], pictures: [], first: null, final: null };
  window.blockwalkLog = log;
  window.addEventListener("pointermove", (event) => log.moves.push(event.timeStamp), true);
  const { send } = WebSocket.prototype;
  WebSocket.prototype.send = function (data) {
    const message = JSON.parse(data);
    if (message.type === "view") log.views.push([message.id, performance.now()]);
    if (message.type === "ack") {
      log.first ??= performance.now();
      log.pictures.push([message.id, performance.now()]);
    }
    return send.call(this, data);
  };
  const final = setInterval(() => {
    if (document.getElementById("stage")?.dataset.final !== "true") return;
    log.final = performance.now();
    clearInterval(final);
  }, 5);
}

async function open(browser, address, viewport, deviceScaleFactor) {
  const context = await browser.newContext({ viewport, deviceScaleFactor });
  const page = await context.newPage();
  await page.addInitScript(watch);
  await page.goto(address);
  await page.waitForSelector("#stage[data-stream=live][data-final=true]", { timeout: 60000 });
  return page;
}

// Back and forth across the middle, 60 moves a second. Gives what the page noted meanwhile.
async function drag(page) {
  const box = await page.locator("#canvas").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.waitForTimeout(300);
  await page.evaluate(() => Object.assign(window.blockwalkLog, { moves: [], views: [], pictures: [] }));
  const begin = performance.now();
  for (let step = 1; performance.now() - begin < 1000 * seconds; step++) {
    await page.mouse.move(x + 150 * Math.sin(step / 20), y + 60 * Math.sin(step / 33));
    const wait = begin + step * kMoveMs - performance.now();
    if (wait > 0) await new Promise((done) => setTimeout(done, wait));
  }
  const log = await page.evaluate(() => structuredClone(window.blockwalkLog));
  await page.mouse.up();
  return log;
}

// Of each move until the first picture of a view that was sent after it.
function latencies({ moves, views, pictures }) {
  return moves.flatMap((moved) => {
    const view = views.find(([, at]) => at >= moved);
    const picture = view && pictures.find(([id]) => id >= view[0]);
    return picture ? [picture[1] - moved] : [];
  });
}

// From the first move to the first picture, and between pictures.
function longestGap({ moves, pictures }) {
  const times = [moves[0], ...pictures.map(([, at]) => at).filter((at) => at > moves[0])];
  return Math.max(...times.slice(1).map((at, i) => at - times[i]));
}

const sorted = (values) => [...values].sort((a, b) => a - b);
const quantile = (values, share) => sorted(values)[Math.min(values.length - 1, Math.floor(share * values.length))];
const median = (values) => (sorted(values)[Math.floor((values.length - 1) / 2)] + sorted(values)[Math.floor(values.length / 2)]) / 2;
const round = (value) => Math.round(10 * value) / 10;
const summary = (values) => ({ median: round(median(values)), runs: values.map(round) });

const folder = mkdtempSync(join(tmpdir(), "blockwalk-page-"));
let daemon;
let browser;
for (const signal of ["SIGINT", "SIGTERM"]) {
  process.once(signal, () => {
    daemon?.child.kill("SIGTERM");
    rmSync(folder, { recursive: true, force: true });
    process.exit(1);
  });
}
try {
  const volume = join(folder, `${options.demo}.bwv`);
  execFileSync(join(options.programs, "blockwalk"), ["demo", options.demo, "-o", volume, "--size", options.size], { stdio: ["ignore", "ignore", "inherit"] });
  daemon = await startDaemon(volume);
  browser = await chromium.launch({ executablePath: options.chromium, args: ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"] });
  const size = { bytes: 0, gzip_bytes: 0 };
  for (const file of kFiles) {
    const bytes = options.page ? readFileSync(join(options.page, file)) : Buffer.from(await (await fetch(daemon.address + file)).arrayBuffer());
    size.bytes += bytes.length;
    size.gzip_bytes += gzipSync(bytes, { level: 9 }).length;
  }
  const [first, final, latencyMedian, latencyP95, pictures, longest] = [[], [], [], [], [], []];
  for (let run = 0; run < runs; run++) {
    const page = await open(browser, daemon.address, { width: 1024, height: 768 }, 1);
    const log = await page.evaluate(() => structuredClone(window.blockwalkLog));
    first.push(log.first);
    final.push(log.final);
    const dragged = await drag(page);
    const waits = latencies(dragged);
    latencyMedian.push(quantile(waits, 0.5));
    latencyP95.push(quantile(waits, 0.95));
    pictures.push(dragged.pictures.length / seconds);
    await page.context().close();
    const dense = await open(browser, daemon.address, { width: 1400, height: 900 }, 2);
    longest.push(longestGap(await drag(dense)));
    await dense.context().close();
  }
  console.log(JSON.stringify({
    bench: "page",
    volume: `${options.demo} ${options.size}`,
    processors: `${cpus().length} x ${cpus()[0]?.model}`,
    chromium: browser.version(),
    runs,
    load: round(loadavg()[0]), // of all programs, in the last minute; above the number of processors the figures are of a busy machine
    page: size,
    first_picture_ms: summary(first),
    full_quality_ms: summary(final),
    pointer_to_picture_ms: { window: "1024x768", median: summary(latencyMedian), p95: summary(latencyP95), pictures_per_second: summary(pictures) },
    longest_without_picture_ms: { window: "1400x900 at twice the density", ...summary(longest) },
  }, null, 2));
} finally {
  await browser?.close();
  if (daemon !== undefined && daemon.child.exitCode === null) {
    const ended = new Promise((done) => daemon.child.once("exit", done));
    daemon.child.kill("SIGTERM");
    await ended;
  }
  rmSync(folder, { recursive: true });
}
