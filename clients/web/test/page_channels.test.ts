// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: channels, their colours and contrasts.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, difference, dragThumb, partOf, readAddress, readPicture, waitForFinal } from "./browser";
import { kCells, run, screenshot } from "./page_run";

test("of several channels each has a row: drawn or not, colour, name and range", () => run({ volumes: kCells }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { channels, range, tf } = mock.views[0] ?? {};
  assert.deepEqual({ channels, range, tf }, { channels: [0, 1, 2], range: [[10, 250], [1010, 1250], [2010, 2250]], tf: undefined });
  assert.deepEqual(await page.locator(".channel-name").allInnerTexts(), ["nuclei", "membranes", "Channel 3"]);
  const colours = await page.locator(".channel-colour").evaluateAll((all) => all.map((well) => (well as HTMLInputElement).value));
  assert.deepEqual(colours, ["#00ff00", "#ff00ff", "#00ffff"]);
  assert.equal(await page.locator("#preset").isVisible(), false, "each channel has its own colours");
  await screenshot(page, "channels");
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.5, 1));
  assert.deepEqual(mock.views.at(-1)?.["range"], [[10, 250], [1130, 1250], [2010, 2250]]);
  assert.equal(await page.inputValue(partOf(1, ".value-lo")), "1130");
  assert.equal(await page.inputValue(partOf(0, ".value-lo")), "10");
  await page.fill(partOf(2, ".value-hi"), "none");
  await page.keyboard.press("Enter");
  assert.deepEqual(await page.locator(".channel .fault").evaluateAll((all) => all.map((fault) => fault.checkVisibility())), [false, false, true]);
  assert.equal((await readAddress(page)).get("range"), "10:250;1130:1250;2010:2250");
  assert.equal((await readAddress(page)).has("channels"), false);
}));

test("functions of several channels that are too long together have fewer points, which is said", () => {
  const tf = Array.from({ length: 1000 }, (_, i) => `${(i / 7).toFixed(6)}:${(0x100000 + 97 * i).toString(16)}:${((i % 50) / 77).toFixed(4)}`).join(",");
  return run({ volumes: kCells, hash: `#volume=cells&tf=${tf};${tf};${tf}` }, async ({ page, mock }) => {
    await waitForFinal(page);
    assert.match(await page.innerText(".toast"), /tf\s*The transfer functions are too long[\s\S]*28672 can be sent: nuclei has (\d+), membranes has \1,.* points now, evenly/);
    const sent = String(mock.views[0]?.["tf"]);
    assert.ok(sent.length <= 28672 && sent.length > 25000, `${sent.length}`);
    assert.equal((await readAddress(page)).get("tf"), sent);
    await page.keyboard.press("s");
    await page.waitForSelector(".slice[data-slice=z][data-settled=true]");
    assert.equal(mock.attempts, 1);
  });
});

test("each channel has a colour and a contrast, which are points in the view and come back", () => run({ volumes: kCells }, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.locator(partOf(1, ".channel-colour")).fill("#3366ff"));
  const [first, second, third] = String(mock.views.at(-1)?.["tf"]).split(";");
  assert.deepEqual([first, third], ["auto", "auto"]);
  assert.match(second ?? "", /^1000:[0-9a-f]{6}:0,1100:[0-9a-f]{6}:0.06,1255:3366ff:0.4$/);
  await page.click(partOf(1, "summary"));
  await page.fill(partOf(1, ".black-value"), "1100");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.match(String(mock.views.at(-1)?.["tf"]), /;1100:[0-9a-f]{6}:0,[^;]*,1255:3366ff:0.4;auto$/);
  await page.focus(partOf(1, ".white-point"));
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  assert.match(String(mock.views.at(-1)?.["tf"]), /,1250:3366ff:0.4;auto$/);
  await changeAndSettle(page, () => page.locator(partOf(1, ".opacity")).fill("1000"));
  assert.match(String(mock.views.at(-1)?.["tf"]), /:3366ff:1;auto$/);
  const tf = String(mock.views.at(-1)?.["tf"]);
  assert.equal((await readAddress(page)).get("tf"), tf);
  await page.reload();
  await waitForFinal(page);
  assert.equal(mock.views.at(-1)?.["tf"], tf);
  assert.equal(await page.inputValue(partOf(1, ".channel-colour")), "#3366ff");
  assert.equal(await page.inputValue(partOf(1, ".black-value")), "1100");
  await page.click(partOf(1, "summary"));
  await screenshot(page, "contrast");
  await changeAndSettle(page, () => page.click(partOf(1, ".auto-contrast")));
  const [black = 0, white = 0] = await Promise.all([".black-value", ".white-value"].map(async (part) => Number(await page.inputValue(partOf(1, part)))));
  assert.ok(black > 1010 && black < 1060 && white > 1150 && white < 1250, `${black}, ${white}`);
  await changeAndSettle(page, () => page.click(partOf(1, ".reset-contrast")));
  assert.equal(mock.views.at(-1)?.["tf"], "auto", "nothing of it is left");
}));

test("the range stretches colours, or only hides", () => run({ hash: "#volume=vessels&tf=viridis" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.isChecked("#stretch"), false);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.25));
  assert.equal(mock.views.at(-1)?.["tf"], undefined);
  await changeAndSettle(page, () => page.check("#stretch"));
  const window = (): readonly string[] => String(mock.views.at(-1)?.["tf"]).split(",").map((point) => point.split(":")[0] ?? "");
  assert.deepEqual([window().at(0), window().at(-1)], ["70", "250"]);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.25));
  assert.deepEqual([window().at(0), window().at(-1)], ["130", "250"]);
  assert.equal(await page.inputValue("#preset"), "viridis");
  await changeAndSettle(page, async () => void (await page.selectOption("#preset", "inferno")));
  assert.deepEqual([window().at(0), window().at(-1)], ["130", "250"], "other colours keep the contrast");
  await page.reload();
  await waitForFinal(page);
  assert.equal(await page.isChecked("#stretch"), true);
  await page.uncheck(".chip input", { force: true });
  await screenshot(page, "scalar");
}));

test("labels and voxels of their own colours have no contrast", () => run({}, async ({ page }) => {
  await waitForFinal(page);
  for (const part of [".contrast", ".colour-bar", ".black-point"]) assert.equal(await page.locator(partOf(0, part)).isVisible(), false);
  assert.equal(await page.locator("#stretch").isVisible(), false);
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
  await page.locator(partOf(1, ".channel-switch")).click({ force: true });
  await page.waitForTimeout(200);
  assert.deepEqual([await check(1).isChecked(), mock.views.length], [true, count]);
  assert.equal((await readAddress(page)).get("channels"), "1");
  const link = new URL(await page.locator("#save-link").evaluate((save) => (save as HTMLAnchorElement).href));
  assert.deepEqual([link.searchParams.get("channels"), link.searchParams.get("range")], ["1", "10:250;1010:1250;2010:2250"]);
  await changeAndSettle(page, () => check(2).check());
  assert.deepEqual([mock.views.at(-1)?.["channels"], await check(1).isEnabled()], [[1, 2], true]);
}));

test("the address restores channels, and says what the volume has not", () => run({ volumes: kCells, hash: "#volume=cells&channels=2,0&range=;1100:1200&tf=grey;grey;grey;grey" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { channels, range, tf } = mock.views[0] ?? {};
  assert.deepEqual({ channels, range, tf }, { channels: [0, 2], range: [[10, 250], [1100, 1200], [2010, 2250]], tf: undefined });
  assert.match(await page.innerText(".toast"), /tf: given for 4 channels/);
  await page.click(".toast button");
  await page.evaluate(() => { location.hash = "#volume=cells&channels=3"; });
  await page.waitForSelector(".toast:has-text('3 channels, from 0')");
  await changeAndSettle(page, () => page.evaluate(() => { location.hash = "#volume=cells&channels=1"; }));
  assert.deepEqual(mock.views.at(-1)?.["channels"], [1]);
  await changeAndSettle(page, () => page.evaluate(() => { location.hash = "#volume=cells&channels=all"; }));
  assert.deepEqual(mock.views.at(-1)?.["channels"], [0, 1, 2]);
}));

test("the rows of channels fit a phone", () => run({ volumes: kCells, phone: true }, async ({ page }) => {
  await waitForFinal(page);
  await page.tap("#sheet-handle", { position: { x: 20, y: 12 } });
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
