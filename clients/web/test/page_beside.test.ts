// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: a second view beside the first, with one camera.

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { refitted } from "../src/camera";
import { linkedLens } from "../src/link";
import { length, subtract, type Vec3 } from "../src/vector";
import type { Size } from "../src/view_state";
import { changeAndSettle, readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

const settled = (page: Page) => page.waitForSelector("#beside[data-final=true]");

test("another volume stands beside, and both turn as one", () => run({ hash: "#volume=vessels&mode=mip" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.selectOption("#beside-choice", "fossil");
  await settled(page);
  assert.equal(await page.innerText("#beside-title"), "fossil of the mock");
  const second = mock.views.filter((view) => view["extinction"] !== undefined || view["mode"] === "mip");
  assert.ok(second.length > 0);
  const [stage, beside] = [await page.locator("#stage").boundingBox(), await page.locator("#beside").boundingBox()];
  assert.ok(stage && beside && Math.abs(stage.x + stage.width - beside.x) < 2 && Math.abs(stage.width - beside.width) < 2, "side by side");
  mock.views.length = 0;
  await page.focus("#canvas");
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  await settled(page);
  const eyes = mock.views.flatMap((view) => (view["eye"] === undefined ? [] : [JSON.stringify(view["eye"])]));
  assert.deepEqual([eyes.length, new Set(eyes).size], [2, 1], "each was told the same camera");
  await screenshot(page, "beside");
  // The second one is turned by its own picture.
  mock.views.length = 0;
  await page.mouse.move(beside.x + 200, 400);
  await page.mouse.down();
  await page.mouse.move(beside.x + 260, 400, { steps: 2 });
  await page.mouse.up();
  await page.waitForTimeout(500);
  const last = mock.views.filter((view) => view["eye"] !== undefined).slice(-2).map((view) => JSON.stringify(view["eye"]));
  assert.equal(new Set(last).size, 1, "the first follows");
  await page.uncheck("#beside-linked");
  mock.views.length = 0;
  await page.focus("#canvas");
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  assert.equal(mock.views.filter((view) => view["eye"] !== undefined).length, 1, "each by itself");
  await page.click("#beside-close");
  await page.waitForSelector("#beside", { state: "hidden" });
  assert.equal((await readAddress(page)).get("beside"), null);
}));

test("the view as it was stands beside the one that is changed, in the address too, and they change places", () => run({ hash: "#volume=vessels&range=70:200" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.selectOption("#beside-choice", "=this");
  await settled(page);
  await changeAndSettle(page, () => page.check("input[name=mode][value=mip]"));
  const beside = (await readAddress(page)).get("beside") ?? "";
  assert.match(beside, /^volume=vessels&range=70:200&mode=blend&/);
  assert.doesNotMatch(beside, /eye=|up=/);
  mock.views.length = 0;
  await page.reload();
  await waitForFinal(page);
  await settled(page);
  assert.deepEqual(new Set(mock.views.map((view) => view["mode"]).filter((mode) => mode !== undefined)), new Set(["mip", "blend"]));
  await page.click("#beside-swap");
  await page.waitForTimeout(500);
  await waitForFinal(page);
  await settled(page);
  assert.equal(await page.isChecked("input[name=mode][value=blend]"), true);
  const address = await readAddress(page);
  assert.match(address.get("beside") ?? "", /mode=mip/);
  assert.equal(address.get("mode"), "blend");
  await page.keyboard.press("s");
  await page.waitForSelector("#beside", { state: "hidden" });
  await page.keyboard.press("s");
  await settled(page);
}));

test("when the window changes both fit it once, and nobody did anything that could be undone", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.focus("#canvas");
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft")); // a camera that nobody moved is framed anew
  await page.selectOption("#beside-choice", "=this");
  await settled(page);
  await waitForFinal(page);
  const vector = async (name: string): Promise<Vec3> => ((await readAddress(page)).get(name) ?? "").split(",").map(Number) as unknown as Vec3;
  const cameraNow = async () => ({ eye: await vector("eye"), target: await vector("target"), up: await vector("up") });
  const sizeNow = (): Size => (mock.views.filter((view) => view["size"] !== undefined).at(-1)?.["size"] ?? [0, 0]) as Size;
  for (const act of [() => page.keyboard.press("p"), () => page.setViewportSize({ width: 1200, height: 900 }), () => page.keyboard.press("p")]) {
    const [before, size] = [await cameraNow(), sizeNow()];
    mock.views.length = 0;
    await page.focus("#canvas");
    await act();
    await page.waitForTimeout(600);
    await settled(page);
    await waitForFinal(page);
    const [after, wanted] = [await cameraNow(), refitted(before, size, sizeNow())];
    assert.notDeepEqual(size, sizeNow());
    // The panes differ by the pixels of a border.
    const away = length(subtract(wanted.eye, wanted.target));
    assert.ok(length(subtract(after.eye, wanted.eye)) < 0.01 * away, `${after.eye} is not ${wanted.eye}`);
    assert.ok(length(subtract(after.eye, before.eye)) > 0.03 * away, "it is another size");
    assert.equal(new Set(mock.views.filter((view) => view["eye"] !== undefined).slice(-2).map((view) => JSON.stringify(view["eye"]))).size, 1, "one camera for both");
  }
  await page.click("#undo-button");
  await page.waitForSelector("#beside", { state: "hidden" }); // what was done last
}));

test("an address without a volume leaves nothing beside", () => run({ hash: "#volume=vessels&beside=volume%3Dfossil" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await settled(page);
  assert.equal(mock.streams, 2);
  await page.evaluate(() => (location.hash = "#volume=vessels&beside=mode%3Dmip"));
  await page.waitForSelector(".toast");
  assert.match(await page.innerText(".toast"), /What stands beside has no volume/);
  await page.waitForFunction(() => document.getElementById("beside")?.dataset["stream"] === "none");
  for (let i = 0; i < 50 && mock.streams > 1; i++) await page.waitForTimeout(50);
  assert.equal(mock.streams, 1, "the earlier one is left");
  assert.equal(await page.innerText("#beside-title"), "");
}));

test("volumes that lie far apart are seen the same way, each in its own size", () => {
  const lens = { camera: { eye: [0, 0, 100], target: [0, 0, 0], up: [0, 1, 0] }, ortho: 50, fovDegrees: 40 } as const;
  const placed = (min: Vec3, max: Vec3, space: string | null = null) => ({ worldBox: { min, max }, contentBox: { min, max }, space });
  const small = placed([-10, -10, -10], [10, 10, 10]);
  assert.deepEqual(linkedLens(lens, small, placed([-9, -9, -9], [12, 12, 12])), lens, "in one place they are compared in place");
  const away = linkedLens(lens, small, placed([1000, 0, 0], [1040, 40, 40]));
  assert.deepEqual([away.camera.target, away.camera.eye, away.ortho], [[1020, 20, 20], [1020, 20, 220], 100]);
  const speck = linkedLens(lens, small, placed([-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]));
  assert.deepEqual(speck.camera.eye.map((part) => Math.round(part * 1e9) / 1e9), [0, 0, 1]);
  // A patient in another program's axes is seen from the same side.
  const front = { camera: { eye: [5, -100, 0], target: [5, 0, 0], up: [0, 0, 1] }, ortho: null, fovDegrees: 40 } as const;
  const inRas = linkedLens(front, placed([-10, -10, -10], [10, 10, 10], "left-posterior-superior"), placed([-10, -10, -10], [10, 10, 10], "RAS"));
  assert.deepEqual(inRas.camera, { eye: [-5, 100, 0], target: [-5, 0, 0], up: [0, 0, 1] });
  const back = linkedLens(inRas, placed([-10, -10, -10], [10, 10, 10], "RAS"), placed([-10, -10, -10], [10, 10, 10], "left-posterior-superior"));
  assert.deepEqual(back.camera.eye, [5, -100, 0]);
  const unknown = linkedLens(front, placed([-10, -10, -10], [10, 10, 10], "RAS"), placed([-10, -10, -10], [10, 10, 10]));
  assert.deepEqual(unknown, front, "where one of them is no patient");
});
