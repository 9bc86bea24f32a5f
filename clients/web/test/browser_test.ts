// SPDX-License-Identifier: Apache-2.0
// The page in a browser against the real daemon with a real volume. BLOCKWALK_BIN is the folder of the two programs.

import assert from "node:assert/strict";
import { execFileSync, spawn, type ChildProcess } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join, parse } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import {
  changeAndSettle, difference, drag, dragThumb, launchBrowser, openPage, partOf, readAddress, readPicture, shareOtherThan, waitForFinal,
} from "./browser";

const kReadyWithinMs = 60000;

const programs = process.env["BLOCKWALK_BIN"];
if (programs === undefined) throw new Error("BLOCKWALK_BIN must name the folder that holds blockwalk and blockwalkd");
const folder = mkdtempSync(join(tmpdir(), "blockwalk-browser-"));
const volumes = ["fossil", "tissue"].map((name) => join(folder, `${name}.bwv`)); // rgba8, three channels of u16
let browser: Browser;
let daemon: Daemon;

class Daemon {
  private constructor(private readonly process: ChildProcess, readonly port: number) {}

  static async start(port: number): Promise<Daemon> {
    const child = spawn(join(programs ?? "", "blockwalkd"), ["--listen", `127.0.0.1:${port}`, ...volumes], { stdio: ["ignore", "inherit", "inherit"] });
    const daemon = new Daemon(child, port);
    const deadline = Date.now() + kReadyWithinMs;
    while (!(await daemon.isReady())) {
      if (child.exitCode !== null) throw new Error(`blockwalkd ended with ${child.exitCode}`);
      if (Date.now() > deadline) throw new Error(`blockwalkd is not ready after ${kReadyWithinMs} ms`);
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    return daemon;
  }

  async stop(signal: NodeJS.Signals): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill(signal);
    await ended;
  }

  private async isReady(): Promise<boolean> {
    try {
      return (await fetch(`http://127.0.0.1:${this.port}/readyz`)).ok;
    } catch {
      return false; // not listening yet
    }
  }
}

async function freePort(): Promise<number> {
  const probe = createServer();
  await new Promise<void>((resolve) => probe.listen(0, "127.0.0.1", resolve));
  const address = probe.address();
  await new Promise((resolve) => probe.close(resolve));
  if (address === null || typeof address === "string") throw new Error("no free port");
  return address.port;
}

before(async () => {
  for (const path of volumes) execFileSync(join(programs, "blockwalk"), ["demo", parse(path).name, "-o", path, "--size", "96"], { stdio: "inherit" });
  daemon = await Daemon.start(await freePort());
  browser = await launchBrowser();
});

after(async () => {
  await browser?.close();
  await daemon?.stop("SIGTERM");
  rmSync(folder, { recursive: true });
});

// A small window: software devices draw it in tens of milliseconds.
const kWindow = { width: 1004, height: 480 };

async function open(hash: string, body: (page: Page) => Promise<void>): Promise<void> {
  const { page, faults } = await openPage(browser, `http://127.0.0.1:${daemon.port}/${hash}`, kWindow);
  try {
    await waitForFinal(page);
    await body(page);
    assert.deepEqual(faults, []);
    assert.equal(await page.locator(".toast").count(), 0, "no problem was reported");
  } finally {
    const shots = process.env["BLOCKWALK_SCREENSHOTS"];
    if (shots !== undefined) {
      mkdirSync(shots, { recursive: true });
      await page.screenshot({ path: join(shots, `daemon-${Date.now()}.png`) });
    }
    await page.context().close();
  }
}

test("it connects, draws something not background, and a still view becomes lossless", () => open("", async (page) => {
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.02);
  assert.equal(await page.textContent("#badge"), "Lossless");
}));

test("a drag changes the picture, and resetting brings it back", () => open("", async (page) => {
  const home = await readPicture(page);
  await changeAndSettle(page, () => drag(page, 150, 40));
  assert.ok(difference(home, await readPicture(page)) > 0.02);
  await changeAndSettle(page, () => page.keyboard.press("r"));
  assert.ok(difference(home, await readPicture(page)) < 0.01);
}));

test("moving a thumb of the range changes the picture", () => open("", async (page) => {
  const home = await readPicture(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.6));
  assert.ok(difference(home, await readPicture(page)) > 0.02);
}));

test("every mode draws, and on any background", () => open("#background=ffffff", async (page) => {
  for (const mode of ["first-hit", "iso", "mip", "mean", "blocks", "blend"]) {
    await changeAndSettle(page, () => page.check(`input[value=${mode}]`));
    assert.ok(shareOtherThan(await readPicture(page), [255, 255, 255]) > 0.02, mode);
  }
}));

test("light and smoothing change the picture", () => open("#mode=first-hit", async (page) => {
  const plain = await readPicture(page);
  await changeAndSettle(page, () => page.check("#lit"));
  const lit = await readPicture(page);
  assert.ok(difference(plain, lit) > 0.02);
  await changeAndSettle(page, () => page.check("#smooth"));
  assert.ok(difference(lit, await readPicture(page)) > 0.005);
}));

test("the address restores the picture", () => open("", async (page) => {
  await changeAndSettle(page, () => drag(page, -90, 60));
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.3));
  const picture = await readPicture(page);
  const address = await readAddress(page);
  await open(`#${address.toString()}`, async (copy) => {
    assert.ok(difference(picture, await readPicture(copy)) < 0.01);
  });
}));

test("channels and their ranges change the picture, and the address restores it", () => open("#volume=tissue", async (page) => {
  assert.deepEqual(await page.locator(".channel-name").allInnerTexts(), ["nuclei", "membranes", "marker"]);
  const all = await readPicture(page);
  await changeAndSettle(page, () => page.locator(partOf(1, "input[type=checkbox]")).uncheck());
  const without = await readPicture(page);
  assert.ok(difference(all, without) > 0.02);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.6, 0));
  const picture = await readPicture(page);
  assert.ok(difference(without, picture) > 0.02);
  const address = await readAddress(page);
  assert.equal(address.get("channels"), "0,2");
  await open(`#${address.toString()}`, async (copy) => {
    assert.ok(difference(picture, await readPicture(copy)) < 0.01);
  });
}));

test("a killed and restarted server gets the view again", () => open("", async (page) => {
  await changeAndSettle(page, () => drag(page, 80, -50));
  const picture = await readPicture(page);
  await daemon.stop("SIGKILL");
  await page.waitForSelector("#overlay:has-text('Reconnecting')");
  daemon = await Daemon.start(daemon.port);
  await page.waitForSelector("#overlay", { state: "hidden" });
  await waitForFinal(page);
  assert.ok(difference(picture, await readPicture(page)) < 0.01);
  await changeAndSettle(page, () => page.keyboard.press("r"));
  assert.ok(difference(picture, await readPicture(page)) > 0.02);
}));
