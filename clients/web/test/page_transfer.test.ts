// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: the editor of the transfer function.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import type { Page, Route } from "playwright-core";
import { changeAndSettle, kPatienceMs, partOf, readAddress, waitForFinal } from "./browser";
import { kCells, run, screenshot } from "./page_run";
import type { MockServer } from "./mock_server";
import { sampleCt } from "./sample_volume";

const kVessels = { hash: "#volume=vessels&tf=50:000000:0,100:ff0000:0.5,200:ffffff:1" };
const open = async (page: Page, channel = 0): Promise<void> => {
  await waitForFinal(page);
  await page.click(partOf(channel, ".edit-transfer"));
};
const tfOf = (mock: MockServer): string => String(Object.assign({}, ...mock.views)["tf"]);

test("points stand over the histogram and are dragged, added and deleted by pointer", () => run(kVessels, async ({ page, mock }) => {
  await open(page);
  await page.waitForFunction(() => document.querySelectorAll("#tf-presets canvas[data-drawn]").length === 5);
  await screenshot(page, "transfer");
  const plot = await page.locator("#tf-points").boundingBox();
  assert.ok(plot);
  const at = (value: number, opacity: number) => [plot.x + ((value - 10) / 240) * plot.width, plot.y + (1 - opacity) * plot.height] as const;
  await page.mouse.move(...at(100, 0.5));
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(...at(130, 0.8), { steps: 5 }));
  await page.mouse.up();
  const [, value = "", colour, opacity = ""] = /,([\d.]+):([0-9a-f]+):([\d.]+),/.exec(tfOf(mock)) ?? [];
  assert.equal(colour, "ff0000");
  assert.ok(Math.abs(Number(value) - 130) <= 1 && Math.abs(Number(opacity) - 0.8) < 0.01, tfOf(mock));
  await changeAndSettle(page, () => page.mouse.dblclick(...at(170, 0.2)));
  assert.equal(tfOf(mock).split(",").length, 4);
  assert.match(await page.innerText("#tf-which"), /3 of 4/);
  await changeAndSettle(page, () => page.click("#tf-remove"));
  assert.equal(tfOf(mock).split(",").length, 3);
  await changeAndSettle(page, () => page.click("#undo-button"));
  assert.equal(tfOf(mock).split(",").length, 4, "in the page's one history");
  assert.equal((await readAddress(page)).get("tf"), tfOf(mock));
}));

test("a point beyond the data is dragged in, and none is dragged out of the plot", () => run({ hash: "#volume=vessels&tf=50:000000:0,100:ff0000:0.5,490:ffffff:1" }, async ({ page, mock }) => {
  await open(page);
  const plot = await page.locator("#tf-points").boundingBox();
  assert.ok(plot);
  const last = (): number => Number(tfOf(mock).split(",").at(-1)?.split(":")[0]);
  await page.mouse.move(plot.x + plot.width, plot.y);
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(plot.x + plot.width / 2, plot.y, { steps: 10 }));
  assert.ok(Math.abs(last() - 250) <= 2, `half of 10 to 490, it is ${last()}`);
  await changeAndSettle(page, () => page.mouse.move(plot.x + plot.width + 300, plot.y, { steps: 10 }));
  assert.equal(last(), 490);
  await changeAndSettle(page, () => page.mouse.move(plot.x + plot.width / 2, plot.y, { steps: 10 }));
  await page.mouse.up();
  assert.equal(await page.locator("#tf-ticks").innerText().then((text) => text.split("\n").at(-1)), "250", "then the plot is as wide as it has to be");
}));

test("a point that goes while it is dragged lets go of the plot", () => run({ hash: "#volume=vessels&tf=50:000000:0,100:ff0000:0.5,200:ffffff:1" }, async ({ page, mock }) => {
  await open(page);
  const plot = await page.locator("#tf-points").boundingBox();
  assert.ok(plot);
  const at = (value: number, opacity: number) => [plot.x + ((value - 10) / 240) * plot.width, plot.y + (1 - opacity) * plot.height] as const;
  await changeAndSettle(page, () => page.mouse.dblclick(...at(230, 0.5)));
  await page.mouse.move(...at(230, 0.5));
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(...at(220, 0.3), { steps: 4 }));
  await changeAndSettle(page, async () => {
    await page.keyboard.press("Control+z");
    await page.keyboard.press("Control+z");
  });
  assert.equal(tfOf(mock).split(",").length, 3, "it was the last of four");
  await page.mouse.up();
  const ticks = (): Promise<string | undefined> => page.locator("#tf-ticks").innerText().then((text) => text.split("\n").at(-1));
  assert.equal(await ticks(), "250");
  await changeAndSettle(page, () => page.evaluate(() => void (location.hash = "#volume=vessels&tf=50:000000:0,100:ff0000:0.5,490:ffffff:1")));
  assert.equal(await ticks(), "490", "the plot is as wide as it has to be");
}));

test("points are moved, added, deleted and told by keys alone", () => run(kVessels, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.focus(partOf(0, ".edit-transfer"));
  await page.keyboard.press("Enter");
  const told = (): Promise<string | null> => page.evaluate(() => `${document.activeElement?.getAttribute("aria-label")}: ${document.activeElement?.getAttribute("aria-valuetext")}`);
  assert.equal(await told(), "Point 1 of 3: value 50, opacity 0, colour #000000");
  await changeAndSettle(page, () => page.keyboard.press("Insert"));
  assert.equal(tfOf(mock), "50:000000:0,75:800000:0.25,100:ff0000:0.5,200:ffffff:1");
  assert.match((await told()) ?? "", /^Point 2 of 4: value 75/);
  for (const [key, tf] of [["ArrowRight", "76:800000:0.25"], ["ArrowUp", "76:800000:0.26"], ["PageDown", "76:800000:0.16"], ["Shift+ArrowLeft", "66:800000:0.16"]] as const) {
    await changeAndSettle(page, () => page.keyboard.press(key));
    assert.equal(tfOf(mock).split(",")[1], tf, key);
  }
  await changeAndSettle(page, () => page.keyboard.press("Delete"));
  assert.equal(tfOf(mock), "50:000000:0,100:ff0000:0.5,200:ffffff:1");
  await page.keyboard.press("End");
  assert.match((await told()) ?? "", /^Point 3 of 3/);
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(tfOf(mock).split(",").length, 4);
  await page.keyboard.press("Escape");
  assert.equal(await page.locator("#tf-editor").isVisible(), false);
  assert.equal(await page.evaluate(() => document.activeElement?.className), "edit-transfer icon-button", "the focus goes back");
}));

test("value, opacity and colour are typed exactly, and what cannot be is said", () => run(kVessels, async ({ page, mock }) => {
  await open(page);
  await page.click("#tf-after");
  assert.equal(await page.inputValue("#tf-value"), "100");
  await page.fill("#tf-value", "123.4567891");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  await page.fill("#tf-opacity", "0,125");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  await changeAndSettle(page, () => page.fill("#tf-colour", "#00ff00"));
  assert.equal(tfOf(mock), "50:000000:0,123.4567891:00ff00:0.125,200:ffffff:1");
  for (const [id, text, fault] of [["#tf-value", "500", /between its neighbours: 50 to 200/], ["#tf-value", "x", /Type a value/], ["#tf-opacity", "2", /from 0 to 1/]] as const) {
    await page.fill(id, text);
    await page.keyboard.press("Enter");
    assert.match(await page.innerText("#tf-fault"), fault);
    assert.equal(await page.getAttribute(id, "aria-invalid"), "true");
    await page.fill(id, id === "#tf-value" ? "123" : "0.5");
    await page.keyboard.press("Enter");
    assert.equal(await page.locator("#tf-fault").isVisible(), false);
  }
}));

test("presets are pictures of this view, two asked for at once, and none once it is closed", () => run({ volumes: kCells }, async ({ page, mock }) => {
  await waitForFinal(page);
  let most = 0;
  const held: Route[] = []; // questions that wait for their answer
  await page.route(/image\?.*size=88x66/, (route) => {
    held.push(route);
    most = Math.max(most, held.length);
  });
  const until = async (isSo: () => boolean | Promise<boolean>): Promise<void> => {
    for (const end = Date.now() + kPatienceMs; !(await isSo()); ) {
      assert.ok(Date.now() < end, "it did not come");
      await page.evaluate(() => new Promise(requestAnimationFrame));
    }
  };
  const answerAll = async (): Promise<void> => {
    for (let answered = 0; answered < 5; answered++) {
      await until(() => held.length === Math.min(2, 5 - answered));
      await held.shift()?.continue();
    }
    await until(async () => (await page.locator("#tf-presets canvas[data-drawn]").count()) === 5);
  };
  await page.click(partOf(1, ".edit-transfer"));
  assert.equal(await page.innerText("#tf-title"), "Transfer function of membranes");
  await answerAll();
  assert.equal(most, 2);
  const asked = mock.images.map((query) => new URLSearchParams(query));
  assert.ok(asked.every((query) => query.get("channels") === "1" && query.get("tf")?.startsWith("auto;") !== false));
  await changeAndSettle(page, () => page.click("#tf-presets [data-preset=inferno]"));
  assert.match(tfOf(mock), /^auto;inferno;auto$/);
  assert.equal(await page.getAttribute("[data-preset=inferno]", "aria-pressed"), "true");
  await page.click("#tf-close");
  // Closed while two are on their way: those are given up, and the next that is asked for is of the next channel.
  const channels: (string | null)[] = [];
  page.on("request", (request) => {
    const query = new URL(request.url()).searchParams;
    if (query.get("size") === "88x66") channels.push(query.get("channels"));
  });
  let left = 0;
  page.on("requestfailed", () => left++);
  await page.click(partOf(2, ".edit-transfer"));
  await until(() => held.length === 2);
  await page.click("#tf-close");
  await until(() => left === 2);
  held.length = 0;
  await page.click(partOf(0, ".edit-transfer"));
  await answerAll();
  assert.deepEqual(channels, ["2", "2", "0", "0", "0", "0", "0"]);
}));

test("functions are saved and loaded, as are those of others, and a broken file is named", () => run(kVessels, async ({ page, mock }) => {
  await open(page);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#tf-save")]);
  assert.equal(download.suggestedFilename(), "vessels_of_the_mock-tf.json");
  const saved = await readFile(await download.path());
  const load = (name: string, buffer: Buffer): Promise<void> => page.setInputFiles("#tf-file", { name, mimeType: "application/octet-stream", buffer });
  await changeAndSettle(page, () => load("ramp.lut", Buffer.from(Array.from({ length: 768 }, (_, i) => i % 256))));
  assert.equal(tfOf(mock).split(",").length, 256);
  assert.match(await page.innerText("#tf-note"), /ramp.lut: 256 points/);
  await screenshot(page, "transfer-lut");
  await changeAndSettle(page, () => load("mine.json", saved));
  assert.equal(tfOf(mock), "50:000000:0,100:ff0000:0.5,200:ffffff:1");
  await load("torn.vp", Buffer.from("1\n1\n0.9\n"));
  assert.match(await page.innerText(".toast"), /torn.vp is not read[^]*ambient: expected a number, the file has no such line/);
  await load("huge.lut", Buffer.alloc((1 << 20) + 1));
  await page.waitForSelector(".toast:has-text('huge.lut'):has-text('at most 1048576')");
  assert.equal(tfOf(mock), "50:000000:0,100:ff0000:0.5,200:ffffff:1", "nothing of a broken file is taken");
}));

test("voxels of their own colours have no transfer function, and another volume closes the editor", () => run(kVessels, async ({ page }) => {
  await open(page);
  await page.evaluate(() => { location.hash = "#volume=fossil"; });
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  assert.equal(await page.locator("#tf-editor").isVisible(), false);
  assert.equal(await page.locator(partOf(0, ".edit-transfer")).isVisible(), false);
}));

const kCt = { volumes: [{ id: "abdomen", state: "ready", type: "u16", fields: sampleCt("abdomen") }] } as const;

test("of CT, whose own colours are by tissue, maps, one colour and the window are chosen, and the first colours come back", () => run(kCt, async ({ page, mock }) => {
  await waitForFinal(page);
  const chosen = (): Promise<string> => page.inputValue("#preset");
  const choose = (name: string): Promise<void> => changeAndSettle(page, async () => void (await page.selectOption("#preset", name)));
  assert.equal(await chosen(), "auto");
  for (const name of ["grey", "viridis", "cividis", "inferno", "ct-bone", "ct-soft-tissue", "angiography", "auto"]) {
    await choose(name);
    assert.equal(tfOf(mock), name);
    assert.equal(await chosen(), name);
  }
  await page.fill(partOf(0, ".white-value"), "400");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.match(tfOf(mock), /^-200:e8c39e:0,-145:.*,400:ffffff:0.8$/);
  assert.equal(await chosen(), "auto", "the same colours in another window");
  await choose("colour");
  assert.match(tfOf(mock), /,400:ffffff:0.8$/);
  assert.equal(await chosen(), "colour");
  await changeAndSettle(page, () => page.fill("#preset-colour", "#ff0000"));
  assert.match(tfOf(mock), /^-200:590000:0,.*,400:ff0000:0.8$/);
  await choose("viridis");
  await changeAndSettle(page, () => page.click(partOf(0, ".auto-contrast")));
  assert.match(tfOf(mock), /:440154:0,.*:21918c:.*:fde725:/);
  assert.equal(await chosen(), "viridis");
  await changeAndSettle(page, () => page.click(partOf(0, ".reset-contrast")));
  assert.equal(tfOf(mock), "auto");
  assert.equal(await chosen(), "auto");
}));

test("of CT the editor has the points of each preset", () => run(kCt, async ({ page, mock }) => {
  await open(page);
  assert.match(await page.innerText("#tf-which"), /1 of 6/);
  await page.waitForFunction(() => document.querySelectorAll("#tf-presets canvas[data-drawn]").length === 8);
  assert.deepEqual(mock.images.map((query) => new URLSearchParams(query).get("tf") ?? "auto").sort(), ["angiography", "auto", "cividis", "ct-bone", "ct-soft-tissue", "grey", "inferno", "viridis"]);
  await changeAndSettle(page, () => page.click("#tf-presets [data-preset=viridis]"));
  assert.equal(tfOf(mock), "viridis");
  assert.match(await page.innerText("#tf-which"), /1 of 11/);
  assert.equal(await page.inputValue("#tf-value"), "-988.28125");
  await changeAndSettle(page, () => page.click("#tf-presets [data-preset=auto]"));
  assert.equal(tfOf(mock), "auto");
  await page.fill("#tf-opacity", "0.001");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.match(tfOf(mock), /^-200:e8c39e:0.001,-90:/);
}));

test("the editor lies over no picture, and leaves them half of their room at least", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await waitForFinal(page);
  const boxes = (selector: string) => page.locator(selector).evaluateAll((all) => all.filter((part) => (part as HTMLElement).checkVisibility({ visibilityProperty: true })).map((part) => part.getBoundingClientRect().toJSON() as DOMRect));
  const area = (all: readonly DOMRect[]): number => all.reduce((sum, { width, height }) => sum + width * height, 0);
  const pictures = "#canvas, .slice canvas, #beside-canvas";
  for (const [width, height] of [[1440, 900], [1200, 800], [1199, 650], [721, 500]] as const) {
    await page.setViewportSize({ width, height });
    for (const layout of ["", "&slices=all", "&slices=oblique", "&slices=z", "&beside=volume%3Dfossil"]) {
      for (const isOpen of layout === "" || layout === "&slices=all" ? [true, false] : [true]) {
        await page.evaluate((hash) => { location.hash = hash; }, `#volume=vessels${layout}`);
        await page.waitForFunction((what) => document.body.dataset["layout"] === (/slices=(\w+)/.exec(what)?.[1] ?? "3d") && document.body.classList.contains("has-beside") === /beside=v/.test(what), layout);
        if (await page.evaluate(() => document.body.classList.contains("panel-open")) !== isOpen) await page.keyboard.press("p");
        const before = area(await boxes(pictures));
        await page.locator(partOf(0, ".edit-transfer")).evaluate((button) => (button as HTMLElement).click());
        const [editor, seen] = [(await boxes("#tf-editor"))[0], await boxes(pictures)];
        const what = `${width} x ${height}${layout} ${isOpen ? "with" : "without"} the panel`;
        assert.ok(editor !== undefined && editor.left >= 0 && editor.right <= width && editor.top >= 0 && editor.bottom <= height, what);
        for (const { left, right, top, bottom } of seen) assert.ok(left >= editor.right || right <= editor.left || top >= editor.bottom || bottom <= editor.top, what);
        assert.ok(area(seen) >= 0.49 * before, `${what}: ${area(seen) / before} of it`);
        await screenshot(page, `room-${width}x${height}-${layout.replaceAll(/\W+/g, "-")}-${isOpen}`);
        await page.keyboard.press("Escape");
        if (isOpen) assert.equal(await page.evaluate(() => document.activeElement?.classList.contains("edit-transfer")), true, what);
      }
    }
  }
}));
