// SPDX-License-Identifier: Apache-2.0
// Rows of where things are: cuts, slices, values, measures, scale, directions, projections, the box.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import type { Page } from "playwright-core";
import { changeAndSettle, difference, drag, partOf, readAddress, readPicture, shareOtherThan } from "./browser";
import { colourAt, fill, frameOf, frontPlacer, grey, patches, patchOf, press, row, settle, type Row } from "./rows_run";
import { headAt, headPlace, kHeadDims, kHeadSpacing, kHeadValues } from "./rows_volumes";
import { kFront, kGrey } from "./rows_look";
import type { Vec3 } from "../src/vector";

const { rightEar, leftEar, nose, core, hat } = kHeadValues;
const canvasOf = (kind: string): string => `.slice[data-slice=${kind}] canvas`;
const textOf = (page: Page, kind: string): Promise<string> => page.innerText(`.slice[data-slice=${kind}] .slice-text`);

// CSS pixels of a point of the head on a slice: radiologists see the patient's left on the right, the front on top.
async function slicePlacer(page: Page, kind: "x" | "y" | "z"): Promise<(point: Vec3) => readonly [number, number]> {
  await settle(page);
  const frame = await frameOf(page, canvasOf(kind));
  const size = [0, 1, 2].map((axis) => (kHeadDims[axis] ?? 0) * (kHeadSpacing[axis] ?? 0));
  const [across, down] = kind === "x" ? [1, 2] : kind === "y" ? [0, 2] : [0, 1];
  const unit = 1.06 * Math.max((size[across] ?? 0) / frame.width, (size[down] ?? 0) / frame.height);
  return (point) => [frame.x + (point[across] ?? 0) / unit, frame.y + ((down === 2 ? -1 : 1) * (point[down] ?? 0)) / unit];
}

async function colourOn(page: Page, kind: "x" | "y" | "z", point: Vec3): Promise<string> {
  const [[x, y], frame] = [(await slicePlacer(page, kind))(point), await frameOf(page, canvasOf(kind))];
  return colourAt(page, canvasOf(kind), 0.5 + (x - frame.x) / frame.width, 0.5 + (y - frame.y) / frame.height);
}

row("clip box and planes", `${kFront}&mode=mip`, async ({ page }) => {
  await page.focus(".cut-row:nth-child(1) .thumb.hi");
  await changeAndSettle(page, () => press(page, "PageDown", 2));
  assert.match((await readAddress(page)).get("clip") ?? "", /^-32,-32,-36,12,32,36$/);
  const cut = await patches(page);
  assert.equal(cut.has(grey(leftEar)), false, "the left ear is beyond 12 mm");
  assert.ok(patchOf(cut, grey(kHeadValues.head)).right < 0.66, "and so is the left side of the head");
  await changeAndSettle(page, () => page.click("#cut-reset"));
  const whole = patchOf(await patches(page), grey(core)).count;
  await changeAndSettle(page, () => page.click("#plane-add"));
  await changeAndSettle(page, async () => void (await page.selectOption(".plane select", "x")));
  const one = await patches(page);
  await changeAndSettle(page, () => page.click(".plane-flip"));
  const other = await patches(page);
  assert.notEqual(one.has(grey(leftEar)), other.has(grey(leftEar)), "a plane leaves one side, flipped the other");
  const halves = [one, other].map((half) => patchOf(half, grey(core)).count);
  assert.ok(Math.abs((halves[0] ?? 0) + (halves[1] ?? 0) - whole) < 0.03 * whole, `${halves} of ${whole}`);
  // A face by its handle, with the mouse.
  await changeAndSettle(page, () => page.click("#cut-reset"));
  assert.equal(await page.isChecked("#cut-handles"), true, "who cut by sliders sees that faces can be dragged");
  const handle = await frameOf(page, ".face-handle.axis-z >> nth=1");
  await page.mouse.move(handle.x, handle.y);
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(handle.x, handle.y + 90, { steps: 6 }));
  await page.mouse.up();
  assert.equal((await patches(page)).has(grey(hat)), false, "the hat is cut off");
}, { show: "#cut-title" });

row("slices, linked", `#volume=head&slice-colors=grey&${kGrey}`, async ({ page }) => {
  await page.keyboard.press("s");
  await settle(page);
  const place = await slicePlacer(page, "z");
  await page.mouse.click(...place([25, 0, 0]));
  await page.waitForFunction(() => /^5[67] /.test(document.querySelector(".slice[data-slice=x] .slice-text")?.textContent ?? ""));
  assert.match(await textOf(page, "x"), /· L 2[45](\.\d)? mm$/);
  assert.equal(await colourOn(page, "x", [25, 2, 2]), grey(leftEar), "sagittal goes through the left ear");
  assert.equal(await colourOn(page, "y", [25, 0, 2]), grey(leftEar), "so does coronal");
  const coronal = await slicePlacer(page, "y");
  await page.mouse.move(...coronal([0, 0, 0]));
  await page.mouse.wheel(0, 120);
  await page.waitForFunction(() => !/^3[12] /.test(document.querySelector(".slice[data-slice=y] .slice-text")?.textContent ?? ""));
  await page.focus(canvasOf("z"));
  await press(page, "ArrowLeft", 3);
  await page.waitForFunction(() => /^5[34] /.test(document.querySelector(".slice[data-slice=x] .slice-text")?.textContent ?? ""));
  assert.ok((await readAddress(page)).get("crosshair"));
});

row("value under the cursor, picked in 3D", `${kFront}&mode=first-hit`, async ({ page }) => {
  const place = await frontPlacer(page);
  const said = async (x: number, z: number): Promise<string> => {
    await page.mouse.move(5 + (await frameOf(page, "#canvas")).x, 300);
    await page.mouse.move(...place(x, z), { steps: 3 });
    await page.waitForSelector("#probe:not([hidden])");
    return page.innerText("#probe");
  };
  for (const [x, z, value] of [[0, 28, hat], [25, 0, leftEar], [-25, 0, rightEar], [0, 0, nose]] as const) {
    const [, px = "", , pz = "", i = "", j = "", k = "", got = ""] = /^(\S+), (\S+), (\S+) mm · voxel (\d+), (\d+), (\d+) · (\d+)$/.exec(await said(x, z)) ?? [];
    assert.equal(Number(got), value, await page.innerText("#probe"));
    assert.equal(headAt(headPlace([Number(i), Number(j), Number(k)])), value, "of the voxel that it names");
    assert.ok(Math.abs(Number(px) - x) < 1 && Math.abs(Number(pz) - z) < 1.5, "in the place that is pointed at");
  }
  // On a slice it is exact.
  await page.keyboard.press("s");
  await page.check("#layouts input[value=y]", { force: true });
  await settle(page);
  await page.mouse.move(...(await slicePlacer(page, "y"))([4.5, 0, 6.75]), { steps: 3 });
  await page.waitForFunction(() => / · voxel \d+, \d+, \d+ · \d+$/.test(document.getElementById("probe")?.textContent ?? "") && !document.getElementById("probe")?.hidden);
  const [, i = "", , k = "", value = ""] = /voxel (\d+), (\d+), (\d+) · (\d+)$/.exec(await page.innerText("#probe")) ?? [];
  assert.deepEqual([i, k, value], ["36", "28", String(core)]);
});

row("measures and notes", `${kFront}&mode=first-hit`, async ({ page }) => {
  await page.keyboard.press("m");
  await fill(page);
  const place = await frontPlacer(page);
  await page.check("#tool-choice input[value=ruler]", { force: true });
  await Promise.all([page.waitForResponse(/\/pick\?/), page.mouse.click(...place(-25, 0))]);
  await page.mouse.click(...place(25, 0));
  await page.waitForSelector("#mark-list li");
  const across = Number.parseFloat(await page.innerText(".mark-value"));
  assert.ok(Math.abs(across - 50) < 1, `${across} mm from ear to ear`);
  await page.check("#layouts input[value=z]", { force: true });
  await page.check("#tool-choice input[value=ruler]", { force: true });
  const flat = await slicePlacer(page, "z");
  await page.mouse.move(...flat([-10, 0, 0]));
  await page.mouse.down();
  await page.mouse.move(...flat([10, 0, 0]), { steps: 5 });
  await page.mouse.up();
  await page.waitForFunction(() => document.querySelectorAll("#mark-list li").length === 2);
  const core20 = Number.parseFloat((await page.locator(".mark-value").allInnerTexts())[1] ?? "");
  assert.ok(Math.abs(core20 - 20) < 0.3, `the core is ${core20} mm wide`);
  await page.check("#tool-choice input[value=text]", { force: true });
  await page.mouse.click(...flat([0, 20, 0]));
  await page.waitForFunction(() => document.activeElement?.classList.contains("mark-text"));
  await page.keyboard.press("Control+a");
  await page.keyboard.type("the back");
  await page.keyboard.press("Enter");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#marks-save")]);
  const { marks } = JSON.parse((await readFile(await download.path())).toString()) as { marks: { kind: string; text: string; points: number[][] }[] };
  assert.deepEqual(marks.map(({ kind }) => kind), ["ruler", "ruler", "text"]);
  assert.equal(marks[2]?.text, "the back");
  assert.ok(Math.hypot((marks[2]?.points[0]?.[0] ?? 9) - 0, (marks[2]?.points[0]?.[1] ?? 9) - 20) < 0.7);
  await page.check("#layouts input[value='3d']", { force: true });
  await settle(page);
}, { show: "#marks-title" });

row("scale bar, units", `${kFront}&mode=mip`, async ({ page }) => {
  const length = Number(/^(\d+) mm$/.exec(await page.innerText("#scale-text"))?.[1]);
  const { width } = await frameOf(page, "#scale-line");
  const shown = patchOf(await patches(page), grey(core));
  const measured = ((shown.right - shown.left) * (await frameOf(page, "#canvas")).width * length) / width;
  assert.ok(Math.abs(measured - 20) < 1.1, `by the bar the core is ${measured} mm wide`);
  await changeAndSettle(page, () => page.mouse.move(300, 250).then(() => page.mouse.wheel(0, -400)));
  const closer = Number.parseFloat(await page.innerText("#scale-text"));
  assert.ok(closer < length || (await frameOf(page, "#scale-line")).width > width);
});

row("axes, standard views, letters", `#volume=head&mode=mip&${kGrey}`, async ({ page }) => {
  const letters = (): Promise<string[]> => page.locator("#axes g[visibility=visible] text").evaluateAll((all) => all.map((text) => {
    const [a = 0, b = 0, c = 0, d = 0] = (text.getAttribute("transform")?.match(/-?[\d.]+/g) ?? []).map(Number);
    return `${text.textContent}${a * d - b * c > 0 ? "" : " mirrored"}`;
  }));
  assert.ok((await letters()).every((letter) => /^[LRAPSI]$/.test(letter)), `${await letters()}`);
  // Where the left ear is in the picture, and whether the head stands upright, from each side: from above the front is on top.
  const sides = { L: [null, "top"], R: [null, "top"], P: ["left", "top"], A: ["right", "top"], S: ["left", null], I: ["right", null] } as const;
  for (const [i, [letter, [ear, top]]] of Object.entries(sides).entries()) {
    await changeAndSettle(page, () => page.keyboard.press(String(i + 1)));
    await page.waitForFunction((seen) => [...document.querySelectorAll("#axes g[visibility=visible] text")].map((text) => text.textContent).join() === seen, letter);
    await settle(page);
    assert.deepEqual(await letters(), [letter]);
    const shown = await patches(page);
    const [left, high] = [shown.get(grey(leftEar)), shown.get(grey(hat))];
    if (ear !== null) assert.ok(left && (ear === "right" ? left.x > 0.55 : left.x < 0.45), `${letter}: the left ear is on the ${ear}`);
    if (top !== null) assert.ok(high && high.y < 0.4, `${letter}: the hat is on top`);
  }
  await changeAndSettle(page, () => page.keyboard.press("r"));
  await changeAndSettle(page, () => page.locator("#axes g[visibility=visible]").filter({ hasText: /^Look from anteriorA$/ }).click());
  assert.deepEqual(await letters(), ["A"]);
  await changeAndSettle(page, () => page.keyboard.press("r"));
  await page.keyboard.press("s");
  await settle(page);
  const edges = await page.locator(".slice[data-slice=z] .edge").allInnerTexts();
  assert.deepEqual(edges, ["R", "L", "A", "P"]);
  const seen = await colourOn(page, "z", [25, 2, 0]);
  assert.equal(seen, await colourOn(page, "z", [26, -2, 0]));
  assert.notEqual(seen, await colourOn(page, "z", [-25, 2, 0]), "the left ear is on the right");
});

row("perspective and parallel", `#volume=head&mode=mip&${kGrey}`, async ({ page }) => {
  for (const field of [".value-lo", ".value-hi"]) {
    await changeAndSettle(page, async () => {
      await page.fill(partOf(0, field), String(nose));
      await page.keyboard.press("Enter");
    });
  }
  await page.focus("#canvas");
  const size = async (side: string): Promise<number> => {
    await changeAndSettle(page, () => page.keyboard.press(side));
    const shown = await patches(page);
    assert.deepEqual([...shown.keys()].sort(), ["000000", grey(nose)].sort(), "the nose alone");
    return patchOf(shown, grey(nose)).count;
  };
  const [near, far] = [await size("4"), await size("3")];
  assert.ok(near > 1.3 * far, `from the front ${near} pixels, from behind ${far}`);
  await changeAndSettle(page, () => page.click("label:has(> #ortho)"));
  const [front, back] = [await size("4"), await size("3")];
  assert.ok(Math.abs(front - back) < 0.05 * front, `parallel ${front} and ${back}`);
  assert.ok(Number((await readAddress(page)).get("ortho")) > 0);
  await changeAndSettle(page, () => page.click(partOf(0, ".reset-range")));
}, { show: "#look-title" });

row("bounding box", `${kFront}&mode=mip`, async ({ page }) => {
  await page.click("label:has(> #show-box)");
  const frame = await frameOf(page, "#scene");
  const lines = await page.locator("#scene").evaluate((node) => {
    const scene = node as HTMLCanvasElement;
    const data = scene.getContext("2d")?.getImageData(0, 0, scene.width, scene.height).data ?? [];
    const counts = Array.from({ length: scene.width }, () => 0);
    for (let i = 3; i < data.length; i += 4) if ((data[i] ?? 0) > 40) counts[((i - 3) / 4) % scene.width] = (counts[((i - 3) / 4) % scene.width] ?? 0) + 1;
    return counts.flatMap((count, x) => (count > scene.height / 2 ? [x] : []));
  });
  const unit = 90 / frame.height; // mm a pixel
  const wide = ((lines.at(-1) ?? 0) - (lines[0] ?? 0)) * unit;
  assert.ok(Math.abs(wide - kHeadDims[0] * kHeadSpacing[0]) < 1, `the box is ${wide} mm wide`);
}, { show: "#look-title" });

row("a real patient: letters, Hounsfield colours", "#volume=abdomen&slices=z", async ({ page }: Row) => {
  const presets = await page.locator("#preset option:not([hidden])").evaluateAll((all) => all.map((option) => (option as HTMLOptionElement).value));
  assert.ok(presets.includes("ct-bone"), "the values are in Hounsfield units");
  assert.deepEqual(await page.locator(".slice[data-slice=z] .edge").allInnerTexts(), ["R", "L", "A", "P"]);
  await page.check("#layouts input[value='3d']", { force: true });
  await settle(page);
  const before = await readPicture(page);
  for (const name of ["viridis", "ct-bone"]) {
    await changeAndSettle(page, async () => void (await page.selectOption("#preset", name)));
    assert.ok(difference(before, await readPicture(page)) > 0.02, name);
  }
  await changeAndSettle(page, () => page.keyboard.press("4"));
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.01, "there are bones");
  await changeAndSettle(page, () => drag(page, 60, 20));
  await page.keyboard.press("s");
  await settle(page);
}, { needsAbdomen: true });
