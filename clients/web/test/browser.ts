// SPDX-License-Identifier: Apache-2.0
// Chromium for the tests, and what they read from and do to the page.

import assert from "node:assert/strict";
import { chromium, type Browser, type Page } from "playwright-core";

const kArguments = [
  "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--disable-quic",
];
export const kDesktop = { width: 1440, height: 900 };
export const kPhone = { width: 390, height: 844 };
export const kPatienceMs = 20000;

export function launchBrowser(): Promise<Browser> {
  return chromium.launch({ executablePath: process.env["BLOCKWALK_CHROMIUM"] ?? "/usr/bin/chromium", args: kArguments });
}

export interface OpenedPage {
  readonly page: Page;
  readonly faults: string[]; // exceptions, and errors on the console that no server restart explains
}

export async function openPage(browser: Browser, url: string, viewport = kDesktop, hasTouch = false): Promise<OpenedPage> {
  const context = await browser.newContext({ viewport, hasTouch, colorScheme: "dark" });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatienceMs);
  const faults: string[] = [];
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("console", (message) => {
    const isExpected = /WebSocket connection|Failed to load resource|ERR_CONNECTION/.test(message.text());
    if (message.type() === "error" && !isExpected) faults.push(message.text());
  });
  await page.goto(url);
  return { page, faults };
}

// Waits until the picture is as good as it gets for the view it shows.
export async function waitForFinal(page: Page): Promise<void> {
  await page.waitForSelector("#stage[data-stream=live][data-final=true]");
}

// Runs an act that changes the view, then waits for a newer frame, and for the final one.
export async function changeAndSettle(page: Page, act: () => Promise<void>): Promise<void> {
  const before = await page.getAttribute("#stage", "data-frame");
  await act();
  await page.waitForFunction((frame) => document.getElementById("stage")?.dataset["frame"] !== frame, before);
  // A refinement already under way may pass for the answer: the one that counts follows a view sent after this pause.
  await page.waitForTimeout(150);
  await waitForFinal(page);
}

// A picture as a coarse grid of colours, enough to tell two apart.
export async function readPicture(page: Page): Promise<readonly number[]> {
  return page.evaluate(() => {
    const canvas = document.getElementById("canvas");
    if (!(canvas instanceof HTMLCanvasElement)) throw new Error("no canvas");
    const small = new OffscreenCanvas(64, 48);
    const context = small.getContext("2d");
    if (context === null) throw new Error("no 2D context");
    context.drawImage(canvas, 0, 0, 64, 48);
    return [...context.getImageData(0, 0, 64, 48).data];
  });
}

// The same of an image of the server's.
export async function readImage(page: Page, path: string): Promise<readonly number[]> {
  return page.evaluate(async (address) => {
    const image = await createImageBitmap(await (await fetch(address)).blob());
    const context = new OffscreenCanvas(64, 48).getContext("2d");
    if (context === null) throw new Error("no 2D context");
    context.drawImage(image, 0, 0, 64, 48);
    return [...context.getImageData(0, 0, 64, 48).data];
  }, path);
}

// Share of the grid's points whose colour differs by more than a few steps.
export function difference(a: readonly number[], b: readonly number[]): number {
  assert.equal(a.length, b.length);
  let differing = 0;
  for (let i = 0; i < a.length; i += 4) {
    const largest = Math.max(...[0, 1, 2].map((c) => Math.abs((a[i + c] ?? 0) - (b[i + c] ?? 0))));
    if (largest > 6) differing++;
  }
  return differing / (a.length / 4);
}

// Share of the picture that is not this colour.
export function shareOtherThan(picture: readonly number[], colour: readonly [number, number, number]): number {
  const flat = picture.map((_, i) => (i % 4 === 3 ? 255 : (colour[i % 4] ?? 0)));
  return difference(picture, flat);
}

export async function drag(page: Page, dx: number, dy: number): Promise<void> {
  const box = await page.locator("#canvas").boundingBox();
  assert.ok(box);
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx, y + dy, { steps: 6 });
  await page.mouse.up();
}

// The selector of a part of a channel's row.
export const partOf = (channel: number, selector: string): string => `.channel[data-channel="${channel}"] ${selector}`;

export async function chooseVolume(page: Page, id: string): Promise<void> {
  if (await page.locator("#picker-list").isHidden()) await page.click("#picker-button");
  await page.click(`[data-volume=${id}]`);
}

// Drags a thumb of a channel's range by a share of the track.
export async function dragThumb(page: Page, end: "lo" | "hi", share: number, channel = 0): Promise<void> {
  const box = (selector: string) => page.locator(partOf(channel, selector)).boundingBox();
  const [thumb, track] = [await box(`.thumb.${end}`), await box(".range-track")];
  assert.ok(thumb && track);
  const [x, y] = [thumb.x + thumb.width / 2, thumb.y + thumb.height - 8];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + share * track.width, y, { steps: 5 });
  await page.mouse.up();
}

// The address once it says what the page shows.
export async function readAddress(page: Page): Promise<URLSearchParams> {
  await page.waitForTimeout(400);
  return new URLSearchParams(new URL(page.url()).hash.slice(1));
}
