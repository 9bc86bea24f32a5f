// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: slices beside the picture in 3D, linked by their crosshair.

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

const canvasOf = (kind: string): string => `.slice[data-slice=${kind}] canvas`;
const settled = (page: Page, kind: string) => page.waitForSelector(`.slice[data-slice=${kind}][data-settled=true]`);
const textOf = (page: Page, kind: string): Promise<string> => page.innerText(`.slice[data-slice=${kind}] .slice-text`);

// The colour of a point of a slice, in shares of its canvas.
async function colourAt(page: Page, kind: string, across: number, down: number): Promise<readonly number[]> {
  return page.locator(canvasOf(kind)).evaluate((node, [s, t]) => {
    const canvas = node as HTMLCanvasElement;
    return [...(canvas.getContext("2d")?.getImageData(Math.floor((s ?? 0) * canvas.width), Math.floor((t ?? 0) * canvas.height), 1, 1).data ?? [])].slice(0, 3);
  }, [across, down]);
}

async function middleOf(page: Page, kind: string): Promise<{ readonly x: number; readonly y: number; readonly width: number; readonly height: number }> {
  const box = await page.locator(canvasOf(kind)).boundingBox();
  assert.ok(box);
  return { x: box.x + box.width / 2, y: box.y + box.height / 2, width: box.width, height: box.height };
}

test("three slices stand beside the picture, through the middle, row 0 on top", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(mock.slices.length, 0, "nobody asked for slices yet");
  await page.click("#slices-button");
  for (const kind of ["x", "y", "z"]) await settled(page, kind);
  await screenshot(page, "slices");
  assert.match(await textOf(page, "z"), /^32 \/ 63 · z 64 mm$/);
  assert.match(await textOf(page, "x"), /^48 \/ 95 · x 48 mm$/);
  assert.ok(mock.slices.some((query) => /^axis=z&index=32&level=0&tf=auto&format=png$/.test(decodeURIComponent(query))), mock.slices[0]);
  // A quarter left of and above the middle x and y are less than there; the mock paints 2 x, 3 y, 3 z.
  const [red = 0, green = 0, blue = 0] = await colourAt(page, "z", 0.4, 0.4);
  assert.ok(red < 96 && red > 20 && green < 120 && green > 20, `${red} ${green}`);
  assert.equal(blue, 96);
  assert.deepEqual(await page.locator(".slice[data-slice=z] .edge").allInnerTexts(), ["−x", "+x", "−y", "+y"]);
  const stage = await page.locator("#stage").boundingBox();
  const first = await page.locator(".slice[data-slice=z]").boundingBox();
  assert.ok(stage && first && stage.x >= first.x + first.width - 1 && Math.abs(stage.y - first.y) < 2, "the picture in 3D stands beside the first slice");
  assert.equal((await readAddress(page)).get("slices"), "all");
}));

test("Tab goes through what stands there as it is seen: row by row, and from left to right", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
  await waitForFinal(page);
  const stops = async (): Promise<readonly string[]> => {
    const seen: string[] = [];
    await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await page.focus("#layouts input:checked");
    for (let last = ""; last !== "panel"; seen.push(last)) {
      await page.keyboard.press("Tab");
      last = await page.evaluate(() => {
        const part = document.activeElement?.closest<HTMLElement>(".slice, #stage, #panel, #view-bar, #panel-toggle");
        return part?.dataset["slice"] ?? part?.id ?? "";
      });
    }
    return seen.filter((part, i) => part !== seen[i - 1]);
  };
  for (const [layout, parts] of [["all", 4], ["oblique", 2]] as const) {
    await page.check(`#layouts input[value=${layout}]`, { force: true });
    const places = await page.locator(".slice:visible, #stage").evaluateAll((all) => all.map((part) => {
      const { x, y } = part.getBoundingClientRect();
      return { name: (part as HTMLElement).dataset["slice"] ?? part.id, x, y };
    }));
    const asSeen = places.sort((a, b) => (Math.abs(a.y - b.y) > 20 ? a.y - b.y : a.x - b.x)).map(({ name }) => name);
    assert.equal(asSeen.length, parts);
    assert.deepEqual(await stops(), ["view-bar", ...asSeen, "panel-toggle", "panel"], layout);
  }
  // What a slice's button does moves the slice, and the focus stays on it.
  await page.check("#layouts input[value=all]", { force: true });
  await page.focus(".slice[data-slice=z] .slice-maximise");
  for (let i = 0; i < 2; i++) {
    await page.keyboard.press("Enter");
    assert.equal(await page.evaluate(() => document.activeElement?.closest<HTMLElement>(".slice")?.dataset["slice"]), "z");
  }
}));

test("wheel and keys scroll, each slice by itself, and at the ends they stop", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page, mock }) => {
  await settled(page, "z");
  const { x, y } = await middleOf(page, "z");
  await page.mouse.move(x, y);
  await page.mouse.wheel(0, 120);
  await page.waitForFunction(() => /^34 \//.test(document.querySelector(".slice[data-slice=z] .slice-text")?.textContent ?? ""));
  assert.match(await textOf(page, "x"), /^48 \//);
  await page.focus(canvasOf("z"));
  await page.keyboard.press("PageUp");
  assert.equal(await page.waitForFunction(() => /^33 \//.test(document.querySelector(".slice[data-slice=z] .slice-text")?.textContent ?? "")).then(() => true), true);
  await page.keyboard.press("End");
  await page.keyboard.press("PageDown");
  await page.waitForTimeout(200);
  assert.match(await textOf(page, "z"), /^63 \//);
  await settled(page, "z");
  assert.ok((await colourAt(page, "z", 0.4, 0.4))[2] === 189, "the picture is of slice 63");
  assert.ok(mock.slices.some((query) => query.includes("index=35")), "slices ahead were fetched");
  assert.equal((await readAddress(page)).get("crosshair")?.split(",")[2], "127");
}));

test("a scroll is one step to go back, however slowly the wheel turns, and so is a slider", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
  await settled(page, "z");
  const shows = (kind: string, index: number) => page.waitForFunction(([name, at]) => document.querySelector(`.slice[data-slice=${name}] .slice-text`)?.textContent?.startsWith(`${at} /`), [kind, index] as const);
  const { x, y } = await middleOf(page, "z");
  await page.mouse.move(x, y);
  for (let i = 1; i <= 3; i++) {
    await page.mouse.wheel(0, 60);
    await shows("z", 32 + i);
    await page.waitForTimeout(600);
  }
  await page.focus(".slice[data-slice=x] .slice-index");
  for (let i = 1; i <= 2; i++) {
    await page.keyboard.press("ArrowRight");
    await shows("x", 48 + i);
    await page.waitForTimeout(600);
  }
  await page.focus(canvasOf("z"));
  await page.keyboard.press("Control+z");
  await shows("x", 48);
  assert.match(await textOf(page, "z"), /^35 \//);
  await page.keyboard.press("Control+z");
  await shows("z", 32);
  assert.equal(await page.isDisabled("#undo-button"), true);
}));

test("two fingers zoom and move a slice, and neither of them sets anything", () => run({ hash: "#volume=vessels&slices=z", phone: true }, async ({ page }) => {
  await settled(page, "z");
  const { x, y, width } = await middleOf(page, "z");
  const length = async (): Promise<number> => {
    const [voxels, bar] = await page.evaluate(() => [document.querySelector(".slice[data-slice=z] .slice-length")?.textContent, (document.querySelector(".slice[data-slice=z] .slice-bar") as HTMLElement).style.width]);
    return Number.parseFloat(bar ?? "") / Number.parseFloat(voxels ?? ""); // pixels of a millimetre
  };
  const before = await length();
  const address = (await readAddress(page)).toString();
  const session = await page.context().newCDPSession(page);
  const touch = (type: "touchStart" | "touchMove" | "touchEnd", ...points: readonly (readonly [number, number])[]) =>
    session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([px, py], id) => ({ x: px, y: py, id })) });
  await touch("touchStart", [x - 30, y]);
  await touch("touchStart", [x - 30, y], [x + 30, y]);
  for (let i = 1; i <= 6; i++) await touch("touchMove", [x - 30 - 5 * i, y], [x + 30 + 5 * i, y]);
  await touch("touchEnd", [x - 60, y]);
  await touch("touchEnd");
  await page.waitForFunction(() => document.querySelector(".slice[data-slice=z]")?.getAttribute("data-settled") === "true");
  await page.waitForTimeout(200);
  const after = await length();
  assert.ok(Math.abs(after / before - 2) < 0.1, `twice as large, it is ${after / before} times`);
  assert.match(await textOf(page, "z"), /^32 \//);
  assert.equal((await readAddress(page)).toString(), address, "crosshair and view stay");
  // Both to the right: what was left of the middle lies in it.
  const [red = 0] = await colourAt(page, "z", 0.4, 0.4);
  await touch("touchStart", [x - 30, y]);
  await touch("touchStart", [x - 30, y], [x + 30, y]);
  for (let i = 1; i <= 6; i++) await touch("touchMove", [x - 30 + (i * width) / 30, y], [x + 30 + (i * width) / 30, y]);
  await touch("touchEnd");
  await page.waitForTimeout(200);
  const [moved = 0] = await colourAt(page, "z", 0.6, 0.4);
  assert.ok(Math.abs(moved - red) <= 4, `${red} went to the right, there is ${moved}`);
  assert.ok(Math.abs((await length()) / after - 1) < 0.05, "as large as it was");
}));

test("the crosshair moves the two other slices, an arrow by one voxel", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
  await settled(page, "z");
  const { x, y, width } = await middleOf(page, "z");
  await page.mouse.click(x + width / 8, y);
  await page.waitForFunction(() => !/^48 \//.test(document.querySelector(".slice[data-slice=x] .slice-text")?.textContent ?? ""));
  const moved = Number(/^(\d+) /.exec(await textOf(page, "x"))?.[1]);
  assert.ok(moved > 52 && moved < 96, `slice ${moved}`);
  assert.match(await textOf(page, "y"), /^(39|40) /);
  await page.focus(canvasOf("z"));
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction((slice) => document.querySelector(".slice[data-slice=x] .slice-text")?.textContent?.startsWith(`${slice} /`), moved - 1);
  await page.waitForFunction((slice) => document.getElementById("announcer")?.textContent?.startsWith("z slice, slice 32 of 0–63") === true && slice > 0, moved);
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => /^48 \//.test(document.querySelector(".slice[data-slice=x] .slice-text")?.textContent ?? ""));
}));

test("close up, voxels are squares, and what is in sight is all that is asked for", () => run({ hash: "#volume=vessels&slices=z" }, async ({ page }) => {
  await settled(page, "z");
  const { x, y } = await middleOf(page, "z");
  await page.mouse.move(x, y);
  await page.keyboard.down("Control");
  for (let i = 0; i < 9; i++) await page.mouse.wheel(0, -120);
  await page.keyboard.up("Control");
  await page.waitForTimeout(300);
  const row = await page.locator(canvasOf("z")).evaluate((node) => {
    const canvas = node as HTMLCanvasElement;
    const data = canvas.getContext("2d")?.getImageData(0, Math.floor(canvas.height * 0.25), Math.floor(canvas.width / 2) - 40, 1).data ?? [];
    return [...new Set(Array.from(data).filter((_, i) => i % 4 === 0))];
  });
  assert.ok(row.length >= 2 && row.length < 20, `${row.length} colours of few voxels`);
  assert.ok(row.every((red) => red % 2 === 0), "no colour between two voxels");
  await screenshot(page, "slice-near");
}));

test("a slice is shown alone and comes back, and takes the address with it", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await waitForFinal(page);
  await page.keyboard.press("s");
  await settled(page, "y");
  await page.dblclick(".slice[data-slice=y] .slice-title");
  await page.waitForSelector(".slice[data-slice=x]", { state: "hidden" });
  assert.equal((await readAddress(page)).get("slices"), "y");
  const { width } = await middleOf(page, "y");
  assert.ok(width > 1000, "it has all the room");
  await page.click(".slice[data-slice=y] .slice-maximise");
  await page.waitForSelector(".slice[data-slice=x]:not([hidden])");
  await page.keyboard.press("s");
  await page.waitForSelector("#view-bar", { state: "hidden" });
  assert.equal((await readAddress(page)).get("slices"), null);
}));

test("a slab has its thickness and what it shows in the address and in the question", () => run({ hash: "#volume=vessels&slices=z&slab=5:mean&slice-colors=grey" }, async ({ page, mock }) => {
  await settled(page, "z");
  const query = new URLSearchParams(mock.slices[0]);
  assert.deepEqual([query.get("thickness"), query.get("reduce"), query.get("window"), query.get("gamma"), query.get("colors"), query.get("tf")], ["5", "mean", "0:255", "1", "ffffff", null]);
  assert.match(await textOf(page, "z"), /slab of 5, mean \(10 mm\)$/);
  await page.fill("#slab-thickness", "0");
  await page.keyboard.press("Tab");
  assert.match(await page.innerText("#slab-fault"), /1 to 999/);
  await page.fill("#slab-thickness", "3");
  await page.keyboard.press("Tab");
  await page.selectOption("#slab-reduce", "min");
  assert.equal((await readAddress(page)).get("slab"), "3:min");
}));

test("a slice that faces the camera turns with it", () => run({ hash: "#volume=vessels&slices=oblique" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await settled(page, "oblique");
  const before = new URLSearchParams(mock.slices.at(-1));
  assert.deepEqual([before.get("centre"), before.get("axis")], ["48,40,64", null]);
  assert.match(before.get("size") ?? "", /^\d+x\d+$/);
  await page.focus("#canvas");
  await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(500);
  await settled(page, "oblique");
  const after = new URLSearchParams(mock.slices.at(-1));
  assert.notEqual(after.get("right"), before.get("right"));
  const parts = (text: string | null): number[] => (text ?? "").split(",").map(Number);
  const dot = parts(after.get("right")).reduce((sum, part, i) => sum + part * (parts(after.get("down"))[i] ?? 0), 0);
  assert.ok(Math.abs(dot) < 1e-6);
  await screenshot(page, "oblique");
}));

test("one question at a time, and what nobody waits for is left", () => run({ hash: "#volume=vessels&slices=z" }, async ({ page, mock }) => {
  await settled(page, "z");
  mock.sliceDelayMs = 400;
  const before = mock.slices.length;
  await page.focus(canvasOf("z"));
  for (let i = 0; i < 6; i++) {
    await page.keyboard.press("Shift+PageUp");
    await page.keyboard.press("Home");
    await page.keyboard.press("End");
    await page.waitForTimeout(60);
  }
  await settled(page, "z");
  assert.ok((await colourAt(page, "z", 0.4, 0.4))[2] === 189, "the newest wish came");
  assert.ok(mock.slices.length > before && mock.abandoned > 0);
  assert.ok(mock.mostSlices <= 4, `${mock.mostSlices} open at once, one of them not being left`);
}));

test("a slice that is refused says why, once", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.sliceRefusal = { status: 400, detail: "slice: not today" };
  await page.keyboard.press("s");
  await page.waitForSelector(".toast");
  assert.match(await page.locator(".toast").first().innerText(), /A slice is refused[\s\S]*not today/);
  await page.waitForTimeout(500);
  assert.ok(mock.slices.length <= 9, "it is not asked again and again");
}));

test("the voxel under the pointer is said, as the file has it", () => run({ hash: "#volume=vessels&slices=z" }, async ({ page, mock }) => {
  await settled(page, "z");
  const { x, y } = await middleOf(page, "z");
  await page.mouse.move(x - 30, y - 30);
  await page.mouse.move(x + 20, y + 20);
  await page.waitForSelector("#probe:not([hidden])");
  const [, i = "", j = "", k = "", value = ""] = /voxel (\d+), (\d+), (\d+) · (\d+)$/.exec(await page.innerText("#probe")) ?? [];
  assert.equal(Number(value), Number(i) + 100 * Number(j) + 10000 * Number(k));
  assert.equal(k, "32");
  assert.ok(mock.regions.length <= 2, "one question a place where it rests");
  assert.match(mock.regions.at(-1) ?? "", new RegExp(`box=${i}%2C${j}%2C32%2C${Number(i) + 1}%2C${Number(j) + 1}%2C33`));
}));

test("on a phone one slice at a time, by a finger", () => run({ hash: "#volume=vessels&slices=all", phone: true }, async ({ page }) => {
  await settled(page, "z");
  assert.equal(await page.locator(".slice:visible").count(), 1);
  assert.equal(await page.locator("#layouts label:visible").count(), 5, "no four at once");
  await screenshot(page, "slices-phone");
  const { x, y, width } = await middleOf(page, "z");
  await page.touchscreen.tap(x + width / 4, y);
  await page.click("#layouts label:has([value=x])");
  await settled(page, "x");
  assert.ok(Number(/^(\d+) /.exec(await textOf(page, "x"))?.[1]) > 55);
  await page.click("#layouts label:has([value='3d'])");
  await page.waitForSelector(".slice:visible", { state: "detached" });
}));

test("Tab comes to the bar before the pictures below it", () => run({ hash: "#volume=vessels&slices=all" }, async ({ page }) => {
  await waitForFinal(page);
  await page.waitForSelector("#view-bar:not([hidden])");
  const focused = (): Promise<string> => page.evaluate(() => (document.activeElement?.closest("#view-bar, .slices, #stage") ?? document.body).id);
  await page.keyboard.press("Tab");
  assert.equal(await focused(), "view-bar");
  for (let i = 0; i < 4 && (await focused()) === "view-bar"; i++) await page.keyboard.press("Tab");
  assert.equal(await focused(), "slices-left");
}));
