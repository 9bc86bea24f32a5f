// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: measures and marks on slices and in 3D, and the view in words.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

const kSlice = { hash: "#volume=vessels&slices=y" };
const canvasOf = (kind: string): string => `.slice[data-slice=${kind}] canvas`;
const choose = (page: Page, tool: string): Promise<void> => page.check(`input[name=tool][value=${tool}]`);
const values = (page: Page): Promise<string[]> => page.locator(".mark-value").allInnerTexts();

// CSS pixels of places of the slice y = 40: x, and z in the world.
async function placer(page: Page): Promise<(x: number, z: number) => readonly [number, number]> {
  await page.waitForSelector(".slice[data-slice=y][data-settled=true]");
  const box = await page.locator(canvasOf("y")).boundingBox();
  assert.ok(box);
  const unit = 1.06 * Math.max(96 / box.width, 128 / box.height);
  return (x, z) => [box.x + box.width / 2 + (x - 48) / unit, box.y + box.height / 2 + (z - 64) / unit];
}

test("a distance is dragged or clicked, and thick voxels count as what they are", () => run(kSlice, async ({ page }) => {
  const at = await placer(page);
  await choose(page, "ruler");
  await page.mouse.move(...at(20, 20));
  await page.mouse.down();
  await page.mouse.move(...at(40, 50), { steps: 4 });
  await page.mouse.move(...at(60, 50), { steps: 4 });
  await page.mouse.up();
  await page.waitForSelector("#mark-list li");
  // 40 along x; 30 along z, which is 15 voxels of 2: 50.
  const dragged = Number.parseFloat((await values(page))[0] ?? "");
  assert.ok(Math.abs(dragged - 50) < 0.5, `${dragged} mm`);
  await page.mouse.click(...at(10, 100));
  await page.mouse.click(...at(10, 120));
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
  assert.ok(Math.abs(Number.parseFloat((await values(page))[1] ?? "") - 20) < 0.5);
  await screenshot(page, "measure");
  assert.match((await readAddress(page)).get("marks") ?? "", /^ruler:ffb454:.*;ruler:7fd1c4:/);
  await page.click("[aria-label='Delete Distance 1']");
  assert.equal((await values(page)).length, 1);
  await page.focus(canvasOf("y"));
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
}));

test("angle, length of a line and area, ended by a double click or by keys", () => run(kSlice, async ({ page }) => {
  const at = await placer(page);
  await choose(page, "angle");
  for (const [x, z] of [[30, 20], [30, 60], [70, 60]] as const) await page.mouse.click(...at(x, z));
  await choose(page, "line");
  for (const [x, z] of [[10, 10], [40, 10]] as const) await page.mouse.click(...at(x, z));
  await page.mouse.dblclick(...at(40, 50));
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
  await choose(page, "area");
  for (const [x, z] of [[20, 70], [60, 70], [60, 100], [20, 100]] as const) await page.mouse.click(...at(x, z));
  await page.keyboard.press("Shift+Enter");
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 3);
  const [angle = NaN, line = NaN, area = NaN] = (await values(page)).map(Number.parseFloat);
  assert.ok(Math.abs(angle - 90) < 1 && Math.abs(line - 70) < 1 && Math.abs(area - 1200) < 25, `${angle} ${line} ${area}`);
  await screenshot(page, "measures");
  await choose(page, "line");
  await page.mouse.click(...at(10, 10));
  await page.keyboard.press("Escape");
  await page.mouse.click(...at(50, 50));
  assert.equal((await values(page)).length, 3, "what was left is not kept");
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.click("#marks-copy");
  await page.waitForSelector("#marks-copy.done");
  const rows = (await page.evaluate(() => navigator.clipboard.readText())).trim().split("\n");
  assert.equal(rows.length, 4);
  assert.match(rows[3] ?? "", /^3,area,,1[12]\d\d\.\d+,mm²,/);
}));

test("with keys alone a distance is as long as the voxels the crosshair went", () => run(kSlice, async ({ page }) => {
  await placer(page);
  await choose(page, "ruler");
  await page.focus(canvasOf("y"));
  await page.keyboard.press("Enter");
  for (let i = 0; i < 3; i++) await page.keyboard.press("ArrowRight");
  for (let i = 0; i < 2; i++) await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#mark-list li");
  assert.deepEqual(await values(page), ["5 mm"], "3 voxels of 1 and 2 voxels of 2");
}));

test("the tools come and go by a key, and slices keep them", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await waitForFinal(page);
  await page.keyboard.press("m");
  await page.waitForSelector("#view-bar:not([hidden])");
  await choose(page, "area");
  await page.keyboard.press("m");
  await page.waitForSelector("#view-bar", { state: "hidden" });
  await page.keyboard.press("s");
  await page.keyboard.press("m");
  assert.equal(await page.evaluate(() => (document.activeElement as HTMLInputElement).value), "crosshair", "the tool that was chosen is left with the tools");
  assert.equal(await page.isVisible(".slice[data-slice=z]"), true);
}));

test("in 3D a point is what the pixel shows, and turning sets none", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.keyboard.press("m");
  await choose(page, "ruler");
  await waitForFinal(page);
  mock.hit = [10, 20, 30];
  await page.mouse.click(400, 400);
  await page.waitForTimeout(200);
  await page.mouse.move(500, 400);
  await page.mouse.down();
  await page.mouse.move(560, 420, { steps: 3 });
  await page.mouse.up();
  mock.hit = [10, 24, 33];
  await page.mouse.click(600, 420);
  await page.waitForSelector("#mark-list li");
  assert.deepEqual(await values(page), ["5 mm"]);
  const inked = await page.evaluate(() => {
    const scene = document.getElementById("marks-scene") as HTMLCanvasElement;
    return scene.getContext("2d")?.getImageData(0, 0, scene.width, scene.height).data.some((value) => value > 0);
  });
  assert.equal(inked, true, "it is drawn over the picture");
  await screenshot(page, "measure-3d");
  mock.hit = null;
  await page.mouse.click(300, 300);
  await page.mouse.click(310, 300);
  await page.waitForTimeout(300);
  assert.equal((await values(page)).length, 1, "where nothing is there is no point");
}));

test("texts are typed, coloured, saved to a file and loaded from it", () => run(kSlice, async ({ page }) => {
  const at = await placer(page);
  await choose(page, "text");
  await page.mouse.click(...at(30, 30));
  await page.waitForFunction(() => document.activeElement?.classList.contains("mark-text"));
  await page.keyboard.press("Control+a");
  await page.keyboard.type("left; cyst");
  await choose(page, "box");
  await page.mouse.move(...at(50, 50));
  await page.mouse.down();
  await page.mouse.move(...at(80, 90), { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
  await screenshot(page, "annotations");
  const marks = (await readAddress(page)).get("marks") ?? "";
  assert.match(marks, /^text:ffb454:[^;]*:left%3B%20cyst;box:/);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#marks-save")]);
  assert.equal(download.suggestedFilename(), "vessels-marks.json");
  const saved = JSON.parse(await readFile(await download.path(), "utf8")) as { marks: { text: string }[] };
  assert.deepEqual(saved.marks.map(({ text }) => text), ["left; cyst", ""]);
  await page.click("#marks-clear");
  assert.equal(await page.isVisible("#mark-none"), true);
  await page.setInputFiles("#marks-file", await download.path());
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
  assert.equal((await readAddress(page)).get("marks"), marks);
  await page.setInputFiles("#marks-file", { name: "other.json", mimeType: "application/json", buffer: Buffer.from("{\"type\":\"else\"}") });
  await page.waitForSelector(".toast");
  assert.match(await page.locator(".toast").innerText(), /other\.json could not be read[\s\S]*file\.type/);
}));

test("a box that is dragged is seen on the slice it was drawn on, and is as deep as the slab", async () => {
  for (const [slab, y0, y1] of [["", 40, 41], ["&slab=4", 39, 43]] as const) {
    await run({ hash: `#volume=vessels&slices=y${slab}` }, async ({ page }) => {
      const at = await placer(page);
      await choose(page, "box");
      await page.mouse.move(...at(20, 30));
      await page.mouse.down();
      await page.mouse.move(...at(50, 90), { steps: 4 });
      await page.mouse.move(...at(80, 90), { steps: 4 });
      await page.mouse.up();
      await page.waitForSelector("#mark-list li");
      const [, numbers = ""] = /^box:ffb454:([^:]*)/.exec((await readAddress(page)).get("marks") ?? "") ?? [];
      const [ax = 0, ay = 0, az = 0, bx = 0, by = 0, bz = 0] = numbers.split(",").map(Number);
      const isNear = (a: number, b: number): boolean => Math.abs(a - b) < 0.3;
      assert.ok(isNear(ax, 20) && isNear(bx, 80) && isNear(az, 30) && isNear(bz, 90), numbers);
      assert.ok(Math.abs(Math.min(ay, by) - y0) < 0.01 && Math.abs(Math.max(ay, by) - y1) < 0.01, `y ${ay} to ${by} is the slab's ${y0} to ${y1}`);
      // The pointer is elsewhere, so what is orange on the slice is the box: four sides as long as they are here.
      const [[left, top], [right, bottom]] = [at(20, 30), at(80, 90)];
      const count = await page.locator(canvasOf("y")).evaluate((node) => {
        const canvas = node as HTMLCanvasElement;
        const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
        let orange = 0;
        for (let i = 0; i < data.length; i += 4) if (Math.abs((data[i] ?? 0) - 0xff) + Math.abs((data[i + 1] ?? 0) - 0xb4) + Math.abs((data[i + 2] ?? 0) - 0x54) < 60) ++orange;
        return orange;
      });
      const round = 2 * (right - left) + 2 * (bottom - top);
      assert.ok(count > 0.8 * round && count < 4 * round, `${count} pixels of a line of ${round}`);
    });
  }
});

test("a mark is seen in the slices it lies in alone", () => run({ hash: "#volume=vessels&slices=z&marks=ruler:00ff00:10,10,65,80,10,65" }, async ({ page }) => {
  await page.waitForSelector(".slice[data-slice=z][data-settled=true]");
  const greens = (): Promise<number> => page.locator(canvasOf("z")).evaluate((node) => {
    const canvas = node as HTMLCanvasElement;
    const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (data[i] === 0 && data[i + 1] === 255 && data[i + 2] === 0) ++count;
    return count;
  });
  assert.ok((await greens()) > 200);
  await page.focus(canvasOf("z"));
  await page.keyboard.press("PageDown");
  await page.waitForFunction(() => /^33 /.test(document.querySelector(".slice[data-slice=z] .slice-text")?.textContent ?? ""));
  await page.waitForTimeout(100);
  assert.equal(await greens(), 0);
}));

test("the page says when marks are too long for the address", () => run(kSlice, async ({ page }) => {
  await placer(page);
  const marks = Array.from({ length: 60 }, (_, i) => ({ kind: "point", color: "ffffff", text: "a place with a long name", points: [[i, 1.25, 2.5]] }));
  await page.setInputFiles("#marks-file", { name: "many.json", mimeType: "application/json", buffer: Buffer.from(JSON.stringify({ type: "blockwalk-marks", version: 1, marks })) });
  await page.waitForSelector("#marks-too-long:not([hidden])");
  assert.equal((await readAddress(page)).get("marks"), null);
}));

test("the view is said in words, by a key and by a button", () => run({ hash: "#volume=vessels&slices=z&mode=mip" }, async ({ page }) => {
  await page.waitForSelector(".slice[data-slice=z][data-settled=true]");
  await page.waitForFunction(() => document.getElementById("badge")?.textContent === "Full quality");
  await page.keyboard.press("d");
  await page.waitForFunction(() => document.getElementById("summary")?.textContent !== "");
  assert.match(await page.innerText("#summary"), /^vessels of the mock, 96 × 80 × 64 voxels\. Drawn: the largest value along each ray\..*Slices: z slice, slice 32 of 0–63 · z 64 mm\. Picture: Full quality\.$/);
  assert.equal(await page.getAttribute("#summary", "role"), "status");
  await screenshot(page, "summary");
  await page.keyboard.press("Escape");
  assert.equal(await page.isVisible("#summary-card"), false);
  await page.click("#summary-button"); // beside a slice that is alone
  await page.waitForSelector("#summary-card:not([hidden])");
}));
