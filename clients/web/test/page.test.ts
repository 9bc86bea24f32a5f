// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: the picture, its moves, and what is said when something is missing.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, chooseVolume, difference, drag, dragThumb, readPicture, shareOtherThan, waitForFinal } from "./browser";
import { MockServer } from "./mock_server";
import { kPageFolder, kVolumes, run, screenshot } from "./page_run";

test("the page connects, shows the first volume and gets its full quality", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.05);
  assert.equal(await page.textContent("#badge"), "Full quality");
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
  await page.waitForSelector("#stage[data-frame='1000']");
  const picture = await readPicture(page);
  const middle = 4 * (24 * 64 + 32);
  assert.deepEqual(picture.slice(middle, middle + 3), [255, 128, 0]);
}));

test("drag, wheel and keys move the camera, and r brings it back", () => run({}, async ({ page, mock }) => {
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
  await turn(() => page.keyboard.press("r"));
  assert.ok(difference(home, await readPicture(page)) < 0.01);
  await turn(() => page.keyboard.press("ArrowLeft"));
  assert.ok(difference(home, await readPicture(page)) > 0.01);
  await page.mouse.move(500, 400);
  await page.mouse.down({ button: "right" });
  await turn(() => page.mouse.move(600, 420));
  assert.ok("target" in (mock.views.at(-1) ?? {}), "a right drag pans");
}));

test("undo and redo go through the views, in steps of a person", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const home = await readPicture(page);
  assert.equal(await page.isDisabled("#undo-button"), true);
  await changeAndSettle(page, () => drag(page, 120, 30));
  await changeAndSettle(page, () => page.check("input[value=ffffff]"));
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(mock.views.at(-1)?.["background"], "000000");
  await changeAndSettle(page, () => page.click("#undo-button"));
  assert.ok(difference(home, await readPicture(page)) < 0.01, "a drag is one step");
  assert.equal(await page.isDisabled("#undo-button"), true);
  await changeAndSettle(page, () => page.keyboard.press("Control+Shift+Z"));
  assert.ok(difference(home, await readPicture(page)) > 0.05);
  await changeAndSettle(page, () => page.keyboard.press("r"));
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.ok(difference(home, await readPicture(page)) > 0.05, "resetting can be undone");
}));

test("a double click centres on what is there, and on nothing does nothing", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const count = mock.views.length;
  await page.dblclick("#canvas", { position: { x: 300, y: 300 } });
  await page.waitForTimeout(300);
  assert.equal(mock.views.length, count);
  assert.match(mock.picks.at(-1) ?? "", /^size=.*&x=300&y=300$/);
  mock.hit = [50, 60, 70];
  await changeAndSettle(page, () => page.dblclick("#canvas", { position: { x: 300, y: 300 } }));
  assert.deepEqual(mock.views.at(-1)?.["target"], [50, 60, 70]);
}));

test("zooming over the background keeps what is turned about", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.mouse.move(5, 890);
  await changeAndSettle(page, () => page.mouse.wheel(0, -400));
  assert.equal(mock.views.at(-1)?.["target"], undefined);
  assert.ok("eye" in (mock.views.at(-1) ?? {}));
}));

test("single keys can be turned off, and stay off", () => run({}, async ({ page }) => {
  await waitForFinal(page);
  await page.keyboard.press("h");
  await page.uncheck("#single-keys");
  await page.keyboard.press("Escape");
  await page.keyboard.press("p");
  await page.reload();
  await waitForFinal(page);
  await page.keyboard.press("p");
  assert.equal(await page.evaluate(() => document.body.classList.contains("panel-open")), true);
}));

test("a server that goes and comes back gets the whole view again", () => run({}, async ({ page, mock, port }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.25));
  const picture = await readPicture(page);
  await mock.stop();
  await page.waitForSelector("#overlay:has-text('Reconnecting')");
  await screenshot(page, "reconnecting");
  const again = new MockServer(kPageFolder, kVolumes);
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
  await chooseVolume(page, "broken");
  await page.waitForSelector("#overlay:has-text('broken could not be loaded')");
  await chooseVolume(page, "fossil");
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
  await page.tap("#sheet-handle", { position: { x: 20, y: 12 } });
  await page.waitForTimeout(350);
  const sheet = await page.locator("#panel").boundingBox();
  assert.ok(sheet && sheet.y < 500 && sheet.y > 200, `the sheet stands at ${sheet?.y}`);
  await screenshot(page, "phone-sheet");
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true);
}));
