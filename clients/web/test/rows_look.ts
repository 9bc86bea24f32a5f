// SPDX-License-Identifier: Apache-2.0
// Rows of what is drawn and in which colours: modes, contrast, transfer functions, channels, labels, light.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import type { Page } from "playwright-core";
import { changeAndSettle, difference, dragThumb, partOf, readAddress, readPicture, shareOtherThan } from "./browser";
import { brightness, colourAt, frameOf, grey, patches, patchOf, press, row, settle } from "./rows_run";
import { headAt, headPlace, kHeadDims, kHeadValues, kLabels } from "./rows_volumes";

export const kGrey = "tf=0:000000:0,255:ffffff:1"; // a value is its grey
export const kFront = `#volume=head&eye=1,-200,5&target=1,0,5&up=0,0,1&ortho=90&${kGrey}`;
const { head, rightEar, leftEar, nose, core, hat } = kHeadValues;
const mode = (page: Page, name: string) => changeAndSettle(page, () => page.check(`input[value=${name}]`, { force: true }));

row("a first picture, no install" /* how soon: bench/page.mjs */, "#volume=tissue", async ({ page, open }) => {
  await open("", async (fresh) => {
    assert.ok(shareOtherThan(await readPicture(fresh), [0, 0, 0]) > 0.02);
  });
  assert.equal(await page.textContent("#badge"), "Full quality");
});

row("blend, maximum, mean, surface, first hit", `${kFront}&mode=blend`, async ({ page }) => {
  const blend = await patches(page);
  await mode(page, "mip");
  const mip = await patches(page);
  for (const value of [head, rightEar, leftEar, core, hat]) patchOf(mip, grey(value));
  assert.equal(mip.has(grey(nose)), false, "the core behind the nose is brighter");
  const { x, y } = patchOf(mip, grey(core));
  await mode(page, "mean");
  const mean = parseInt(await colourAt(page, "#canvas", x, y), 16) & 255;
  assert.ok(mean > head && mean < core, `the mean of a ray through head and core is ${mean}`);
  await mode(page, "first-hit");
  const first = await patches(page);
  assert.ok(patchOf(first, grey(nose)).count > 500);
  assert.equal(first.has(grey(core)), false, "the head hides the core");
  await mode(page, "iso");
  await changeAndSettle(page, () => page.fill("#iso", "500"));
  assert.equal(await page.innerText("#iso-value"), "160");
  const iso = await patches(page);
  assert.equal(iso.has(grey(head)) || iso.has(grey(leftEar)), false, "what is below the value has no surface");
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.02);
  assert.notDeepEqual([...blend.keys()], [...iso.keys()]);
}, { show: "#modes" });

row("minimum, attenuated maximum, average slab", `${kFront}&mode=mip`, async ({ page }) => {
  const { x, y } = patchOf(await patches(page), grey(core));
  await mode(page, "minip");
  const least = await patches(page);
  assert.equal(least.has(grey(core)), false, "the head is before it and darker");
  patchOf(least, grey(hat));
  await mode(page, "attenuated-mip");
  const weak = parseInt(await colourAt(page, "#canvas", x, y), 16) & 255;
  await changeAndSettle(page, () => page.fill("#attenuation", "0"));
  assert.ok(weak < core && weak > head, `${weak}`);
  assert.ok(Math.abs((parseInt(await colourAt(page, "#canvas", x, y), 16) & 255) - core) <= 1, "not attenuated it is the maximum");
  // The mean of nine slices, of which the core is in some.
  await page.focus("#canvas");
  await page.keyboard.press("s");
  await page.check("#layouts input[value=z]", { force: true });
  await page.fill("#slab-thickness", "9");
  await page.keyboard.press("Tab");
  await page.selectOption("#slab-reduce", "mean");
  await page.check("#slice-grey", { force: true });
  await settle(page);
  await page.waitForFunction(() => /slab of 9, mean \(13.5 mm\)/.test(document.querySelector(".slice[data-slice=z] .slice-text")?.textContent ?? ""));
  await settle(page);
  const voxel = [40, 28] as const; // 8.5, -3.5 mm
  const index = Number(/^(\d+) /.exec(await page.innerText(".slice[data-slice=z] .slice-text"))?.[1]);
  const wanted = [...Array(9).keys()].reduce((sum, i) => sum + headAt(headPlace([...voxel, index - 4 + i])), 0) / 9;
  const frame = await frameOf(page, ".slice[data-slice=z] canvas");
  const unit = 1.06 * Math.max(kHeadDims[0] / frame.width, kHeadDims[1] / frame.height);
  const [px, py] = headPlace([...voxel, 0]);
  const got = parseInt(await colourAt(page, ".slice[data-slice=z] canvas", 0.5 + px / unit / frame.width, 0.5 + py / unit / frame.height), 16) & 255;
  assert.ok(wanted > head && wanted < core && Math.abs(got - wanted) <= 2, `${got}, it should be ${wanted}`);
}, { show: "#slab-thickness" });

row("contrast window: black, white, gamma, auto", `#volume=head&mode=mip&eye=1,-200,5&target=1,0,5&up=0,0,1&ortho=90`, async ({ page }) => {
  await page.focus("#preset");
  await changeAndSettle(page, () => page.keyboard.press("ArrowDown"));
  assert.equal(await page.inputValue("#preset"), "grey");
  const type = (field: string, text: string) => changeAndSettle(page, async () => {
    await page.fill(field, text);
    await page.keyboard.press("Enter");
  });
  await type(".white-value", "200");
  await type(".black-value", "100");
  const windowed = await patches(page);
  patchOf(windowed, grey((255 * (leftEar - 100)) / 100));
  assert.equal(windowed.has(grey(head)), false);
  const { count } = patchOf(windowed, "ffffff");
  assert.ok(count > 1000, "core and hat are white");
  await page.focus(".gamma");
  await changeAndSettle(page, () => press(page, "End"));
  assert.equal((await patches(page)).has(grey((255 * (leftEar - 100)) / 100)), false, "gamma moves what is between");
  // By mouse the white point goes to the right, and less is white.
  await changeAndSettle(page, () => page.click(".reset-contrast"));
  const point = await frameOf(page, ".black-point");
  await page.mouse.move(point.x, point.y);
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(point.x + 120, point.y, { steps: 5 }));
  await page.mouse.up();
  assert.ok(Number(await page.inputValue(".black-value")) > 80);
  await changeAndSettle(page, () => page.click(".auto-contrast"));
  const [black, white] = [Number(await page.inputValue(".black-value")), Number(await page.inputValue(".white-value"))];
  assert.ok(black < white && white <= 255, `${black} to ${white}`);
  assert.ok(Math.abs(Number.parseFloat((await readAddress(page)).get("tf") ?? "") - black) < 0.1, "the address has it");
}, { show: ".contrast" });

row("transfer function: points added, dragged, saved, loaded", "#volume=head&tf=0:000000:0,100:808080:0.05,255:ffffff:1", async ({ page }) => {
  const plain = await readPicture(page);
  await page.click(partOf(0, ".edit-transfer"));
  const plot = await page.locator("#tf-points").boundingBox();
  assert.ok(plot);
  await changeAndSettle(page, () => page.mouse.dblclick(plot.x + 0.75 * plot.width, plot.y + 0.8 * plot.height));
  assert.match(await page.innerText("#tf-which"), /3 of 4/);
  await changeAndSettle(page, () => page.fill("#tf-colour", "#ff2000"));
  await page.mouse.move(plot.x + 0.75 * plot.width, plot.y + 0.8 * plot.height);
  await page.mouse.down();
  await changeAndSettle(page, () => page.mouse.move(plot.x + 0.75 * plot.width, plot.y + 0.1 * plot.height, { steps: 5 }));
  await page.mouse.up();
  assert.ok(Math.abs(Number(await page.inputValue("#tf-opacity")) - 0.9) < 0.03);
  const edited = await readPicture(page);
  assert.ok(difference(plain, edited) > 0.02);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#tf-save")]);
  const saved = await readFile(await download.path());
  const { points } = JSON.parse(saved.toString()) as { points: { color: string; opacity: number }[] };
  assert.ok(points.some(({ color, opacity }) => /ff2000/.test(color) && Math.abs(opacity - 0.9) < 0.03), saved.toString());
  await changeAndSettle(page, () => page.click("#tf-presets [data-preset=viridis]"));
  await changeAndSettle(page, () => page.setInputFiles("#tf-file", { name: "mine.json", mimeType: "application/json", buffer: saved }));
  assert.ok(difference(edited, await readPicture(page)) < 0.01, "what was saved comes back");
  await page.waitForFunction(() => document.querySelectorAll("#tf-presets canvas[data-drawn]").length >= 5);
});

row("opacity of colours and of densities", "#volume=fossil&background=ffffff", async ({ page, open }) => {
  const dense = brightness(await patches(page));
  await page.focus("#extinction");
  await changeAndSettle(page, () => press(page, "Home"));
  const thin = brightness(await patches(page));
  assert.ok(thin > dense + 8, `${dense} becomes ${thin}: the white behind it shows`);
  assert.ok(Number((await readAddress(page)).get("extinction")) < 0.2);
  await open("#volume=head", async (scalar) => {
    const before = brightness(await patches(scalar));
    await scalar.focus(".opacity");
    await changeAndSettle(scalar, () => press(scalar, "Home"));
    assert.ok(brightness(await patches(scalar)) < before - 10);
  });
}, { show: "#extinction" });

row("a channel's colour", "#volume=tissue&mode=mip", async ({ page }) => {
  for (const other of [1, 2]) await changeAndSettle(page, () => page.click(partOf(other, "input[type=checkbox]")));
  await changeAndSettle(page, () => page.fill(partOf(0, ".channel-colour"), "#ff0000"));
  const [red, other] = [...(await patches(page))].reduce(([r, o], [colour, { count }]) => {
    const [a = 0, b = 0, c = 0] = [0, 2, 4].map((at) => parseInt(colour.slice(at, at + 2), 16));
    return a > 40 && b < 5 && c < 5 ? [r + count, o] : [r, o + (Math.max(b, c) > 5 ? count : 0)];
  }, [0, 0]);
  assert.ok(red > 1000 && other === 0, `${red} red pixels, ${other} of other colours`);
  assert.match((await readAddress(page)).get("tf") ?? "", /:ff0000:/);
});

row("channels off and on, names, histograms", "#volume=tissue", async ({ page }) => {
  assert.deepEqual(await page.locator(".channel-name").allInnerTexts(), ["nuclei", "membranes", "marker"]);
  const shapes = await page.locator(".channel .histogram:not(.lit) path").evaluateAll((all) => all.map((path) => path.getAttribute("d")));
  assert.equal(new Set(shapes).size, 3, "each has its own histogram");
  const all = await readPicture(page);
  await changeAndSettle(page, () => page.click(partOf(1, ".channel-name")));
  const without = await readPicture(page);
  assert.ok(difference(all, without) > 0.02);
  assert.equal((await readAddress(page)).get("channels"), "0,2");
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.5, 0));
  assert.ok(difference(without, await readPicture(page)) > 0.02);
  await changeAndSettle(page, () => page.click(partOf(0, ".reset-range")));
  await changeAndSettle(page, () => page.click(partOf(1, ".channel-name")));
  assert.ok(difference(all, await readPicture(page)) < 0.01);
});

row("labels: colours, hidden, alone, searched", "#volume=labels&mode=first-hit", async ({ page }) => {
  assert.equal(await page.innerText(".label-status"), `${kLabels} labels`);
  const all = await patches(page);
  const colour = (value: number): Promise<string> => page.locator(`.label-row:has(.label-name:text-is("Label ${value}")) .label-colour`).evaluate((swatch) => {
    const parts = getComputedStyle(swatch).backgroundColor.match(/\d+/g) ?? [];
    return parts.slice(0, 3).map((part) => Number(part).toString(16).padStart(2, "0")).join("");
  });
  const third = await colour(3);
  assert.ok(patchOf(all, third).count > 300, "the picture has the colour that the list says");
  await changeAndSettle(page, () => page.click('.label-row:has(.label-name:text-is("Label 3")) .label-name'));
  assert.equal((await patches(page)).has(third), false);
  assert.equal(await page.innerText(".label-status"), `${kLabels} labels, 1 hidden`);
  await page.fill(".label-search", "7");
  assert.deepEqual(await page.locator(".label-name").allInnerTexts(), ["Label 7"]);
  await changeAndSettle(page, () => page.click('.label-row:has(.label-name:text-is("Label 7")) button'));
  const seventh = await colour(7);
  assert.deepEqual([...(await patches(page)).keys()].sort(), ["000000", seventh].sort(), "it is alone");
  await page.fill(".label-search", "");
  await changeAndSettle(page, () => page.click(".label-all"));
  patchOf(await patches(page), third);
}, { show: "#labels" });

row("maps for everybody's eyes", "#volume=head&mode=mip&eye=1,-200,5&target=1,0,5&up=0,0,1&ortho=90", async ({ page }) => {
  const values = { viridis: ["440154", "21918c", "fde725"], cividis: ["00224e", "7d7c78", "fee838"], inferno: ["000004", "bc3754", "fcffa4"] };
  for (const [name, [, middle = "", last = ""]] of Object.entries(values)) {
    await changeAndSettle(page, async () => void (await page.selectOption("#preset", name)));
    for (const [field, text] of [[".white-value", "200"], [".black-value", "0"]] as const) {
      if ((await page.inputValue(field)) === text) continue;
      await changeAndSettle(page, async () => {
        await page.fill(field, text);
        await page.keyboard.press("Enter");
      });
    }
    const shown = await patches(page);
    patchOf(shown, last); // of 200 and above
    const [near] = [...shown].filter(([colour]) => [0, 2, 4].every((at) => Math.abs(parseInt(colour.slice(at, at + 2), 16) - parseInt(middle.slice(at, at + 2), 16)) < 3));
    assert.ok(near && near[1].right < 0.4, `${name}: 100 of 0 to 200 is ${middle}, on the right ear`);
  }
}, { show: "#preset-block" });

row("light, occlusion, shadows", "#volume=head&mode=first-hit&tf=0:ffffff:0,1:ffffff:1", async ({ page }) => {
  await changeAndSettle(page, () => page.click("label:has(> #lit)"));
  const lit = await patches(page);
  assert.ok(lit.size > 20, "a ball has all shades");
  const occluded = async (id: string): Promise<number> => {
    await changeAndSettle(page, () => page.click(`label:has(> ${id})`));
    return brightness(await patches(page));
  };
  const plain = brightness(lit);
  const shadow = await occluded("#shadow");
  assert.ok(shadow < plain - 0.5, `${plain} becomes ${shadow}`);
  const dark = await occluded("#occlusion");
  assert.ok(dark < shadow - 0.5, `${shadow} becomes ${dark}`);
  // The key light alone comes from the side it is set to.
  for (const [id, key] of [["#light-head", "Home"], ["#light-ambient", "Home"], ["#light-key", "End"]] as const) {
    await page.focus(id);
    await changeAndSettle(page, () => press(page, key));
  }
  const side = async (azimuth: string): Promise<number> => {
    await page.focus("#light-azimuth");
    await changeAndSettle(page, () => page.fill("#light-azimuth", azimuth));
    let [sum, count] = [0, 0];
    for (const [colour, patch] of await patches(page)) {
      const weight = patch.count * parseInt(colour.slice(0, 2), 16);
      [sum, count] = [sum + weight * patch.x, count + weight];
    }
    return sum / count;
  };
  const [left, right] = [await side("-90"), await side("90")];
  assert.ok(right > left + 0.03, `what is bright goes from ${left} to ${right}`);
  await changeAndSettle(page, () => page.click("#light-reset"));
  await changeAndSettle(page, () => page.click("label:has(> #shadow)"));
}, { show: "#light-block" });

row("smooth filter", `${kFront}&mode=mip`, async ({ page }) => {
  const exact = [...(await patches(page)).keys()];
  assert.deepEqual(exact.sort(), ["000000", ...[head, rightEar, leftEar, core, hat].map(grey)].sort(), "voxels have their own values alone");
  await changeAndSettle(page, () => page.click("label:has(> #smooth)"));
  const smooth = await patches(page);
  assert.ok(smooth.size > 20, `${smooth.size} greys: there are some between`);
  assert.equal((await readAddress(page)).get("filter"), "linear");
}, { show: "#look-title" });

row("histogram: counts, ticks, log or not", "#volume=head", async ({ page }) => {
  assert.deepEqual((await page.innerText(".ticks")).split("\n"), ["80", "160", "240"]);
  // A bar ends at 1 - its count by the largest.
  const heights = (): Promise<number[]> => page.locator(".histogram:not(.lit) path").first().evaluate((path) => [...(path.getAttribute("d") ?? "").matchAll(/V([\d.]+)H/g)].map(([, y]) => 1 - Number(y)));
  const counts = new Map<number, number>();
  for (let z = 0; z < 48; ++z) for (let y = 0; y < 64; ++y) for (let x = 0; x < 64; ++x) {
    const value = headAt(headPlace([x, y, z]));
    if (value > 0) counts.set(value, (counts.get(value) ?? 0) + 1);
  }
  const most = Math.max(...counts.values());
  await page.click(".chip");
  const sorted = (shares: readonly number[]): number[] => [...new Set(shares.map((share) => Number(share.toFixed(4))))].sort((a, b) => a - b);
  const wanted = sorted([...counts.values()].map((count) => count / most));
  assert.deepEqual(sorted(await heights()).slice(1), wanted, "as many as there are voxels of each value");
  await page.click(".chip");
  assert.ok((await heights()).filter((height) => height > 0.4).length >= wanted.length, "by logarithm all are seen");
}, { show: ".range-track" });
