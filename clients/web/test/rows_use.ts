// SPDX-License-Identifier: Apache-2.0
// Rows of what people do with it: going back, keeping, sharing, saving, time, phones, programs, keys.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, readFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { changeAndSettle, difference, drag, dragThumb, partOf, readAddress, readPicture, shareOtherThan } from "./browser";
import { blockwalk } from "./daemon";
import { fill, folder, frameOf, patches, press, row, settle } from "./rows_run";
import { headAt, headPlace, kFilmSteps, kLongDims, kPythonFolder } from "./rows_volumes";
import { kFront } from "./rows_look";

const sizeOf = (png: Buffer): readonly [number, number] => [png.readUInt32BE(16), png.readUInt32BE(20)];

row("undo and bookmarks", "#volume=tissue", async ({ page }) => {
  const home = await readPicture(page);
  await changeAndSettle(page, () => drag(page, 150, 40));
  const turned = await readPicture(page);
  assert.ok(difference(home, turned) > 0.02);
  await page.click("#bookmark-add");
  await page.keyboard.type("from the side");
  await page.keyboard.press("Enter");
  await changeAndSettle(page, () => page.click("#undo-button"));
  assert.ok(difference(home, await readPicture(page)) < 0.01, "back");
  await changeAndSettle(page, () => page.click("#redo-button"));
  assert.ok(difference(turned, await readPicture(page)) < 0.01, "and forth");
  await changeAndSettle(page, () => page.click("#reset-button"));
  await readAddress(page);
  await page.reload();
  await settle(page);
  assert.equal(await page.inputValue(".bookmark input"), "from the side");
  await changeAndSettle(page, () => page.click(".bookmark-go"));
  assert.ok(difference(turned, await readPicture(page)) < 0.01, "the bookmark is that view");
}, { show: "#bookmarks-title" });

row("a link is the whole view", "#volume=tissue", async ({ page, address, open }) => {
  await changeAndSettle(page, () => drag(page, -90, 60));
  await changeAndSettle(page, () => page.check("input[value=mip]", { force: true }));
  await frameOf(page, partOf(1, ".range-values"));
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.3, 1));
  const picture = await readPicture(page);
  await readAddress(page);
  await page.click("#link-button");
  await page.waitForSelector("#link-button.done");
  const link = await page.evaluate(() => navigator.clipboard.readText());
  await open(link.slice(address.length), async (copy) => {
    assert.ok(difference(picture, await readPicture(copy)) < 0.01);
  });
  // And the command line draws it.
  const size = await page.evaluate(() => `${document.querySelector("canvas")?.width}x${document.querySelector("canvas")?.height}`);
  blockwalk("render", link, "-o", join(folder, "link.png"), "--size", size);
  const drawn = `data:image/png;base64,${readFileSync(join(folder, "link.png")).toString("base64")}`;
  assert.ok(difference(picture, await readBytes(page, drawn)) < 0.01);
});

// As readImage, of what the page's policy does not let it fetch.
async function readBytes(page: Page, data: string): Promise<readonly number[]> {
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const context = new OffscreenCanvas(64, 48).getContext("2d");
    context?.drawImage(await createImageBitmap(new Blob([bytes])), 0, 0, 64, 48);
    return [...(context?.getImageData(0, 0, 64, 48).data ?? [])];
  }, data.slice(data.indexOf(",") + 1));
}

row("screenshot: size, samples, transparent", kFront, async ({ page }) => {
  await readAddress(page);
  await page.click("#save-button");
  await page.check("input[name=size][value=double]", { force: true });
  await page.selectOption("#save-samples", "4");
  await page.click("label:has(> #save-transparent)");
  const frame = await frameOf(page, "#stage");
  assert.equal(await page.innerText("#save-size"), `${2 * frame.width} × ${2 * frame.height} pixels`);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save-link")]);
  assert.equal(download.suggestedFilename(), "head.png");
  const png = await readFile(await download.path());
  assert.deepEqual(sizeOf(png), [2 * frame.width, 2 * frame.height]);
  assert.equal(png[25], 6, "it has opacities");
  const seen = await readBytes(page, `data:,${png.toString("base64")}`);
  const alphas = seen.filter((_, i) => i % 4 === 3);
  assert.deepEqual([alphas[0], Math.max(...alphas) > 200], [0, true], "nothing in the corner, something in the middle");
  await page.click("#save-button");
});

row("turntable as pictures and as a film", kFront, async ({ page }) => {
  await readAddress(page);
  await page.click("#save-button");
  await page.click("#animate summary");
  await page.fill("#animate-frames", "4");
  const made = async (): Promise<Buffer> => {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#animate-start")]);
    return readFile(await download.path());
  };
  const zip = await made();
  const end = zip.length - 22;
  assert.deepEqual([zip.readUInt32LE(end), zip.readUInt16LE(end + 10)], [0x06054b50, 4], "a zip of four");
  const starts = [...zip.toString("latin1").matchAll(/\x89PNG\r\n\x1a\n/g)].map(({ index }) => index);
  const pictures = await Promise.all(starts.map((start) => readBytes(page, `data:,${zip.subarray(start).toString("base64")}`)));
  assert.equal(pictures.length, 4);
  assert.ok(difference(pictures[0] ?? [], pictures[1] ?? []) > 0.01 && difference(pictures[0] ?? [], pictures[2] ?? []) > 0.002, "it turns");
  await page.selectOption("#animate-format", "webp");
  const film = (await made()).toString("latin1");
  assert.match(film.slice(0, 12), /^RIFF[^]{4}WEBP/);
  assert.equal(film.split("ANMF").length - 1, 4, "four frames");
});

row("steps in time", "#volume=film&mode=mip", async ({ page }) => {
  await changeAndSettle(page, () => page.keyboard.press("5"));
  const x = async (): Promise<number> => [...(await patches(page))].filter(([colour]) => colour !== "000000").sort(([, a], [, b]) => b.count - a.count)[0]?.[1].x ?? NaN;
  const places = [await x()];
  for (let step = 1; step < kFilmSteps; ++step) {
    await changeAndSettle(page, () => page.keyboard.press("."));
    places.push(await x());
  }
  assert.ok(places.every((place, i) => i === 0 || place > (places[i - 1] ?? 1) + 0.05), `the ball goes to the right: ${places}`);
  assert.match(await page.innerText("#time-label"), /^4 of 4/);
  await page.focus("#time-step");
  await changeAndSettle(page, () => page.keyboard.press("Home"));
  assert.ok(Math.abs((await x()) - (places[0] ?? 0)) < 0.01);
  await page.click("#time-play");
  await page.waitForFunction(() => /^3 of 4/.test(document.getElementById("time-label")?.textContent ?? ""));
  await page.click("#time-play");
  await settle(page);
  assert.equal(await page.getAttribute("#time-play", "aria-pressed"), "false");
});

row("a file of one's own: what to type", "#volume=head", async ({ page }) => {
  const drop = (name: string): Promise<void> => page.evaluate((file) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File(["x"], file));
    const isTaken = !(document.getElementById("canvas") as HTMLElement).dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
    if (!isTaken) throw new Error("the browser would leave the page");
  }, name);
  await drop("own.raw.nrrd");
  const said = await page.innerText(".toast p");
  const [, words = ""] = /blockwalk (import own\.raw\.nrrd -o own\.raw\.bwv), then blockwalkd own\.raw\.bwv/.exec(said) ?? [];
  assert.notEqual(words, "", said);
  // What it says is what makes a volume.
  copyFileSync(join(folder, "head.nrrd"), join(folder, "own.raw.nrrd"));
  blockwalk(...words.split(" ").map((word) => (word.startsWith("own") ? join(folder, word) : word)));
  blockwalk("info", join(folder, "own.raw.bwv"));
  await page.click(".toast button");
  await page.click("#picker-button");
  await page.click("#picker-list summary");
  assert.match(await page.innerText("#own-file"), /blockwalk import FILE/);
}, { show: "#own-file" });

row("a big volume", "#volume=long&mode=mip", async ({ page }) => {
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.01);
  const before = await readPicture(page);
  await changeAndSettle(page, () => drag(page, 120, 30));
  assert.ok(difference(before, await readPicture(page)) > 0.005);
  await page.click("details:has(#facts) summary");
  assert.match(await page.innerText("#facts"), new RegExp(kLongDims.join(" × ")));
  await page.keyboard.press("s");
  await settle(page);
  await page.focus(".slice[data-slice=z] canvas");
  await page.keyboard.press("End");
  await page.waitForFunction(() => /^2291 \/ 2291/.test(document.querySelector(".slice[data-slice=z] .slice-text")?.textContent ?? ""));
  await settle(page);
  assert.ok([...(await patches(page, ".slice[data-slice=z] canvas")).values()].length > 1, "the last slice has the end of the spring");
}, { show: "#facts" });

row("a small screen, by finger", "#volume=tissue", async ({ page }) => {
  const before = await readPicture(page);
  const { x, y } = await frameOf(page, "#canvas");
  const session = await page.context().newCDPSession(page);
  const touch = (type: "touchStart" | "touchMove" | "touchEnd", ...points: readonly (readonly [number, number])[]) =>
    session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([px, py], id) => ({ x: px, y: py, id })) });
  await changeAndSettle(page, async () => {
    await touch("touchStart", [x, y]);
    for (let i = 1; i <= 6; ++i) await touch("touchMove", [x + 15 * i, y + 5 * i]);
    await touch("touchEnd");
  });
  assert.ok(difference(before, await readPicture(page)) > 0.02, "a finger turns it");
  await page.tap("#sheet-title");
  await page.tap("[data-volume=head]");
  await page.waitForFunction(() => document.title.startsWith("head"));
  await settle(page);
  await page.tap("label:has(> input[value=mip])");
  await settle(page);
  assert.equal((await readAddress(page)).get("mode"), "mip");
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), "nothing lies beside the screen");
  await page.tap("#sheet-handle", { position: { x: 20, y: 12 } });
  await settle(page);
}, { hasTouch: true, window: { width: 390, height: 700 } });

row("a window of another shape", "#volume=labels&mode=first-hit", async ({ page }) => {
  for (const size of [{ width: 500, height: 800 }, { width: 1100, height: 420 }]) {
    await page.setViewportSize(size);
    await fill(page);
    const bars = [...(await patches(page))].filter(([colour]) => colour !== "000000").map(([, bar]) => bar);
    assert.ok(bars.every(({ left, right, top, bottom }) => left > 0 && right < 1 && top > 0 && bottom < 1), "all of it is in the picture");
    assert.ok(Math.max(...bars.map(({ right }) => right)) - Math.min(...bars.map(({ left }) => left)) > 0.4 , "and no smaller than it has to be");
  }
});

row("the Python client", kFront, async ({ page, address }) => {
  await readAddress(page);
  const script = [
    "import blockwalk, sys", "scan = blockwalk.Server(sys.argv[1]).volume('head')",
    "view = dict(eye=(1, -200, 5), target=(1, 0, 5), up=(0, 0, 1), ortho=90, tf='0:000000:0,255:ffffff:1', format='png', size=tuple(map(int, sys.argv[3].split('x'))))",
    "scan.image(**view).save(sys.argv[2])", "a = scan.region(level=0, box=(0, 0, 0, 64, 64, 48))", "print(a[24, 32, 32], a[24, 32, 57], tuple(a.shape))",
  ].join("\n");
  const size = await page.evaluate(() => `${document.querySelector("canvas")?.width}x${document.querySelector("canvas")?.height}`);
  const python = existsSync("/usr/bin/python3") ? "/usr/bin/python3" : "python3";
  const said = execFileSync(python, ["-B", "-c", script, address, join(folder, "python.png"), size], { env: { ...process.env, PYTHONPATH: kPythonFolder } }).toString();
  assert.equal(said.trim(), `${headAt(headPlace([32, 32, 24]))} ${headAt(headPlace([57, 32, 24]))} (48, 64, 64)`);
  const drawn = `data:,${readFileSync(join(folder, "python.png")).toString("base64")}`;
  assert.ok(difference(await readPicture(page), await readBytes(page, drawn)) < 0.01, "its picture is the page's");
});

row("keys alone, names, a ring around what has the focus", "#volume=tissue", async ({ page }) => {
  await page.focus("#canvas");
  const before = await readPicture(page);
  await changeAndSettle(page, () => press(page, "ArrowLeft", 4));
  assert.ok(difference(before, await readPicture(page)) > 0.02, "arrows turn it");
  await page.keyboard.press("h");
  assert.equal(await page.isVisible("#help"), true);
  await page.keyboard.press("Escape");
  await page.focus("#canvas");
  const seen: { readonly name: string; readonly ring: boolean; readonly inside: boolean; readonly place: string }[] = [];
  for (let i = 0; i < 60; ++i) {
    await page.keyboard.press("Tab");
    const told = await page.evaluate(() => {
      const one = document.activeElement;
      if (!(one instanceof HTMLElement || one instanceof SVGElement) || one === document.body) return null;
      const near = [one, one.nextElementSibling, one.querySelector("polygon")].filter((part) => part !== null);
      const styles = near.flatMap((part) => [getComputedStyle(part), getComputedStyle(part, "::after")]);
      const ring = styles.some((style) => (style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2) || style.boxShadow !== "none" || (style.stroke === "rgb(255, 180, 84)" && parseFloat(style.strokeWidth) >= 2));
      const box = one.getBoundingClientRect();
      const name = one.getAttribute("aria-label") ?? (one as HTMLInputElement).labels?.[0]?.textContent?.trim() ?? one.textContent?.trim() ?? "";
      return { name: name === "" ? `none: ${one.outerHTML.slice(0, 80)}` : name, ring, inside: box.top >= 0 && box.bottom <= window.innerHeight && box.left >= 0 && box.right <= window.innerWidth, place: `${Math.round(box.top)} to ${Math.round(box.bottom)}` };
    });
    if (told === null) break;
    seen.push(told);
  }
  assert.ok(seen.length > 40, `${seen.length} stops`);
  for (const { name, ring, inside, place } of seen) {
    assert.doesNotMatch(name, /^none: /);
    assert.ok(ring, `${name} shows a ring`);
    assert.ok(inside, `${name} is in sight, it is at ${place}`);
  }
});
