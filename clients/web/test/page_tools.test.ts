// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: volumes to choose from, cube, scale, badge, saving.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { changeAndSettle, chooseVolume, dragThumb, readAddress, waitForFinal } from "./browser";
import { kVolumes, run, screenshot } from "./page_run";

test("a volume that was open comes back as it was left", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.25));
  await changeAndSettle(page, () => page.check("#lit"));
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await waitForFinal(page);
  assert.deepEqual([mock.views.at(-1)?.["range"], mock.views.at(-1)?.["lit"]], [[10, 250], true], "its own range, the same look");
  await chooseVolume(page, "fossil");
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  await waitForFinal(page);
  assert.deepEqual(mock.views.at(-1)?.["range"], [70, 250]);
}));

test("a face of the cube is a standard view, and the scale bar has the volume's unit", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.deepEqual(await page.locator("#axes g[visibility=visible]").evaluateAll((all) => all.map((face) => face.getAttribute("aria-label"))), ["Look from +x", "Look from +y", "Look from +z"]);
  assert.match(await page.innerText("#scale-text"), /^\d+ mm$/);
  await changeAndSettle(page, () => page.click("#axes g[aria-label='Look from +x']"));
  const { eye, up } = mock.views.at(-1) ?? {};
  assert.deepEqual([(eye as number[])[1], (eye as number[])[2], up ?? [0, 1, 0]], [40, 64, [0, 1, 0]]);
  await changeAndSettle(page, () => page.keyboard.press("3"));
  assert.deepEqual((mock.views.at(-1)?.["eye"] as number[])[0], 48);
  await changeAndSettle(page, () => page.check("#ortho"));
  assert.ok(Number(mock.views.at(-1)?.["ortho"]) > 0);
  assert.equal(mock.views.at(-1)?.["fov"], undefined);
  await page.check("#show-box");
  await screenshot(page, "box");
  const inked = await page.evaluate(() => {
    const scene = document.getElementById("scene") as HTMLCanvasElement;
    return scene.getContext("2d")?.getImageData(0, 0, scene.width, scene.height).data.some((value) => value > 0);
  });
  assert.equal(inked, true);
  await changeAndSettle(page, () => page.uncheck("#ortho"));
  assert.equal(mock.views.at(-1)?.["fov"], 40);
}));

test("volumes are searched, shown small, and chosen by keys", () => run({ volumes: [...kVolumes, ...["a", "b", "c", "d"].map((id) => ({ id, state: "ready", type: "u8" }) as const)] }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#picker-list").isVisible(), false);
  assert.match(await page.innerText("#picker-button"), /fossil of the mock/);
  assert.equal(mock.images.length, 0, "nothing is drawn small that nobody looks at");
  await page.focus("#picker-button");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelectorAll(".thumbnail[src]").length >= 4);
  assert.ok(mock.images.every((query) => /size=64x64/.test(query)));
  await screenshot(page, "picker");
  await page.keyboard.type("vess mock");
  assert.deepEqual(await page.locator("#volumes li:visible .volume-name").allInnerTexts(), ["vessels of the mock"]);
  await page.fill("#volume-search", "nothing");
  assert.equal(await page.locator("#volume-none").isVisible(), true);
  await page.fill("#volume-search", "vess");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  assert.equal(await page.locator("#picker-list").isVisible(), false, "it closes once one is chosen");
}));

test("a picture is saved in the size asked for, and taken elsewhere as text", () => run({ hash: "#volume=vessels" }, async ({ page, port }) => {
  await waitForFinal(page);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await readAddress(page);
  await page.click("#save-button");
  await page.check("input[name=size][value=double]");
  await page.selectOption("#save-samples", "16");
  await page.check("#save-transparent");
  await screenshot(page, "save");
  const link = (): Promise<string> => page.locator("#save-link").evaluate((save) => (save as HTMLAnchorElement).href);
  const query = new URL(await link()).searchParams;
  assert.deepEqual([query.get("size"), query.get("samples"), query.get("background")], ["2272x1800", "16", "00000000"]);
  const copied = async (kind: string): Promise<string> => {
    await page.click(`[data-copy=${kind}]`);
    await page.waitForSelector(`[data-copy=${kind}].done`);
    return page.evaluate(() => navigator.clipboard.readText());
  };
  assert.equal(await copied("curl"), `curl '${await link()}' -o vessels.png`);
  assert.match(await copied("cli"), new RegExp(`^blockwalk render 'http://127.0.0.1:${port}/#volume=vessels&eye=.*&samples=16' -o vessels.png --size 2272x1800$`));
  assert.match(await copied("python"), /urlopen/);
  assert.equal(await copied("link"), page.url());
  await page.check("input[name=size][value='4k']");
  assert.equal(new URL(await link()).searchParams.get("size"), "3840x3042");
}));

test("a scale bar stands in the picture that is saved, of a round length", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await waitForFinal(page);
  const address = await readAddress(page);
  await page.click("#save-button");
  await page.check("#save-bar");
  const saved = page.waitForEvent("download");
  await page.click("#save-link");
  const download = await saved;
  assert.equal(download.suggestedFilename(), "vessels.png");
  const picture = readFileSync(await download.path()).toString("base64");
  const [width, height, white] = await page.evaluate(async (base64) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    if (context === null) throw new Error("no canvas");
    context.drawImage(bitmap, 0, 0);
    const row = Math.round(bitmap.height - 0.033 * Math.min(bitmap.width, bitmap.height));
    const { data } = context.getImageData(0, row, bitmap.width, 1);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) count += data.slice(i, i + 4).every((value) => value > 250) ? 1 : 0;
    return [bitmap.width, bitmap.height, count] as const;
  }, picture);
  assert.deepEqual([width, height], [1136, 900]);
  assert.ok(white > 0.05 * width && white <= 0.2 * width, `${white}`);
  const [eye, target] = ["eye", "target"].map((name) => (address.get(name) ?? "").split(",").map(Number));
  const distance = Math.hypot(...(eye ?? []).map((value, axis) => value - (target?.[axis] ?? 0)));
  const length = (white * 2 * distance * Math.tan((20 * Math.PI) / 180)) / height;
  const mantissa = length / 10 ** Math.floor(Math.log10(length) + 0.01);
  assert.ok([1, 2, 5].some((round) => Math.abs(mantissa / round - 1) < 2 / white), `${length}`);
  assert.equal(await page.locator("#save").isVisible(), false, "it closes once it is saved");
}));

test("the badge says what a person sees, and tells once it has settled", () => run({}, async ({ page }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#figures").isVisible(), false);
  await page.click("#badge");
  assert.match(await page.innerText("#figures"), /CPU/);
  await page.evaluate(() => {
    new MutationObserver((changes) => document.body.dataset["told"] = String(Number(document.body.dataset["told"] ?? 0) + changes.length))
      .observe(document.getElementById("announcer") as HTMLElement, { childList: true });
  });
  for (let i = 0; i < 6; i++) await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(1800);
  assert.ok(Number((await page.getAttribute("body", "data-told")) ?? 0) <= 1);
  assert.equal(await page.textContent("#announcer"), "Full quality");
}));
