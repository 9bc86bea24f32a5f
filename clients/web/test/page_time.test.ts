// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: steps in time.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, chooseVolume, readAddress, waitForFinal } from "./browser";
import { kVolumes, run, screenshot } from "./page_run";

const kFilm = [{ id: "film", state: "ready", type: "u8", steps: 4 } as const, ...kVolumes];
type Views = readonly Record<string, unknown>[];
const times = (views: Views): readonly unknown[] => views.flatMap((view) => ("time" in view ? [view["time"]] : []));

test("a step is chosen by its slider and by keys, and is in the address", () => run({ volumes: kFilm }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.innerText("#time-label"), "1 of 4 · 0 s");
  await changeAndSettle(page, () => page.locator("#time-step").fill("2"));
  assert.equal(mock.views.at(-1)?.["time"], "2");
  assert.equal(await page.innerText("#time-label"), "3 of 4 · 1 s");
  assert.equal((await readAddress(page)).get("time"), "2");
  await page.focus("#canvas");
  await changeAndSettle(page, () => page.keyboard.press("."));
  assert.equal(mock.views.at(-1)?.["time"], "3");
  await page.keyboard.press("."); // the last stays
  await changeAndSettle(page, () => page.keyboard.press(","));
  assert.deepEqual(times(mock.views), ["2", "3", "2"]);
  assert.equal(await page.isDisabled("#undo-button"), true, "where one stands in time is no step of undo");
  await screenshot(page, "time");
  // A volume of one step has no bar.
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  assert.equal(await page.isVisible("#time-bar"), false);
  assert.equal(mock.views.at(-1)?.["time"], undefined);
}));

test("undo keeps the step, a link is the whole view, and a volume comes back in the window as it is", () => run({ volumes: kFilm }, async ({ page, mock }) => {
  await waitForFinal(page);
  await readAddress(page);
  const plain = await page.evaluate(() => location.hash);
  assert.match(plain, /volume=film/);
  await changeAndSettle(page, () => page.check("#lit"));
  await changeAndSettle(page, () => page.locator("#time-step").fill("2"));
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(await page.isChecked("#lit"), false);
  assert.equal(await page.inputValue("#time-step"), "2");
  await changeAndSettle(page, () => page.check("#lit"));
  await changeAndSettle(page, () => page.evaluate((hash) => { location.hash = `${hash}&mode=mip`; }, plain));
  await page.waitForFunction(() => (document.getElementById("time-step") as HTMLInputElement).value === "0");
  assert.equal(await page.isChecked("#lit"), false);
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await page.setViewportSize({ width: 900, height: 700 });
  await waitForFinal(page);
  await chooseVolume(page, "film");
  await page.waitForFunction(() => document.title.startsWith("film"));
  await waitForFinal(page);
  const canvas = await page.evaluate(() => { const { clientWidth, clientHeight } = document.getElementById("canvas") as HTMLCanvasElement; return [clientWidth, clientHeight]; });
  assert.deepEqual(mock.views.filter((view) => "size" in view).at(-1)?.["size"], canvas);
}));

test("an address opens at its step", () => run({ volumes: kFilm, hash: "#volume=film&time=3" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(mock.views[0]?.["time"], "3");
  assert.equal(await page.inputValue("#time-step"), "3");
}));

test("playing shows every step in order, around and around, until it is stopped", () => run({ volumes: kFilm }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.selectOption("#time-rate", "30");
  await page.focus("#canvas");
  await page.keyboard.press(" ");
  assert.equal(await page.getAttribute("#time-play", "aria-pressed"), "true");
  await page.waitForFunction(() => (document.getElementById("time-bar")?.classList.contains("playing") ?? false));
  const begun = Date.now();
  while (times(mock.views).length < 9 && Date.now() - begun < 10000) await page.waitForTimeout(20);
  await page.click("#time-play");
  assert.equal(await page.getAttribute("#time-play", "aria-pressed"), "false");
  assert.deepEqual(times(mock.views).slice(0, 9), ["1", "2", "3", "0", "1", "2", "3", "0", "1"], "none is left out");
  await waitForFinal(page);
  const count = mock.views.length;
  await page.waitForTimeout(200);
  assert.equal(mock.views.length, count, "it stands");
  await page.focus("#smooth");
  await page.keyboard.press(" ");
  assert.equal(await page.isChecked("#smooth"), true, "a control keeps its own use of the key");
  assert.equal(await page.getAttribute("#time-play", "aria-pressed"), "false");
}));
