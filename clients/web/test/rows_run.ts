// SPDX-License-Identifier: Apache-2.0
// One daemon for all rows, a page for each, and what they read from pictures. BLOCKWALK_SCREENSHOTS names a folder for the
// page at three sizes after each of them.

import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { launchBrowser, openPage, readAddress } from "./browser";
import { Daemon, freePort } from "./daemon";
import { makeVolumes } from "./rows_volumes";

const kSizes = [{ width: 1400, height: 900 }, { width: 1024, height: 768 }, { width: 390, height: 844 }] as const;
const kWindow = { width: 1024, height: 500 }; // software devices draw it soon
const kPatienceMs = 60000; // of one wait, where others share the device
const kLeastPixels = 30; // of a patch

export const folder = mkdtempSync(join(tmpdir(), "blockwalk-rows-"));
let browser: Browser;
let daemon: Daemon;
let hasAbdomen = false;

before(async () => {
  const volumes = makeVolumes(folder);
  hasAbdomen = volumes.hasAbdomen;
  daemon = await Daemon.start(await freePort(), volumes.files);
  browser = await launchBrowser();
});

after(async () => {
  await browser?.close();
  await daemon?.stop("SIGTERM");
  rmSync(folder, { recursive: true });
});

interface RowOptions {
  readonly show?: string; // of the panel, in screenshots
  readonly hasTouch?: boolean;
  readonly window?: { readonly width: number; readonly height: number };
  readonly needsAbdomen?: boolean;
}

export interface Row {
  readonly page: Page;
  readonly address: string; // of the server
  open(hash: string, body: (page: Page) => Promise<void>): Promise<void>; // in another window
}

export function row(name: string, hash: string, body: (row: Row) => Promise<void>, options: RowOptions = {}): void {
  test(name, async (context) => {
    if (options.needsAbdomen && !hasAbdomen) return context.skip("the real volume is not here");
    await visit(hash, options, async (page) => {
      const open = (other: string, act: (page: Page) => Promise<void>): Promise<void> => visit(other, {}, act);
      await body({ page, address: daemon.address, open });
      await keepPictures(page, name.replace(/[^\w]+/g, "-").slice(0, 48), options.show);
    });
  });
}

async function visit(hash: string, { hasTouch = false, window = kWindow }: RowOptions, body: (page: Page) => Promise<void>): Promise<void> {
  const { page, faults } = await openPage(browser, `${daemon.address}${hash}`, window, hasTouch);
  page.setDefaultTimeout(kPatienceMs);
  try {
    await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
    await settle(page);
    await body(page);
    assert.deepEqual(faults, []);
    assert.equal(await page.locator(".toast").count(), 0, "no problem was reported");
  } finally {
    await page.context().close();
  }
}

async function keepPictures(page: Page, name: string, show: string | undefined): Promise<void> {
  const shots = process.env["BLOCKWALK_SCREENSHOTS"];
  if (shots === undefined) return;
  mkdirSync(shots, { recursive: true });
  for (const size of kSizes) {
    await page.setViewportSize(size);
    await page.waitForTimeout(600);
    await settle(page);
    const bring = async (): Promise<void> => {
      if (show !== undefined) await page.locator(show).first().evaluate((part) => part.scrollIntoView({ block: "center" }));
      await page.waitForTimeout(300);
    };
    await bring();
    await page.screenshot({ path: join(shots, `${name}-${size.width}.png`) });
    if (size.width > 720 || (await page.locator("dialog[open]").count()) > 0 || (await page.isVisible("#tf-editor"))) continue;
    await page.click("#sheet-handle", { position: { x: 20, y: 12 } });
    await page.waitForTimeout(600);
    await settle(page);
    await bring();
    await page.screenshot({ path: join(shots, `${name}-${size.width}-sheet.png`) });
  }
}

// The picture is final, and so is each slice that is shown.
export async function settle(page: Page): Promise<void> {
  await page.waitForSelector("#stage[data-stream=live][data-final=true]", { state: "attached" });
  await page.waitForFunction(() => [...document.querySelectorAll(".slice:not([hidden])")].every((slice) => slice.getAttribute("data-settled") === "true"));
}

// The newest picture fills the room it has now, and is final.
export async function fill(page: Page): Promise<void> {
  await page.waitForFunction(() => {
    const canvas = document.getElementById("canvas");
    const size = [canvas?.clientWidth ?? 0, canvas?.clientHeight ?? 0].map((side) => Math.floor(side * devicePixelRatio));
    return document.getElementById("figure-size")?.textContent?.startsWith(size.join(" × "));
  });
  await settle(page);
}

export interface Patch {
  readonly count: number;
  readonly x: number; // its middle, in shares of the canvas
  readonly y: number;
  readonly left: number;
  readonly right: number;
  readonly top: number;
  readonly bottom: number;
}
export type Patches = ReadonlyMap<string, Patch>; // by rrggbb

// Where each colour is of a canvas; those of few pixels are left out.
export async function patches(page: Page, selector = "#canvas"): Promise<Patches> {
  const found = await page.locator(selector).evaluate((node, least) => {
    const { width, height } = node as HTMLCanvasElement;
    const copy = new OffscreenCanvas(width, height).getContext("2d");
    copy?.drawImage(node as HTMLCanvasElement, 0, 0);
    const pixels = new Uint32Array(copy?.getImageData(0, 0, width, height).data.buffer ?? new ArrayBuffer(0));
    const sums = new Map<number, number[]>();
    pixels.forEach((pixel, i) => {
      const [x, y] = [i % width, Math.floor(i / width)];
      let sum = sums.get(pixel);
      if (sum === undefined) sums.set(pixel, (sum = [0, 0, 0, width, -1, height, -1]));
      const [count = 0, sx = 0, sy = 0, left = 0, right = 0, top = 0, bottom = 0] = sum;
      sum.splice(0, 7, count + 1, sx + x + 0.5, sy + y + 0.5, Math.min(left, x), Math.max(right, x), Math.min(top, y), Math.max(bottom, y));
    });
    const hex = (part: number): string => (part & 255).toString(16).padStart(2, "0");
    return [...sums].filter(([, [count = 0]]) => count >= least).map(([pixel, [count = 0, x = 0, y = 0, left = 0, right = 0, top = 0, bottom = 0]]) => [
      hex(pixel) + hex(pixel >> 8) + hex(pixel >> 16),
      { count, x: x / count / width, y: y / count / height, left: left / width, right: (right + 1) / width, top: top / height, bottom: (bottom + 1) / height },
    ] as const);
  }, kLeastPixels);
  return new Map(found);
}

export const grey = (value: number): string => Math.round(value).toString(16).padStart(2, "0").repeat(3);

// The patch of a colour, which must be there.
export function patchOf(all: Patches, colour: string): Patch {
  const patch = all.get(colour);
  assert.ok(patch, `there is ${colour} in ${[...all.keys()].slice(0, 20).join()}`);
  return patch;
}

// How bright it is on average: 0 to 255, of what is not black.
export function brightness(all: Patches): number {
  let [sum, count] = [0, 0];
  for (const [colour, patch] of all) {
    if (colour === "000000") continue;
    sum += patch.count * ([0, 2, 4].reduce((total, at) => total + parseInt(colour.slice(at, at + 2), 16), 0) / 3);
    count += patch.count;
  }
  return count === 0 ? 0 : sum / count;
}

// The colour of a point of a canvas, in shares of it.
export async function colourAt(page: Page, selector: string, x: number, y: number): Promise<string> {
  return page.locator(selector).evaluate((node, [s = 0, t = 0]) => {
    const { width, height } = node as HTMLCanvasElement;
    const copy = new OffscreenCanvas(1, 1).getContext("2d");
    copy?.drawImage(node as HTMLCanvasElement, -Math.floor(s * width), -Math.floor(t * height));
    return [...(copy?.getImageData(0, 0, 1, 1).data ?? [])].slice(0, 3).map((part) => part.toString(16).padStart(2, "0")).join("");
  }, [x, y]);
}

// The middle of an element and its size, CSS pixels; it is scrolled into sight.
export async function frameOf(page: Page, selector: string): Promise<{ readonly x: number; readonly y: number; readonly width: number; readonly height: number }> {
  await page.locator(selector).scrollIntoViewIfNeeded();
  const box = await page.locator(selector).boundingBox();
  assert.ok(box);
  return { x: box.x + box.width / 2, y: box.y + box.height / 2, width: box.width, height: box.height };
}

// Pixels of the picture in 3D of a point of the head, where it is seen from the front and parallel.
export async function frontPlacer(page: Page): Promise<(x: number, z: number) => readonly [number, number]> {
  const address = await readAddress(page);
  const [tx = 0, , tz = 0] = (address.get("target") ?? "").split(",").map(Number);
  const frame = await frameOf(page, "#canvas");
  const unit = Number(address.get("ortho")) / frame.height;
  return (x, z) => [frame.x + (x - tx) / unit, frame.y - (z - tz) / unit];
}

export const press = async (page: Page, key: string, times = 1): Promise<void> => {
  for (let i = 0; i < times; ++i) await page.keyboard.press(key);
};
