// SPDX-License-Identifier: Apache-2.0
// The page in each of its states, in both themes, looked at by axe-core: it finds nothing. Then with a theme that was chosen,
// with a person's own colours, and with less motion.

import assert from "node:assert/strict";
import { test } from "node:test";
import axe from "axe-core";
import type { Page } from "playwright-core";
import { changeAndSettle, partOf, waitForFinal } from "./browser";
import type { ListedVolume } from "./mock_server";
import { kCells, kVolumes, run, screenshot, type Run } from "./page_run";

// `areForced`: colours are the person's, and axe reads the page's, which nobody sees.
async function check(page: Page, state: string, areForced = false): Promise<void> {
  await page.waitForTimeout(300); // what glides has arrived: half-transparent text has another contrast
  await page.evaluate(axe.source);
  const found = await page.evaluate(async (isContrast) => {
    const { violations } = await (window as unknown as { axe: typeof axe }).axe.run({ rules: { "color-contrast": { enabled: isContrast } } });
    return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html.slice(0, 160)} (${failureSummary})`).join("; ")}`);
  }, !areForced);
  assert.deepEqual(found, [], state);
}

// A slice alone covers the picture in 3D.
async function settledSlices(page: Page): Promise<void> {
  await page.waitForSelector("#stage[data-stream=live][data-final=true]", { state: "attached" });
  await page.waitForFunction(() => [...document.querySelectorAll(".slice:not([hidden])")].every((slice) => slice.getAttribute("data-settled") === "true"));
}

const kMarks = "ruler:ffb454:10,10,64,60,10,64:across;text:7fd1c4:20,40,64:a%2520note;area:ff8fa3:30,30,64,50,30,64,50,50,64";
const kFilm: readonly ListedVolume[] = [{ id: "film", state: "ready", type: "u16", steps: 5 }];
const kOrgans: readonly ListedVolume[] = [{ id: "organs", state: "ready", type: "u8", labels: 200 }];
const states: Readonly<Record<string, readonly [options: Parameters<typeof run>[0], act: (run: Run) => Promise<unknown>]>> = {
  "a volume of colours": [{}, async ({ page }) => waitForFinal(page)],
  "without the panel": [{}, async ({ page }) => {
    await waitForFinal(page);
    await page.keyboard.press("p");
  }],
  "a scalar volume": [{ hash: "#volume=vessels" }, async ({ page }) => {
    await waitForFinal(page);
    await page.click("#advanced summary");
    await page.click("#badge");
  }],
  channels: [{ volumes: kCells }, async ({ page }) => {
    await waitForFinal(page);
    await page.click(partOf(1, "summary"));
    await page.uncheck(partOf(2, ".channel-head input"));
    await page.fill(partOf(0, ".value-lo"), "none");
    await page.keyboard.press("Enter");
  }],
  labels: [{ volumes: kOrgans }, async ({ page }) => {
    await waitForFinal(page);
    await page.locator(".label-row input").first().uncheck();
    await page.locator(".label-scroller").evaluate((scroller) => { scroller.scrollTop = 900; });
  }],
  "steps in time": [{ volumes: kFilm }, async ({ page }) => waitForFinal(page)],
  "the editor": [{ hash: "#volume=vessels" }, async ({ page }) => {
    await waitForFinal(page);
    await page.click(".edit-transfer");
    await page.fill("#tf-opacity", "7");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#tf-fault:not([hidden])");
  }],
  "what cuts, and bookmarks": [{}, async ({ page }) => {
    await waitForFinal(page);
    await page.check("#cut-handles");
    await page.check("#show-box");
    for (let i = 0; i < 2; i++) await changeAndSettle(page, () => page.click("#plane-add"));
    await page.click("#bookmark-add");
  }],
  slices: [{ hash: "#volume=vessels&slices=all" }, async ({ page }) => settledSlices(page)],
  "a slice alone": [{ hash: "#volume=vessels&slices=z&slab=5:mean" }, async ({ page }) => settledSlices(page)],
  marks: [{ hash: `#volume=vessels&slices=z&marks=${kMarks}` }, async ({ page }) => {
    await settledSlices(page);
    await page.check("#tool-choice input[value=ruler]", { force: true });
    await page.waitForSelector("#mark-list li:nth-child(3)");
    await page.locator("#marks-title").scrollIntoViewIfNeeded();
  }],
  "two views side by side": [{ hash: "#volume=vessels&beside=volume%3Dfossil" }, async ({ page }) => {
    await waitForFinal(page);
    await page.waitForSelector("#beside[data-final=true]");
    await page.locator("#beside-tools").scrollIntoViewIfNeeded();
  }],
  "the view in words": [{ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
    await settledSlices(page);
    await page.keyboard.press("d");
    await page.waitForSelector("#summary:not(:empty)");
  }],
  "the list of volumes": [{}, async ({ page }) => {
    await waitForFinal(page);
    await page.click("#picker-button");
    await page.waitForFunction(() => document.querySelectorAll(".thumbnail[src]").length >= 2);
  }],
  help: [{}, async ({ page }) => {
    await waitForFinal(page);
    await page.keyboard.press("h");
  }],
  saving: [{}, async ({ page }) => {
    await waitForFinal(page);
    await page.waitForTimeout(400);
    await page.click("#save-button");
  }],
  "a problem": [{ hash: "#volume=fossil&range=9:3&colour=red" }, async ({ page }) => {
    await waitForFinal(page);
    await page.waitForSelector(".toast");
  }],
  "an empty picture": [{}, async ({ page, mock }) => {
    await waitForFinal(page);
    mock.reasons = [{ reason: "range", detail: "No density lies in the range.", change: { range: "auto" } }];
    await changeAndSettle(page, () => page.check("#lit"));
    await page.waitForSelector("#empty:not([hidden])");
  }],
  "no volumes": [{ volumes: [] }, async ({ page }) => void (await page.waitForSelector("#overlay:has-text('No volumes yet')"))],
  loading: [{ volumes: [{ id: "fossil", state: "loading", type: "u8" }] }, async ({ page }) => void (await page.waitForSelector("#overlay:has-text('Loading')"))],
  "a volume that failed": [{ hash: "#volume=broken" }, async ({ page }) => void (await page.waitForSelector("#overlay:has-text('could not be loaded')"))],
  "a lost connection": [{}, async ({ page, mock }) => {
    await waitForFinal(page);
    await mock.stop();
    await page.waitForSelector("#overlay:has-text('Reconnecting')");
  }],
  "a phone": [{ phone: true }, async ({ page }) => waitForFinal(page)],
  "a phone with its sheet": [{ phone: true, volumes: [...kOrgans, ...kVolumes] }, async ({ page }) => {
    await waitForFinal(page);
    await page.click("#sheet-handle", { position: { x: 20, y: 20 } });
  }],
  "a phone with a slice": [{ phone: true, hash: `#volume=vessels&slices=z&marks=${kMarks}` }, async ({ page }) => {
    await settledSlices(page);
    await page.click("#sheet-handle", { position: { x: 20, y: 20 } });
    await page.waitForTimeout(400);
    await page.locator("#marks-title").scrollIntoViewIfNeeded();
  }],
  "a phone with the editor": [{ phone: true, hash: "#volume=vessels" }, async ({ page }) => {
    await waitForFinal(page);
    await page.click("#sheet-handle", { position: { x: 20, y: 20 } });
    await page.waitForTimeout(400);
    await page.click(".edit-transfer");
    await screenshot(page, "transfer-phone");
  }],
};

for (const [state, [options, act]] of Object.entries(states)) {
  test(`axe-core finds nothing: ${state}`, () => run(options, async (running) => {
    await act(running);
    for (const colorScheme of ["dark", "light"] as const) {
      await running.page.emulateMedia({ colorScheme });
      await check(running.page, `${state}, ${colorScheme}`);
      await screenshot(running.page, `${colorScheme}-${state.replaceAll(/\W+/g, "-")}`);
    }
  }));
}

test("the theme that is chosen overrides the system's, also when the page is opened again", () => run({}, async ({ page }) => {
  const isLight = (): Promise<boolean> => page.evaluate(() => getComputedStyle(document.querySelector("#panel") as Element).backgroundColor === "rgb(255, 255, 255)");
  const frame = (): Promise<string | null> => page.getAttribute("meta[name=theme-color]", "content");
  await waitForFinal(page);
  assert.equal(await isLight(), false);
  const dark = await frame();
  await page.emulateMedia({ colorScheme: "light" });
  assert.equal(await isLight(), true, "as the system");
  // The page hears of the system's change with its next picture.
  await page.waitForFunction(() => document.querySelector("meta[name=theme-color]")?.getAttribute("content") === "rgb(255, 255, 255)");
  await page.keyboard.press("h");
  await page.selectOption("#theme", "dark");
  assert.equal(await isLight(), false);
  assert.equal(await frame(), dark);
  await page.reload();
  await waitForFinal(page);
  assert.equal(await isLight(), false, "it is kept");
  await page.keyboard.press("h");
  assert.equal(await page.inputValue("#theme"), "dark");
  await page.selectOption("#theme", "light");
  await page.emulateMedia({ colorScheme: "dark" });
  assert.equal(await isLight(), true);
  await page.selectOption("#theme", "system");
  assert.equal(await isLight(), false);
  await page.reload();
  await waitForFinal(page);
  await page.emulateMedia({ colorScheme: "light" });
  assert.equal(await isLight(), true, "the system's again");
}));

test("what floats over the picture is the same in both themes", () => run({ volumes: kFilm }, async ({ page }) => {
  await waitForFinal(page);
  await page.waitForTimeout(300); // the badge's colour glides
  const colours = (): Promise<readonly string[]> => page.evaluate(() =>
    ["#tools", "#readout", "#badge", "#time-bar", "#time-label", "#time-rate", "#scale-bar", "#probe"].map((selector) => {
      const { color, backgroundColor } = getComputedStyle(document.querySelector(selector) as Element);
      return `${selector} ${color} ${backgroundColor}`;
    }));
  const dark = await colours();
  await page.emulateMedia({ colorScheme: "light" });
  await page.waitForTimeout(300);
  assert.deepEqual(await colours(), dark);
}));

test("with a person's own colours what is chosen still shows, and so do points and bars", () => run({ volumes: kOrgans }, async ({ page }) => {
  await page.emulateMedia({ forcedColors: "active" });
  await waitForFinal(page);
  await check(page, "forced colours", true);
  const style = (selector: string, property: string, pseudo?: string): Promise<string> =>
    page.locator(selector).first().evaluate((element, [name, part]) => getComputedStyle(element, part).getPropertyValue(name ?? ""), [property, pseudo] as const);
  assert.notEqual(await style(".segments input:checked + span", "outline-style"), "none");
  assert.equal(await style(".segments input:not(:checked) + span", "outline-style"), "none");
  assert.equal(await style(".switches input", "appearance"), "auto");
  assert.equal(await style(".label-colour", "forced-color-adjust"), "none");
  assert.notEqual(await style(".label-colour", "background-color"), await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
  assert.equal(await style(".swatch.slate", "background-color"), "rgb(28, 35, 43)", "what is chosen by its colour has it");
  // Over a picture, which is black, a person's dark text would not show.
  await page.emulateMedia({ forcedColors: "active", colorScheme: "light" });
  assert.equal(await style("#scale-line", "border-bottom-color"), "rgb(255, 255, 255)");
  await screenshot(page, "forced-colours");
}));

test("with a person's own colours slices have theirs, and what is pressed shows", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
  await page.emulateMedia({ forcedColors: "active", colorScheme: "light" });
  await settledSlices(page);
  await check(page, "forced colours, slices", true);
  const style = (selector: string, property: string, pseudo?: string): Promise<string> =>
    page.locator(selector).first().evaluate((element, [name, part]) => getComputedStyle(element, part).getPropertyValue(name ?? ""), [property, pseudo] as const);
  assert.equal(await style(".slice-bar", "border-bottom-color"), "rgb(255, 255, 255)");
  assert.equal(await style(".slice:not([hidden])", "border-right-color"), "rgb(128, 128, 128)");
  assert.notEqual(await style("#slices-button", "outline-style"), "none");
  assert.equal(await style("#undo-button", "outline-style"), "none");
  const colours = await page.locator(".slice:not([hidden]) .slice-title").evaluateAll((all) => all.map((title) => getComputedStyle(title, "::before").backgroundColor));
  assert.equal(new Set(colours).size, 3);
  // The histogram shows through the range, and the two differ.
  assert.match(await style(".range-band", "background-color"), /, 0\)$/);
  assert.notEqual(await style(".histogram.lit path", "fill"), await style(".histogram path", "fill"));
  await screenshot(page, "forced-colours-slices");
}));

test("with a person's own colours the editor's points keep theirs", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await page.emulateMedia({ forcedColors: "active" });
  await waitForFinal(page);
  await page.click(".edit-transfer");
  await check(page, "forced colours, editor", true);
  const colours = await page.locator(".tf-point").evaluateAll((all) => all.map((point) => getComputedStyle(point, "::after").backgroundColor));
  assert.equal(new Set(colours).size, 3);
  await screenshot(page, "forced-colours-editor");
}));

test("where less motion is asked for nothing glides", () => run({}, async ({ page, mock }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await waitForFinal(page);
  const moving = await page.evaluate(() => [...document.querySelectorAll("*")].filter((element) => Math.max(...getComputedStyle(element).transitionDuration.split(",").map(parseFloat)) > 0.001).length);
  assert.equal(moving, 0);
  mock.refused = { member: "lit", value: true };
  await page.click("#lit"); // it goes back at once
  await page.waitForSelector(".toast");
  assert.equal(await page.locator(".toast").evaluate((toast) => getComputedStyle(toast).animationName), "none");
  await page.emulateMedia({ reducedMotion: "no-preference" });
  assert.notEqual(await page.locator(".toast").evaluate((toast) => getComputedStyle(toast).animationName), "none", "and where not, it does");
}));
