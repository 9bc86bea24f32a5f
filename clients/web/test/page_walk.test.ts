// SPDX-License-Identifier: Apache-2.0
// Walks of random acts through the page, some of them refused by the server: after each what the controls say is the view
// that the newest frame shows, and so is the address.

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Page } from "playwright-core";
import { chooseVolume, drag, waitForFinal } from "./browser";
import type { ListedVolume, MockServer } from "./mock_server";
import { run } from "./page_run";
import { parseVolumeInfo, type VolumeInfo } from "../src/volume_info";
import { sampleLabels, sampleVolume } from "./sample_volume";
import { checkAddress, checkControls, randomFrom } from "./walk";

const kActs = 100; // a walk
const kVolumes: readonly ListedVolume[] = [
  { id: "fossil", state: "ready", type: "rgba8" },
  { id: "vessels", state: "ready", type: "u8" },
  { id: "cells", state: "ready", type: "u16", channelNames: ["nuclei", "membranes", "marker"] },
  { id: "organs", state: "ready", type: "u8", labels: 60 },
];
const infoOf = ({ id, type, channelNames, labels }: ListedVolume): VolumeInfo => parseVolumeInfo(labels === undefined ? sampleVolume(id, type, channelNames) : sampleLabels(id, labels));

type Act = (page: Page, random: () => number) => Promise<unknown>;
const pick = <T>(items: readonly T[], random: () => number): T => {
  const item = items[Math.floor(random() * items.length)];
  assert.ok(item !== undefined);
  return item;
};

// One of those that are seen and can be used; nothing where there are none.
async function one(page: Page, selector: string, random: () => number, act: (index: number) => Promise<unknown>): Promise<unknown> {
  const usable = await page.locator(selector).evaluateAll((all) => all.flatMap((element, index) => {
    const isUsable = element.checkVisibility() && !(element as HTMLInputElement).disabled && element.getBoundingClientRect().width > 0;
    return isUsable ? [index] : [];
  }));
  return usable.length === 0 ? undefined : act(pick(usable, random));
}
// By the element itself: what is scrolled away or under something else counts too, and a switch may go back at once.
const click = (selector: string): Act => (page, random) => one(page, selector, random, (index) => page.locator(selector).nth(index).evaluate((element) => (element as HTMLElement).click()));
const press = (selector: string, keys: readonly string[]): Act => (page, random) => one(page, selector, random, async (index) => {
  await page.locator(selector).nth(index).evaluate((element) => (element as HTMLElement).focus());
  for (let i = 0; i < 1 + Math.floor(4 * random()); i++) await page.keyboard.press(pick(keys, random));
});
const type = (selector: string, text: (random: () => number) => string): Act => (page, random) => one(page, selector, random, async (index) => {
  await page.locator(selector).nth(index).fill(text(random));
  await page.keyboard.press("Enter");
});
const slide = (selector: string): Act => (page, random) => one(page, selector, random, (index) => page.locator(selector).nth(index).evaluate((element, share) => {
  const slider = element as HTMLInputElement;
  slider.value = String(Number(slider.min) + share * (Number(slider.max) - Number(slider.min)));
  slider.dispatchEvent(new Event("input", { bubbles: true }));
}, random()));
const choose = (selector: string): Act => (page, random) => one(page, selector, random, async (index) => {
  const select = page.locator(selector).nth(index);
  const values = await select.evaluate((element) => [...(element as HTMLSelectElement).options].filter((option) => !option.hidden && !option.disabled).map((option) => option.value));
  return select.selectOption(pick(values, random));
});
const arrows = ["ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End"];
const hex = (random: () => number): string => `#${Math.floor(random() * 0x1000000).toString(16).padStart(6, "0")}`;
const value = (random: () => number): string => pick(["20", "99.5", "150", "1100", "240", "-3", "x", ""], random);

const acts: Readonly<Record<string, Act>> = {
  mode: click("input[name=mode]"),
  switches: click("#smooth, #lit, #ortho, #show-box, #stretch"),
  background: click("input[name=background]"),
  ownBackground: (page, random) => page.locator("#own-background").fill(hex(random)),
  preset: choose("#preset"),
  iso: slide("#iso"),
  extinction: slide("#extinction"),
  attenuation: slide("#attenuation"),
  rangeKeys: press(".range-track .thumb", arrows),
  rangeTyped: type(".range-values input", value),
  rangeReset: click(".reset-range"),
  channel: click(".channel:not(.single) .channel-head input[type=checkbox]"),
  colour: (page, random) => one(page, ".channel-colour", random, (index) => page.locator(".channel-colour").nth(index).fill(hex(random))),
  points: press(".point", arrows),
  pointTyped: type(".contrast-grid input[type=text]", value),
  gamma: slide(".gamma, .contrast-grid .opacity"),
  contrastButtons: click(".auto-contrast, .reset-contrast"),
  cutKeys: press(".cut-track .thumb", arrows),
  cutReset: click("#cut-reset"),
  planeButtons: click("#plane-add, .plane-flip, .plane-remove"),
  planeWay: choose(".plane select"),
  planePlace: slide(".plane input"),
  samples: choose("select[name=samples]"),
  labels: click(".label-row input, .label-row button, .label-all, .label-none"),
  editor: click(".edit-transfer, #tf-close, #tf-presets button, #tf-add, #tf-remove, #tf-after, #tf-before"),
  editorKeys: press(".tf-point", ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown", "Insert", "Delete", "Home", "End"]),
  editorTyped: type("#tf-value, #tf-opacity", value),
  history: click("#undo-button, #redo-button"),
  bookmarks: click("#bookmark-add, .bookmark-go, .bookmark .icon-button"),
  camera: (page, random) => drag(page, 200 * (random() - 0.5), 100 * (random() - 0.5)),
  wheel: (page, random) => page.mouse.wheel(0, 400 * (random() - 0.5)),
  side: (page, random) => page.locator("#axes").press(pick(["1", "2", "3", "4", "5", "6", "r"], random)).catch(() => undefined),
};
const kNames = Object.keys(acts);
const kRefusable = ["mode", "lit", "filter", "background"];

// The newest view's last frame is on the screen, and nothing else is on its way.
async function settle(page: Page, mock: MockServer): Promise<void> {
  let seen = "";
  for (;;) {
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    await page.waitForFunction(() => document.getElementById("stage")?.dataset["final"] === "true");
    const now = `${mock.views.length} ${mock.newest?.seq} ${await page.getAttribute("#stage", "data-frame")}`;
    if (now === seen && mock.newest?.final === true && now.endsWith(` ${mock.newest.seq}`)) return;
    seen = now;
  }
}

for (const seed of [1, 2, 3]) {
  test(`what the page says is what was drawn, after each of ${kActs} random acts, walk ${seed}`, { timeout: 280000 }, () => run({ volumes: kVolumes, hash: `#volume=${kVolumes[seed % kVolumes.length]?.id}` }, async ({ page, mock }) => {
    mock.finalAfterMs = 20;
    const random = randomFrom(seed);
    let listed = kVolumes[seed % kVolumes.length];
    await waitForFinal(page);
    await page.click("#advanced summary");
    const done: string[] = [];
    for (let step = 0; step < kActs; step++) {
      const isRefused = random() < 0.06;
      if (isRefused) {
        const member = pick(kRefusable, random);
        mock.refused = { member, value: { mode: "mip", lit: true, filter: "linear", background: "ffffff" }[member] };
      }
      const name = random() < 0.03 ? "volume" : pick(kNames, random);
      done.push(`${name}${mock.refused === null ? "" : ` (no ${mock.refused.member} ${String(mock.refused.value)})`}`);
      if (name === "volume") {
        mock.refused = null;
        listed = pick(kVolumes, random);
        await chooseVolume(page, listed.id);
        await page.waitForFunction((id) => document.title.startsWith(id), listed.id);
      } else await acts[name]?.(page, random);
      await settle(page, mock);
      assert.ok(listed && mock.newest);
      const context = `seed ${seed}, after ${done.slice(-8).join(", ")}`;
      await checkControls(page, mock.newest.view, infoOf(listed), context);
      if (step % 4 === 3) await checkAddress(page, mock.newest.view, infoOf(listed), context);
      if (!isRefused) mock.refused = null;
    }
    assert.ok(new Set(done).size > 15, "it went everywhere");
  }));
}
