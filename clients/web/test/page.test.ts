// SPDX-License-Identifier: Apache-2.0
// The page in a browser against the mock server: everything that needs no real volume.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import {
  changeAndSettle, difference, drag, dragThumb, kDesktop, kPhone, launchBrowser, openPage, partOf, readAddress, readPicture, shareOtherThan, waitForFinal,
} from "./browser";
import { MockServer, type ListedVolume } from "./mock_server";

declare const PAGE_FOLDER: string; // where the build put the page

const kVolumes: readonly ListedVolume[] = [
  { id: "fossil", state: "ready", type: "rgba8" },
  { id: "vessels", state: "ready", type: "u8" },
  { id: "broken", state: "failed", type: "u8", error: "broken.bwv: chunk 3: wrong checksum" },
];
const kCells: readonly ListedVolume[] = [{ id: "cells", state: "ready", type: "u16", channelNames: ["nuclei", "membranes", ""] }];
let browser: Browser;
before(async () => { browser = await launchBrowser(); });
after(() => browser.close());

interface Run {
  readonly page: Page;
  readonly mock: MockServer;
  readonly port: number;
}

// One mock and one page a test; the page must have thrown nothing.
async function run(options: { volumes?: readonly ListedVolume[]; hash?: string; phone?: boolean }, body: (run: Run) => Promise<void>): Promise<void> {
  const mock = new MockServer(PAGE_FOLDER, options.volumes ?? kVolumes);
  const port = await mock.start();
  const viewport = options.phone ? kPhone : kDesktop;
  const { page, faults } = await openPage(browser, `http://127.0.0.1:${port}/${options.hash ?? ""}`, viewport, options.phone);
  try {
    await body({ page, mock, port });
    assert.deepEqual(faults, []);
  } finally {
    await page.context().close();
    await mock.stop();
  }
}

// For people who want to look: BLOCKWALK_SCREENSHOTS names a folder.
async function screenshot(page: Page, name: string): Promise<void> {
  const folder = process.env["BLOCKWALK_SCREENSHOTS"];
  if (folder === undefined) return;
  mkdirSync(folder, { recursive: true });
  await page.screenshot({ path: `${folder}/${name}.png` });
}

test("the page connects, shows the first volume and becomes lossless", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.05);
  assert.equal(await page.textContent("#badge"), "Lossless");
  assert.equal(await page.locator("#overlay").isVisible(), false);
  assert.deepEqual(mock.views[0]?.["size"], [1440 - 304, 900]);
  assert.match(await page.locator("#volumes .volume.failed").innerText(), /wrong checksum/);
  await screenshot(page, "desktop");
}));

test("every frame is acknowledged with its id", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => drag(page, 60, 20));
  await page.waitForTimeout(100);
  const ids = mock.views.map((view) => Number(view["id"]));
  assert.deepEqual(ids, [...ids].sort((a, b) => a - b));
  // one coarse frame a view, and a final one for those that stood still
  assert.deepEqual([...new Set(mock.acks)], ids);
  assert.ok(mock.acks.length > ids.length);
}));

test("a WebP frame is shown", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.tellFrame("webp", Buffer.from("UklGRhwAAABXRUJQVlA4TBAAAAAvAAAAAAdQwP5H/wMR0f8A", "base64")); // one pixel, ff8000
  await page.waitForFunction(() => document.getElementById("badge")?.textContent === "Final");
  const picture = await readPicture(page);
  const middle = 4 * (24 * 64 + 32);
  assert.deepEqual(picture.slice(middle, middle + 3), [255, 128, 0]);
}));

test("drag, wheel and keys move the camera, double click and r bring it back", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const home = await readPicture(page);
  const turn = (act: () => Promise<void>): Promise<void> => changeAndSettle(page, act);
  await turn(() => drag(page, 120, 30));
  assert.ok(difference(home, await readPicture(page)) > 0.05);
  assert.deepEqual(Object.keys(mock.views.at(-1) ?? {}).sort(), ["eye", "id", "type", "up"]);
  await turn(() => page.keyboard.press("r"));
  assert.ok(difference(home, await readPicture(page)) < 0.01);
  await turn(() => page.mouse.wheel(0, -400));
  assert.ok(difference(home, await readPicture(page)) > 0.05);
  await turn(() => page.dblclick("#canvas"));
  assert.ok(difference(home, await readPicture(page)) < 0.01);
  await turn(() => page.keyboard.press("ArrowLeft"));
  assert.ok(difference(home, await readPicture(page)) > 0.01);
  await page.mouse.move(500, 400);
  await page.mouse.down({ button: "right" });
  await turn(() => page.mouse.move(600, 420));
  assert.ok("target" in (mock.views.at(-1) ?? {}), "a right drag pans");
}));

test("the range follows thumbs, keys and number fields, and refuses nonsense", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const home = await readPicture(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.5));
  assert.ok(difference(home, await readPicture(page)) > 0.05);
  assert.deepEqual(mock.views.at(-1)?.["range"], [130, 250]);
  await page.focus(partOf(0, ".thumb.hi"));
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [130, 249]);
  const count = mock.views.length;
  await page.fill(partOf(0, ".value-lo"), "300");
  await page.keyboard.press("Enter");
  assert.match(await page.innerText(partOf(0, ".fault")), /must not be above/);
  await page.fill(partOf(0, ".value-lo"), "many");
  await page.keyboard.press("Enter");
  assert.match(await page.innerText(partOf(0, ".fault")), /number/);
  await screenshot(page, "range-fault");
  assert.equal(mock.views.length, count, "a bound that is refused is not sent");
  await page.fill(partOf(0, ".value-lo"), "42");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [42, 249]);
  assert.equal(await page.locator(partOf(0, ".fault")).isVisible(), false);
}));

test("mode, extinction and background are sent, and stand in the address", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.locator("#extinction").fill("900"));
  assert.equal(mock.views.at(-1)?.["extinction"], 4);
  await changeAndSettle(page, () => page.check("input[value=ffffff]"));
  await changeAndSettle(page, () => page.check("input[value=first-hit]"));
  assert.equal(await page.locator("#extinction").isVisible(), false, "only blending has an extinction");
  const address = await readAddress(page);
  assert.deepEqual([address.get("mode"), address.get("background"), address.get("extinction")], ["first-hit", "ffffff", "4"]);
  await screenshot(page, "white");
}));

test("what came with a member that is refused is sent again, without it", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.refusedMember = "background";
  await changeAndSettle(page, () => page.evaluate(() => {
    // both within one frame, so in one message
    for (const value of ["ffffff", "mip"]) document.querySelector<HTMLInputElement>(`input[value=${value}]`)?.click();
  }));
  const [refused, repeated] = mock.views.slice(-2);
  assert.deepEqual([refused?.["background"], refused?.["mode"]], ["ffffff", "mip"]);
  assert.deepEqual(Object.keys(repeated ?? {}).sort(), ["id", "mode", "type"]);
  assert.equal(repeated?.["mode"], "mip");
  assert.match(await page.innerText(".toast"), /not today/);
  const count = mock.views.length;
  await page.waitForTimeout(200);
  assert.equal(mock.views.length, count, "a refused member alone is not sent until it changes");
}));

test("light, smoothing and the surface's value are sent, and stand in the address", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#iso").isVisible(), false);
  await changeAndSettle(page, () => page.check("input[value=iso]"));
  await changeAndSettle(page, () => page.check("#smooth"));
  await changeAndSettle(page, () => page.check("#lit"));
  await changeAndSettle(page, () => page.locator("#iso").fill("250"));
  const { mode, filter, lit, iso } = Object.assign({}, ...mock.views) as Record<string, unknown>;
  assert.deepEqual({ mode, filter, lit, iso }, { mode: "iso", filter: "linear", lit: true, iso: 70 });
  const address = await readAddress(page);
  assert.deepEqual([address.get("filter"), address.get("lit"), address.get("iso")], ["linear", "on", "70"]);
  assert.equal(await page.locator("#preset").isVisible(), false, "colours are the volume's own");
  await screenshot(page, "surface");
}));

test("a scalar volume has no extinction, and the choice is in the address and the history", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.click("[data-volume=vessels]");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await waitForFinal(page);
  assert.equal("extinction" in (mock.views.at(-1) ?? {}), false);
  assert.equal(await page.locator("#extinction").isVisible(), false);
  await changeAndSettle(page, async () => void (await page.selectOption("#preset", "viridis")));
  assert.equal(mock.views.at(-1)?.["tf"], "viridis");
  assert.equal((await readAddress(page)).get("tf"), "viridis");
  assert.equal((await readAddress(page)).get("volume"), "vessels");
  await page.goBack();
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  await waitForFinal(page);
}));

test("the address restores the view", () => run({ hash: "#volume=fossil&eye=48,40,300&target=48,40,64&up=0,1,0&range=77:200&mode=blocks" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { eye, range, mode } = mock.views[0] ?? {};
  assert.deepEqual({ eye, range, mode }, { eye: [48, 40, 300], range: [77, 200], mode: "blocks" });
  assert.equal(await page.inputValue(partOf(0, ".value-lo")), "77");
  assert.equal(await page.isChecked("input[value=blocks]"), true);
  assert.equal((await readAddress(page)).get("eye"), "48,40,300");
}));

test("of several channels each has a row: drawn or not, colour, name and range", () => run({ volumes: kCells }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { channels, range, tf } = mock.views[0] ?? {};
  assert.deepEqual({ channels, range, tf }, { channels: [0, 1, 2], range: [[10, 250], [1010, 1250], [2010, 2250]], tf: undefined });
  assert.deepEqual(await page.locator(".channel-name").allInnerTexts(), ["nuclei", "membranes", "Channel 3"]);
  const swatches = await page.locator(".channel-swatch").evaluateAll((all) => all.map((swatch) => getComputedStyle(swatch).backgroundColor));
  assert.deepEqual(swatches, ["rgb(0, 255, 0)", "rgb(255, 0, 255)", "rgb(0, 255, 255)"]);
  assert.equal(await page.locator("#preset").isVisible(), false, "each channel has its own colours");
  await screenshot(page, "channels");
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.5, 1));
  assert.deepEqual(mock.views.at(-1)?.["range"], [[10, 250], [1130, 1250], [2010, 2250]]);
  assert.equal(await page.inputValue(partOf(1, ".value-lo")), "1130");
  assert.equal(await page.inputValue(partOf(0, ".value-lo")), "10");
  await page.fill(partOf(2, ".value-hi"), "none");
  await page.keyboard.press("Enter");
  assert.deepEqual(await page.locator(".fault").evaluateAll((all) => all.map((fault) => fault.checkVisibility())), [false, false, true]);
  assert.equal((await readAddress(page)).get("range"), "10:250;1130:1250;2010:2250");
  assert.equal((await readAddress(page)).has("channels"), false);
}));

test("channels are switched off and on, but never the last", () => run({ volumes: kCells }, async ({ page, mock }) => {
  await waitForFinal(page);
  const all = await readPicture(page);
  const check = (channel: number) => page.locator(partOf(channel, "input[type=checkbox]"));
  await changeAndSettle(page, () => page.check("input[value=iso]"));
  assert.equal(await page.innerText("#iso-title"), "Surface value of nuclei");
  await changeAndSettle(page, () => page.locator("#iso").fill("250"));
  await changeAndSettle(page, () => check(0).uncheck());
  const { channels, iso } = mock.views.at(-1) ?? {};
  assert.deepEqual({ channels, iso }, { channels: [1, 2], iso: "auto" }, "a value of the nuclei is none of the membranes");
  assert.equal(await page.innerText("#iso-title"), "Surface value of membranes");
  assert.equal(await page.innerText("#iso-value"), "1130");
  assert.ok(difference(all, await readPicture(page)) > 0.05);
  await changeAndSettle(page, () => check(2).uncheck());
  assert.deepEqual([await check(0).isEnabled(), await check(1).isEnabled()], [true, false]);
  const count = mock.views.length;
  await page.locator(partOf(1, ".channel-head")).click({ force: true });
  await page.waitForTimeout(200);
  assert.deepEqual([await check(1).isChecked(), mock.views.length], [true, count]);
  assert.equal((await readAddress(page)).get("channels"), "1");
  const link = new URL(await page.locator("#save-link").evaluate((save) => (save as HTMLAnchorElement).href));
  assert.deepEqual([link.searchParams.get("channels"), link.searchParams.get("range")], ["1", "10:250;1010:1250;2010:2250"]);
  await changeAndSettle(page, () => check(2).check());
  assert.deepEqual([mock.views.at(-1)?.["channels"], await check(1).isEnabled()], [[1, 2], true]);
}));

test("the address restores channels, and says what the volume has not", () => run({ volumes: kCells, hash: "#volume=cells&channels=2,0&range=;1100:1200&tf=viridis" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { channels, range, tf } = mock.views[0] ?? {};
  assert.deepEqual({ channels, range, tf }, { channels: [0, 2], range: [[10, 250], [1100, 1200], [2010, 2250]], tf: undefined });
  assert.match(await page.innerText(".toast"), /tf: viridis/);
  await page.click(".toast button");
  await page.evaluate(() => { location.hash = "#volume=cells&channels=3"; });
  await page.waitForSelector(".toast:has-text('3 channels, from 0')");
  await changeAndSettle(page, () => page.evaluate(() => { location.hash = "#volume=cells&channels=all"; }));
  assert.deepEqual(mock.views.at(-1)?.["channels"], [0, 1, 2]);
}));

test("the rows of channels fit a phone", () => run({ volumes: kCells, phone: true }, async ({ page }) => {
  await waitForFinal(page);
  await page.tap("#sheet-handle");
  await page.waitForTimeout(350);
  await screenshot(page, "phone-channels");
  for (const selector of [".channel-head", ".range-track", ".range-values"]) {
    const boxes = await page.locator(selector).evaluateAll((all) => all.map((box) => box.getBoundingClientRect()).map(({ left, right }) => ({ left, right })));
    assert.equal(boxes.length, 3);
    for (const box of boxes) assert.deepEqual(box, boxes[0], `${selector}: rows are aligned`);
    assert.ok(boxes[0] && boxes[0].left >= 0 && boxes[0].right <= 390, selector);
  }
  const head = await page.locator(".channel-head").first().boundingBox();
  assert.ok(head && head.height >= 44, "a finger hits it");
}));

test("what the address gets wrong is said, and the rest is shown", () => run({ hash: "#volume=fossil&range=9:3" }, async ({ page }) => {
  await waitForFinal(page);
  assert.match(await page.innerText(".toast"), /range/);
}));

test("a server that goes and comes back gets the whole view again", () => run({}, async ({ page, mock, port }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.25));
  const picture = await readPicture(page);
  await mock.stop();
  await page.waitForSelector("#overlay:has-text('Reconnecting')");
  await screenshot(page, "reconnecting");
  const again = new MockServer(PAGE_FOLDER, kVolumes);
  await again.start(port);
  try {
    await page.waitForSelector("#overlay", { state: "hidden" });
    await waitForFinal(page);
    assert.deepEqual(again.views[0]?.["range"], [70, 250]);
    assert.ok("eye" in (again.views[0] ?? {}) && "size" in (again.views[0] ?? {}));
    assert.ok(difference(picture, await readPicture(page)) < 0.01);
  } finally {
    await page.context().close();
    await again.stop();
  }
}));

test("a stream that is refused says why, and is tried again with growing pauses", () => run({ volumes: [] }, async ({ page, mock }) => {
  mock.refusal = { status: 429, title: "Too Many Requests", detail: "2 streams are open, as many as may be" };
  mock.volumes = kVolumes;
  await page.waitForSelector("#overlay:has-text('Too Many Requests')");
  await page.waitForSelector("#overlay:has-text('2 streams are open')");
  await screenshot(page, "refused");
  mock.refusal = { status: 503, title: "Service Unavailable", detail: "the server is ending" };
  await page.waitForSelector("#overlay:has-text('The server is ending')");
  const attempts = mock.attempts;
  await page.waitForTimeout(2000);
  assert.ok(mock.attempts - attempts <= 4, `${mock.attempts - attempts} attempts in 2 s`);
  mock.refusal = null;
  await waitForFinal(page);
  assert.equal(await page.locator("#overlay").isVisible(), false);
}));

test("a problem names its field and can be dismissed", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: "range: lo is above hi", field: "range" };
  mock.tell({ type: "error", id: 1, problem });
  mock.tell({ type: "error", id: 2, problem });
  await page.waitForSelector(".toast:has-text('×2')");
  assert.equal(await page.innerText(".toast code"), "range");
  await screenshot(page, "problem");
  await page.click(".toast button");
  assert.equal(await page.locator(".toast").count(), 0);
}));

test("no volumes, a loading one and a failed one are told apart", () => run({ volumes: [] }, async ({ page, mock }) => {
  await page.waitForSelector("#overlay:has-text('No volumes yet')");
  await screenshot(page, "empty");
  mock.volumes = [{ id: "fossil", state: "loading", type: "rgba8" }];
  await page.waitForSelector("#overlay:has-text('Loading fossil')");
  await screenshot(page, "loading");
  mock.volumes = [{ id: "fossil", state: "ready", type: "rgba8" }, { id: "broken", state: "failed", type: "u8", error: "wrong checksum" }];
  await waitForFinal(page);
  await page.click("[data-volume=broken]");
  await page.waitForSelector("#overlay:has-text('broken could not be loaded')");
  await page.click("[data-volume=fossil]");
  await page.waitForSelector("#overlay", { state: "hidden" });
}));

test("keys open the help and hide the panel, which gives its room to the picture", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.keyboard.press("?");
  await page.waitForSelector("#help[open]");
  await screenshot(page, "help");
  await page.keyboard.press("Escape");
  await changeAndSettle(page, () => page.keyboard.press("p"));
  assert.deepEqual(mock.views.at(-1)?.["size"], [1440, 900]);
  await page.waitForTimeout(300); // the panel slides
  await screenshot(page, "panel-hidden");
}));

test("on a phone the panel is a sheet, one finger orbits and two zoom", () => run({ phone: true }, async ({ page, mock }) => {
  await waitForFinal(page);
  await screenshot(page, "phone");
  const home = await readPicture(page);
  const touch = await page.context().newCDPSession(page);
  const send = (type: "touchStart" | "touchMove" | "touchEnd", points: readonly (readonly [number, number])[]) =>
    touch.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  await changeAndSettle(page, async () => {
    await send("touchStart", [[150, 300]]);
    await send("touchMove", [[230, 310]]);
    await send("touchEnd", []);
  });
  assert.ok(difference(home, await readPicture(page)) > 0.02);
  assert.equal("target" in (mock.views.at(-1) ?? {}), false);
  await changeAndSettle(page, async () => {
    await send("touchStart", [[150, 300], [250, 300]]);
    await send("touchMove", [[100, 300], [300, 300]]);
    await send("touchEnd", []);
  });
  const eye = (view: Record<string, unknown> | undefined): number => Math.hypot(...(view?.["eye"] as number[]));
  assert.ok(eye(mock.views.at(-1)) < eye(mock.views[0]), "spreading two fingers comes closer");
  await page.tap("#sheet-handle");
  await page.waitForTimeout(350);
  const sheet = await page.locator("#panel").boundingBox();
  assert.ok(sheet && sheet.y < 500 && sheet.y > 200, `the sheet stands at ${sheet?.y}`);
  await screenshot(page, "phone-sheet");
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true);
}));
