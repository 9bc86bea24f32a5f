// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: bookmarks.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { changeAndSettle, chooseVolume, drag, readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

test("a view is kept with its picture and a name, and gone back to after the page was closed", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.check("input[value=mip]"));
  const kept = (await readAddress(page)).toString();
  await page.click("#bookmark-add");
  assert.equal(await page.evaluate(() => document.activeElement?.getAttribute("aria-label")), "Name of View 1", "to be named at once");
  await page.keyboard.type("the claw");
  await page.keyboard.press("Enter");
  const size = await page.locator(".bookmark img").evaluate(async (image) => {
    await (image as HTMLImageElement).decode();
    return [(image as HTMLImageElement).naturalWidth, (image as HTMLImageElement).naturalHeight];
  });
  assert.deepEqual(size, [128, 96]);
  await changeAndSettle(page, () => page.check("input[value=mean]"));
  await changeAndSettle(page, () => drag(page, 90, 30));
  await page.reload();
  await waitForFinal(page);
  assert.equal(await page.inputValue(".bookmark input"), "the claw");
  await screenshot(page, "bookmarks");
  await changeAndSettle(page, () => page.click(".bookmark-go"));
  assert.equal((await readAddress(page)).toString(), kept);
  assert.equal(mock.views.at(-1)?.["mode"], "mip");
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(mock.views.at(-1)?.["mode"], "mean", "going there is a step of the one history");
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await waitForFinal(page);
  assert.equal(await page.locator(".bookmark").count(), 0);
  assert.equal(await page.innerText("#bookmark-note"), "1 more of other volumes.");
}));

test("bookmarks are saved, deleted, and loaded again; a broken file is refused by name", () => run({}, async ({ page }) => {
  await waitForFinal(page);
  assert.equal(await page.isDisabled("#bookmark-save"), true);
  await page.click("#bookmark-add");
  await page.click("#bookmark-add");
  assert.deepEqual(await page.locator(".bookmark input").evaluateAll((all) => all.map((one) => (one as HTMLInputElement).value)), ["View 1", "View 2"]);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#bookmark-save")]);
  const saved = await readFile(await download.path());
  assert.match(saved.toString(), /"view": "#volume=fossil&eye=/);
  await page.click(".bookmark:nth-child(1) .icon-button");
  assert.equal(await page.evaluate(() => document.activeElement?.getAttribute("aria-label")), "Delete View 2");
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "bookmark-add");
  const load = (name: string, buffer: Buffer): Promise<void> => page.setInputFiles("#bookmark-file", { name, mimeType: "application/json", buffer });
  await load("torn.json", saved.subarray(0, saved.length - 9));
  assert.match(await page.innerText(".toast"), /torn.json is not read[^]*expected JSON/);
  assert.equal(await page.locator(".bookmark").count(), 0);
  await load("views.json", saved);
  await page.waitForSelector(".bookmark:nth-child(2)");
}));

test("a browser that keeps nothing is told, and they last until the page is closed", () => run({}, async ({ page }) => {
  await page.addInitScript(() => Object.defineProperty(window, "localStorage", { get: () => { throw new DOMException("denied", "SecurityError"); } }));
  await page.reload();
  await waitForFinal(page);
  await page.click("#bookmark-add");
  assert.match(await page.innerText("#bookmark-note"), /keeps nothing for this page/);
  assert.equal(await page.locator(".bookmark").count(), 1);
}));
