// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: what is cut away, by sliders, by handles in the picture, by planes.

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { changeAndSettle, readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

const thumb = (axis: number, end: string): string => `.cut-row:nth-child(${axis + 1}) .thumb.${end}`;
const press = (page: Page, key: string, times: number) => async (): Promise<void> => {
  for (let i = 0; i < times; i++) await page.keyboard.press(key);
};

test("a box is cut between thumbs, a voxel a step, with its length in the volume's unit", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.focus(thumb(0, "hi"));
  await changeAndSettle(page, press(page, "PageDown", 4));
  await page.focus(thumb(2, "lo"));
  await changeAndSettle(page, press(page, "ArrowRight", 3));
  assert.deepEqual(mock.views.at(-1)?.["clip"], [0, 0, 6, 56, 80, 128]);
  assert.deepEqual(await page.locator(".cut-output").allInnerTexts(), ["0 – 56", "0 – 80", "3 – 64"]);
  assert.deepEqual(await page.locator(".cut-output").evaluateAll((all) => all.map((one) => (one as HTMLElement).dataset["length"])), ["56 mm", "80 mm", "122 mm"]);
  assert.equal(await page.getAttribute(thumb(2, "lo"), "aria-valuetext"), "voxel 3, 6 mm");
  assert.equal((await readAddress(page)).get("clip"), "0,0,6,56,80,128");
  await page.focus(thumb(0, "lo"));
  await changeAndSettle(page, press(page, "End", 1));
  assert.deepEqual((mock.views.at(-1)?.["clip"] as number[])[0], 55, "a voxel stays");
  await changeAndSettle(page, () => page.click("#cut-reset"));
  assert.deepEqual([mock.views.at(-1)?.["clip"], mock.views.at(-1)?.["planes"]], ["none", undefined]);
}));

test("a face is dragged by its handle in the picture, along its axis", () => run({ hash: "#volume=fossil&eye=48,40,400&target=48,40,64&up=0,1,0" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator(".face-handle").first().isVisible(), false);
  await page.check("#cut-handles");
  assert.deepEqual(await page.locator(".face-handle").evaluateAll((all) => all.map((handle) => handle.checkVisibility())), [true, true, true, true, false, false], "what is seen end on has none");
  await screenshot(page, "cut-handles");
  const box = await page.locator(".face-handle.axis-x >> nth=1").boundingBox();
  assert.ok(box);
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  // The world at the depth of the faces' middle: the target's, at which 900 pixels are so high.
  const perPixel = (2 * 336 * Math.tan((20 * Math.PI) / 180)) / 900;
  await page.mouse.move(x, y);
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(x - 20 / perPixel, y + 30, { steps: 8 }));
  await page.mouse.up();
  assert.deepEqual(mock.views.at(-1)?.["clip"], [0, 0, 0, 76, 80, 128]);
  const moved = await page.locator(".face-handle.axis-x >> nth=1").boundingBox();
  assert.ok(moved && Math.abs(moved.x - box.x + 20 / perPixel) < 3, "it goes along with the face");
  assert.equal(mock.views.some((view) => "eye" in view && view !== mock.views[0]), false, "the camera stays");
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.notDeepEqual(mock.views.at(-1)?.["clip"], [0, 0, 0, 76, 80, 128], "it can be undone");
}));

test("planes are added up to six, turned, moved, flipped and removed", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const planes = (): readonly (readonly number[])[] => (Object.assign({}, ...mock.views)["planes"] ?? []) as number[][];
  await changeAndSettle(page, () => page.click("#plane-add"));
  const [x = 0, y = 0, z = 0, d = 0] = planes()[0] ?? [];
  assert.ok(Math.abs(x * 48 + y * 40 + z * 64 + d) < 1e-6, "through the middle");
  assert.ok(z < 0, "what is nearer is cut away");
  assert.equal(await page.inputValue(".plane select"), "own");
  await changeAndSettle(page, async () => void (await page.selectOption(".plane select", "z")));
  assert.deepEqual(planes(), [[0, 0, 1, -64]]);
  assert.equal(await page.innerText(".plane output"), "64 mm");
  await changeAndSettle(page, () => page.locator(".plane input").fill("125"));
  assert.deepEqual(planes(), [[0, 0, 1, -32]]);
  await changeAndSettle(page, () => page.click(".plane-flip"));
  assert.deepEqual(planes(), [[0, 0, -1, 32]]);
  assert.deepEqual([await page.innerText(".plane output"), await page.inputValue(".plane input")], ["32 mm", "125"], "it stays where it is");
  await changeAndSettle(page, () => page.locator(".plane input").fill("250"));
  assert.deepEqual(planes(), [[0, 0, -1, 64]]);
  for (let count = 2; count <= 6; count++) await changeAndSettle(page, () => page.click("#plane-add"));
  assert.equal(planes().length, 6);
  assert.equal(await page.isDisabled("#plane-add"), true);
  await screenshot(page, "planes");
  assert.equal((await readAddress(page)).get("planes")?.split(";").length, 6);
  await changeAndSettle(page, () => page.click(".plane:nth-child(1) .plane-remove"));
  assert.equal(planes().length, 5);
  assert.equal(await page.evaluate(() => document.activeElement?.getAttribute("aria-label")), "Remove plane 1", "the focus stays in the list");
  await changeAndSettle(page, () => page.click("#cut-reset"));
  assert.equal(mock.views.at(-1)?.["planes"], "none");
  assert.equal(await page.locator(".plane").count(), 0);
}));
