// SPDX-License-Identifier: Apache-2.0
// Animate, in Save: what is asked of the server, how far it is, and what becomes of it.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { waitForFinal } from "./browser";
import { run } from "./page_run";

async function open(page: Page, frames: number): Promise<void> {
  await waitForFinal(page);
  await page.click("#save-button");
  await page.click("#animate summary");
  await page.fill("#animate-frames", String(frames));
}

type Body = Record<string, unknown> & { keys: Record<string, unknown>[]; view: Record<string, unknown>; turntable: Record<string, unknown> };

test("a turn is drawn by the server and saved, in the size and quality of the dialog", () => run({}, async ({ page, mock }) => {
  await open(page, 3);
  await page.selectOption("#animate-axis", "z");
  await page.selectOption("#save-samples", "16");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#animate-start")]);
  assert.equal(download.suggestedFilename(), "fossil.zip");
  const zip = await readFile(await download.path());
  assert.equal(zip.readUInt32LE(0), 0x04034b50);
  assert.equal(zip.readUInt16LE(zip.length - 12), 3, "it is whole");
  const asked = mock.animations.asked[0] as Body;
  assert.deepEqual([asked["frames"], asked["format"], asked.turntable], [3, "zip", { seconds: 4, axis: [0, 0, 1] }]);
  assert.equal(asked.view["samples"], "16");
  assert.ok(Array.isArray(asked["size"]) && !("size" in asked.view));
  assert.equal(await page.textContent("#animate-note"), "Saved");
  assert.equal(await page.isVisible("#animate-start"), true);
  await page.selectOption("#animate-format", "webp");
  const [webp] = await Promise.all([page.waitForEvent("download"), page.click("#animate-start")]);
  assert.equal(webp.suggestedFilename(), "fossil.webp");
}));

test("frames are counted, and cancelling ends it", () => run({}, async ({ page, mock }) => {
  mock.animations.stopAt = 2;
  await open(page, 9);
  await page.click("#animate-start");
  await page.waitForFunction(() => document.getElementById("animate-note")?.textContent === "2 of 9 frames");
  assert.deepEqual(await page.locator("#animate-progress").evaluate((bar) => [(bar as HTMLProgressElement).value, (bar as HTMLProgressElement).max]), [2, 9]);
  assert.equal(await page.isVisible("#animate-start"), false);
  await page.click("#animate-cancel");
  await page.waitForFunction(() => document.getElementById("animate-note")?.textContent === "Cancelled");
  for (let i = 0; i < 100 && mock.animations.abandoned === 0; i++) await page.waitForTimeout(20);
  assert.equal(mock.animations.abandoned, 1, "the server is told");
  assert.equal(await page.locator(".toast").count(), 0);
}));

test("what breaks off, or is refused, is said and not saved", () => run({}, async ({ page, mock }) => {
  mock.animations.breakAt = 2;
  await open(page, 9);
  let downloads = 0;
  page.on("download", () => ++downloads);
  await page.click("#animate-start");
  await page.waitForSelector(".toast:has-text('The animation broke off')");
  assert.equal(await page.isVisible("#animate-start"), true, "it can be tried again");
  mock.animations.refusal = { status: 429, detail: "as many animations are made as may" };
  await page.click("#animate-start");
  await page.waitForSelector(".toast:has-text('as many animations are made as may')");
  assert.equal(downloads, 0);
}));

test("bookmarks are the way, of which it takes two", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.click("#bookmark-add");
  await open(page, 4);
  await page.selectOption("#animate-what", "bookmarks");
  assert.equal(await page.isVisible("#animate-axis"), false);
  await page.click("#animate-start");
  assert.match((await page.textContent("#animate-note")) ?? "", /2 to 256 bookmarks of this volume; there is 1\./);
  assert.equal(mock.animations.asked.length, 0);
  await page.click("#save-close");
  await page.click("#bookmark-add");
  await page.click("#save-button");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#animate-start")]);
  assert.equal(download.suggestedFilename(), "fossil.zip");
  const { keys } = mock.animations.asked[0] as Body;
  assert.deepEqual(keys.map((key) => key["seconds"]), [0, 4]);
}));
