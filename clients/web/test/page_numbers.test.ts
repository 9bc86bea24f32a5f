// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: why a picture is empty, and what lies under the pointer.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

test("an empty picture says why, and a button takes the cause away", () => run({ hash: "#volume=vessels&range=240:245&clip=0,0,0,1,1,1" }, async ({ page, mock }) => {
  mock.reasons = [
    { reason: "range", detail: "no voxel has a value from 240 to 245", change: { range: "auto" } },
    { reason: "clip", detail: "the clip box leaves nothing", change: { clip: "none" } },
  ];
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await changeAndSettle(page, () => page.check("#lit"));
  assert.equal(await page.innerText("#empty-title"), "Nothing lies in this range");
  assert.match(await page.innerText("#empty-detail"), /240 to 245; the clip box/);
  assert.deepEqual(await page.locator("#empty-remedies button").allInnerTexts(), ["Reset the range", "Remove the cut"]);
  await screenshot(page, "empty");
  mock.reasons = [];
  await changeAndSettle(page, () => page.click("text=Reset the range"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [10, 250]);
  assert.equal(await page.isVisible("#empty"), false, "it shows something again");
}));

test("a camera that sees nothing is reset", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const home = mock.views[0]?.["eye"];
  mock.reasons = [{ reason: "camera", detail: "the volume lies outside the picture", change: { eye: "auto", target: "auto", up: "auto" } }];
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  mock.reasons = [];
  await changeAndSettle(page, () => page.click("text=Reset the camera"));
  assert.deepEqual(mock.views.at(-1)?.["eye"], home);
}));

test("what was said is of the place the pointer rests at: it goes when the pointer goes on", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.hit = [50.25, 60, 70.5];
  await page.mouse.move(300, 300);
  await page.waitForSelector("#probe:not([hidden])");
  await page.mouse.move(301, 301);
  assert.equal(await page.isVisible("#probe"), true, "a hand trembles");
  mock.pickDelayMs = 700;
  await page.mouse.move(500, 400);
  await page.waitForTimeout(300);
  assert.equal(await page.isVisible("#probe"), false, "it is not of this place");
  await page.waitForSelector("#probe:not([hidden])");
  // An answer that comes while the pointer is on its way is of no place.
  const asked = mock.picks.length;
  await page.mouse.move(300, 300);
  for (let i = 0; i < 100 && mock.picks.length === asked; i++) await page.waitForTimeout(20);
  assert.equal(mock.picks.length, asked + 1);
  for (let i = 0; i < 30; i++) {
    await page.mouse.move(400 + 5 * i, 400);
    assert.equal(await page.isVisible("#probe"), false);
    await page.waitForTimeout(30);
  }
}));

test("what lies under the pointer is said once it rests", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.hit = [50.25, 60, 70.5];
  await page.mouse.move(300, 300);
  await page.mouse.move(310, 305);
  await page.waitForSelector("#probe:not([hidden])");
  assert.equal(await page.innerText("#probe"), "50.3, 60, 70.5 mm · voxel 50, 60, 70 · 42");
  assert.equal(mock.picks.length, 1, "one question for a pointer that rests");
  assert.match(mock.picks[0] ?? "", /&x=310&y=305$/);
  await screenshot(page, "probe");
  // The picture turns: what was said is asked again.
  mock.hit = null;
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  await page.waitForTimeout(300);
  assert.equal(await page.isVisible("#probe"), false, "nothing is there now");
  assert.equal(mock.picks.length, 2);
}));

test("a finger that rests asks what is under it, though it trembles, and one that goes does not", () => run({ phone: true }, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.hit = [50.25, 60, 70.5];
  const touch = await page.context().newCDPSession(page);
  const send = (type: "touchStart" | "touchMove" | "touchEnd", points: readonly (readonly [number, number])[]) =>
    touch.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const picksBefore = mock.picks.length;
  await send("touchStart", [[150, 300]]);
  await send("touchMove", [[151, 301]]);
  await page.waitForSelector("#probe:not([hidden])");
  await send("touchEnd", []);
  await page.waitForTimeout(400);
  const picks = mock.picks.length;
  assert.ok(picks > picksBefore);
  await send("touchStart", [[150, 300]]);
  await send("touchMove", [[180, 320]]);
  await page.waitForTimeout(700);
  await send("touchEnd", []);
  assert.equal(mock.picks.length, picks);
}));
