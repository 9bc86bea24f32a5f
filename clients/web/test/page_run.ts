// SPDX-License-Identifier: Apache-2.0
// One mock server and one page a test, for the tests of the page in a browser.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { after, before } from "node:test";
import type { Browser, Page } from "playwright-core";
import { kDesktop, kPhone, launchBrowser, openPage } from "./browser";
import { MockServer, type ListedVolume } from "./mock_server";

declare const PAGE_FOLDER: string; // where the build put the page
export const kPageFolder = PAGE_FOLDER;

export const kVolumes: readonly ListedVolume[] = [
  { id: "fossil", state: "ready", type: "rgba8" },
  { id: "vessels", state: "ready", type: "u8" },
  { id: "broken", state: "failed", type: "u8", error: "broken.bwv: chunk 3: wrong checksum" },
];
export const kCells: readonly ListedVolume[] = [{ id: "cells", state: "ready", type: "u16", channelNames: ["nuclei", "membranes", ""] }];
let browser: Browser;
before(async () => { browser = await launchBrowser(); });
after(() => browser.close());

export interface Run {
  readonly page: Page;
  readonly mock: MockServer;
  readonly port: number;
}

// One mock and one page a test; the page must have thrown nothing.
export async function run(options: { volumes?: readonly ListedVolume[]; hash?: string; phone?: boolean }, body: (run: Run) => Promise<void>): Promise<void> {
  const mock = new MockServer(PAGE_FOLDER, options.volumes ?? kVolumes);
  const port = await mock.start();
  const viewport = options.phone ? kPhone : kDesktop;
  const { page, faults } = await openPage(browser, `http://127.0.0.1:${port}/${options.hash ?? ""}`, viewport, options.phone);
  try {
    await body({ page, mock, port });
    assert.deepEqual(faults, []);
  } finally {
    await page.context().close();
    await mock.stop();
  }
}

// For people who want to look: BLOCKWALK_SCREENSHOTS names a folder.
export async function screenshot(page: Page, name: string): Promise<void> {
  const folder = process.env["BLOCKWALK_SCREENSHOTS"];
  if (folder === undefined) return;
  mkdirSync(folder, { recursive: true });
  await page.screenshot({ path: `${folder}/${name}.png` });
}
