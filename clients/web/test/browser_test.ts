// SPDX-License-Identifier: Apache-2.0
// The page in a browser against the real daemon with a real volume. BLOCKWALK_BIN is the folder of the two programs.

import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, parse } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { colourParts } from "../src/slice_query";
import { formatPoints, presetPoints } from "../src/transfer";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import {
  changeAndSettle, difference, drag, dragThumb, launchBrowser, openPage, partOf, readAddress, readImage, readPicture, shareOtherThan, waitForFinal,
} from "./browser";
import { blockwalk, Daemon, freePort } from "./daemon";

const folder = mkdtempSync(join(tmpdir(), "blockwalk-browser-"));
const volumes = ["fossil", "tissue", "corner", "patient"].map((name) => join(folder, `${name}.bwv`)); // rgba8, three channels of u16, a small thing, CT
let browser: Browser;
let daemon: Daemon;

before(async () => {
  makeCorner(volumes[2] ?? "");
  makePatient(volumes[3] ?? "");
  for (const path of volumes.slice(0, 2)) blockwalk("demo", parse(path).name, "-o", path, "--size", "96");
  daemon = await Daemon.start(await freePort(), volumes);
  browser = await launchBrowser();
});

// Empty but for a small ball in a far corner.
function makeCorner(path: string): void {
  const side = 64;
  const voxels = Buffer.alloc(side ** 3);
  for (let i = 0; i < voxels.length; ++i) {
    const [x, y, z] = [i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2)];
    if (Math.hypot(x - 58, y - 58, z - 6) < 5) voxels[i] = 100 + x;
  }
  writeFileSync(join(folder, "corner.raw"), voxels);
  blockwalk("import", join(folder, "corner.raw"), "-o", path, "--dims", "64x64x64", "--type", "u8");
}

// A bone in muscle in air, in Hounsfield units.
function makePatient(path: string): void {
  const side = 48;
  const voxels = Buffer.alloc(2 * side ** 3);
  for (let i = 0; i < side ** 3; ++i) {
    const [x, y, z] = [i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2)];
    const away = Math.hypot(x - 24, y - 24);
    voxels.writeInt16LE((away < 5 ? 700 : away < 20 ? 50 : -1000) + ((7 * x + 5 * y + 3 * z) % 11), 2 * i);
  }
  const header = ["NRRD0004", "type: int16", "dimension: 3", `sizes: ${side} ${side} ${side}`, 'sample units: "HU"', "encoding: raw", "endian: little", "", ""].join("\n");
  writeFileSync(join(folder, "patient.nrrd"), Buffer.concat([Buffer.from(header), voxels]));
  blockwalk("import", join(folder, "patient.nrrd"), "-o", path, "--values", "intensity");
}

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

test("it connects, draws something not background, and a still view gets its full quality", () => open("", async (page) => {
  assert.ok(shareOtherThan(await readPicture(page), [0, 0, 0]) > 0.02);
  assert.equal(await page.textContent("#badge"), "Full quality");
}));

test("a small thing in a corner fills the picture of page, server and command line alike", () => open("#volume=corner", async (page) => {
  const shown = await readPicture(page);
  // A ball is half as high as the corners of its box are apart, and the picture is twice as wide as high. Framed by all of
  // the volume it would be less than a hundredth.
  assert.ok(shareOtherThan(shown, [0, 0, 0]) > 0.05, `${shareOtherThan(shown, [0, 0, 0])}`);
  const size = await page.evaluate(() => `${document.querySelector("canvas")?.width}x${document.querySelector("canvas")?.height}`);
  const got = Buffer.from(await (await fetch(`http://127.0.0.1:${daemon.port}/api/v1/volumes/corner/image?size=${size}`)).arrayBuffer());
  blockwalk("render", volumes[2] ?? "", "-o", join(folder, "corner.png"), "--size", size);
  assert.ok(got.equals(readFileSync(join(folder, "corner.png"))), "the server draws what the command line draws");
  assert.ok(difference(shown, await readImage(page, `/api/v1/volumes/corner/image?size=${size}`)) < 0.001);
  await changeAndSettle(page, () => drag(page, 90, 30));
  await changeAndSettle(page, () => page.keyboard.press("r"));
  assert.ok(difference(shown, await readPicture(page)) < 0.001, "and so does a reset");
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
  await page.click("#advanced summary");
  for (const mode of ["first-hit", "iso", "mip", "minip", "attenuated-mip", "mean", "blocks", "blend"]) {
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

const redsOf = (page: Page, address: string): Promise<readonly number[]> => page.evaluate(async (from) => {
  const picture = await createImageBitmap(await (await fetch(from)).blob());
  const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
  context?.drawImage(picture, 0, 0);
  return [...(context?.getImageData(0, 0, picture.width, picture.height).data ?? [])].filter((_, i) => i % 4 === 0);
}, address);

test("slices from black to white have each drawn channel's own window, as the server reads it", async () => {
  const { page } = await openPage(browser, `http://127.0.0.1:${daemon.port}/#volume=tissue`, kWindow); // which decodes pictures
  const address = `http://127.0.0.1:${daemon.port}/api/v1/volumes/tissue`;
  const volume = parseVolumeInfo((await (await fetch(address)).json()) as unknown);
  const windows = [[0, 9000], [2000, 30000], [500, 40000]] as const;
  const transfers = windows.map(([black, white]) => `${black}:200000:0,${white}:ff2040:1`);
  for (const drawn of [[1], [0, 2], [2]]) {
    const parts = colourParts(initialView(volume, [64, 64], { drawn, transfers }), volume, true);
    const query = `${address}/slice?axis=z&index=20&level=0&${parts.join("&")}&format=png`;
    const response = await fetch(query);
    const said = JSON.parse(response.headers.get("x-blockwalk-slice") ?? "{}") as { window?: unknown; channels?: unknown };
    assert.deepEqual([response.status, said.channels, said.window], [200, drawn, drawn.map((number) => windows[number])]);
    // Grey, and each channel's: what one channel alone is, in sum.
    const alone = await Promise.all(drawn.map(async (number) => {
      const [black, white] = windows[number] ?? [];
      return redsOf(page, `${address}/slice?axis=z&index=20&level=0&channels=${number}&window=${";".repeat(number)}${black}:${white}&format=png`);
    }));
    const pixels = await redsOf(page, query);
    assert.ok(pixels.some((value) => value > 0 && value < 255));
    assert.ok(pixels.every((value, i) => Math.abs(value - Math.min(255, alone.reduce((sum, own) => sum + (own[i] ?? 0), 0))) <= drawn.length), `channels ${drawn}`);
    const coloured = colourParts(initialView(volume, [64, 64], { drawn, transfers }), volume, false);
    assert.equal((await fetch(`${address}/slice?axis=z&index=20&${coloured.join("&")}`)).status, 200);
  }
  await page.context().close();
});

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

test("contrast, a cut and a parallel picture are drawn, and the address restores them", () => open("#volume=tissue", async (page) => {
  const plain = await readPicture(page);
  await changeAndSettle(page, () => page.locator(partOf(0, ".channel-colour")).fill("#ff2200"));
  const coloured = await readPicture(page);
  assert.ok(difference(plain, coloured) > 0.02);
  await page.focus(".cut-row:nth-child(1) .thumb.lo");
  await changeAndSettle(page, async () => {
    for (let i = 0; i < 4; i++) await page.keyboard.press("PageUp");
  });
  const cut = await readPicture(page);
  assert.ok(difference(coloured, cut) > 0.02);
  await changeAndSettle(page, () => page.check("#ortho"));
  await changeAndSettle(page, () => page.keyboard.press("1"));
  const picture = await readPicture(page);
  const address = await readAddress(page);
  assert.ok(address.has("tf") && address.has("clip") && address.has("ortho"));
  await open(`#${address.toString()}`, async (copy) => {
    assert.ok(difference(picture, await readPicture(copy)) < 0.01);
  });
}));

const kMapNames = ["grey", "viridis", "cividis", "inferno"] as const;

test("the points of a map are those that the server draws", async () => {
  for (const id of ["patient", "corner", "tissue"]) {
    const address = `http://127.0.0.1:${daemon.port}/api/v1/volumes/${id}`;
    const { channels } = parseVolumeInfo((await (await fetch(address)).json()) as unknown);
    const picture = async (tf: string): Promise<Buffer> => Buffer.from(await (await fetch(`${address}/image?size=96x64&filter=linear&format=raw&tf=${tf}`)).arrayBuffer());
    for (const name of kMapNames) {
      const points = channels.map((channel) => formatPoints(presetPoints(name, channel) ?? []));
      const [own, servers] = [await picture(points.join(";")), await picture(channels.map(() => name).join(";"))];
      assert.equal(own.length, servers.length);
      assert.ok(own.every((part, i) => Math.abs(part - (servers[i] ?? 0)) <= 1), `${name} of ${id}: ${points.join(";")}`);
    }
  }
});

test("of CT every map changes the picture, in its own window and in another, and the first one comes back", () => open("#volume=patient", async (page) => {
  const first = await readPicture(page);
  const choose = async (name: string): Promise<readonly number[]> => {
    await changeAndSettle(page, async () => void (await page.selectOption("#preset", name)));
    return readPicture(page);
  };
  const shown = [first];
  for (const name of [...kMapNames, "ct-bone"]) {
    const picture = await choose(name);
    for (const other of shown) assert.ok(difference(other, picture) > 0.02, name);
    shown.push(picture);
  }
  const map = await choose("viridis");
  await page.fill(partOf(0, ".white-value"), "2500");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.ok(difference(map, await readPicture(page)) > 0.02, "another window");
  assert.equal(await page.inputValue("#preset"), "viridis");
  assert.ok(difference(first, await choose("auto")) < 0.01);
  assert.ok(difference(first, await choose("colour")) > 0.02);
  await changeAndSettle(page, () => page.click(partOf(0, ".reset-contrast")));
  assert.ok(difference(first, await readPicture(page)) < 0.01);
  assert.equal((await readAddress(page)).has("tf"), false);
}));

test("a double click turns about what is there", () => open("", async (page) => {
  const before = (await readAddress(page)).get("target");
  const box = await page.locator("#canvas").boundingBox();
  assert.ok(box);
  await changeAndSettle(page, () => page.dblclick("#canvas", { position: { x: box.width / 2 + 40, y: box.height / 2 } }));
  assert.notEqual((await readAddress(page)).get("target"), before);
}));

test("a killed and restarted server gets the view again", () => open("", async (page) => {
  await changeAndSettle(page, () => drag(page, 80, -50));
  const picture = await readPicture(page);
  await daemon.stop("SIGKILL");
  await page.waitForSelector("#overlay:has-text('Reconnecting')");
  daemon = await Daemon.start(daemon.port, volumes);
  await page.waitForSelector("#overlay", { state: "hidden" });
  await waitForFinal(page);
  assert.ok(difference(picture, await readPicture(page)) < 0.01);
  await changeAndSettle(page, () => page.keyboard.press("r"));
  assert.ok(difference(picture, await readPicture(page)) > 0.02);
}));
