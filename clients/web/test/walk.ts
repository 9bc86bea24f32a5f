// SPDX-License-Identifier: Apache-2.0
// What the page's controls and its address say of a view, and what the server was told of it, in one form.

import assert from "node:assert/strict";
import type { Page } from "playwright-core";
import { contrastOf } from "../src/contrast";
import { labelsOf, shownIn } from "../src/label_list";
import { parseFragment } from "../src/url_state";
import type { VolumeInfo } from "../src/volume_info";

type View = Readonly<Record<string, unknown>>;
type Numbers = readonly number[];

// The same walk for the same seed (mulberry32).
export function randomFrom(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  };
}

// What a frame of this view shows, member by member.
function drawnOf(view: View, { channels, type }: VolumeInfo) {
  const range = view["range"] as Numbers | readonly Numbers[];
  const tf = (view["tf"] ?? "auto") === "auto" ? channels.map(() => "auto") : String(view["tf"]).split(";"); // of all, as it is taken back
  const clip = view["clip"];
  const planes = view["planes"];
  return {
    mode: view["mode"],
    filter: view["filter"],
    lit: view["lit"],
    background: view["background"],
    ranges: Array.isArray(range[0]) ? range : [range],
    drawn: view["channels"] ?? [0],
    iso: view["iso"] === "auto" ? null : view["iso"],
    clip: Array.isArray(clip) ? (clip as Numbers) : null,
    planes: Array.isArray(planes) ? (planes as readonly Numbers[]) : [],
    transfers: type === "rgba8" ? [] : tf,
    extinction: type === "rgba8" ? view["extinction"] : null,
    isOrtho: view["ortho"] !== undefined,
    samples: view["samples"] ?? "1",
  };
}

export async function checkControls(page: Page, view: View, volume: VolumeInfo, context: string): Promise<void> {
  const { iso: _, transfers, ...drawn } = drawnOf(view, volume);
  const said = await page.evaluate(() => {
    const checked = (selector: string): boolean => document.querySelector<HTMLInputElement>(selector)?.checked ?? false;
    const now = (root: Element, selector: string): number => Number(root.querySelector(selector)?.getAttribute("aria-valuenow"));
    const rows = [...document.querySelectorAll(".channel")];
    const cuts = [...document.querySelectorAll(".cut-row")];
    const own = document.querySelector<HTMLInputElement>("#own-background");
    return {
      mode: document.querySelector<HTMLInputElement>("input[name=mode]:checked")?.value,
      filter: checked("#smooth") ? "linear" : "nearest",
      lit: checked("#lit"),
      background: document.querySelector<HTMLInputElement>("input[name=background]:checked")?.value ?? own?.value.slice(1),
      ranges: rows.map((row) => [now(row, ".thumb.lo"), now(row, ".thumb.hi")]),
      drawn: rows.length === 1 ? [0] : rows.flatMap((row, number) => (row.querySelector<HTMLInputElement>(".channel-head input[type=checkbox]")?.checked ? [number] : [])),
      windows: rows.map((row) => (row.querySelector<HTMLElement>(".colour-bar")?.hidden ? null : [now(row, ".black-point"), now(row, ".white-point")])),
      clip: [...cuts.map((cut) => now(cut, ".thumb.lo")), ...cuts.map((cut) => now(cut, ".thumb.hi"))],
      planes: document.querySelectorAll(".plane").length,
      isOrtho: checked("#ortho"),
      samples: document.querySelector<HTMLSelectElement>("select[name=samples]")?.value,
      labels: [...document.querySelectorAll(".label-status")].map((status) => Number(/([\d,]+) hidden/.exec(status.textContent ?? "")?.[1] ?? 0)),
      points: document.querySelector<HTMLElement>("#tf-editor")?.hidden ? null : document.querySelectorAll(".tf-point").length,
    };
  });
  const { min, max } = volume.worldBox;
  const { extinction: __, ...expected } = drawn;
  const { points, ...others } = said;
  assert.deepEqual(others, {
    ...expected,
    clip: drawn.clip ?? [...min, ...max],
    planes: drawn.planes.length,
    windows: volume.channels.map((channel, number) => contrastOf(channel, transfers[number] ?? "auto")?.window ?? null),
    labels: volume.channels.flatMap((channel, number) => (channel.areLabels ? [shownIn(labelsOf(channel), transfers[number] ?? "auto").filter((isShown) => !isShown).length] : [])),
  }, `controls, ${context}`);
  if (points !== null) assert.ok(transfers.some((text) => !text.includes(":") || text.split(",").length === points), `points, ${context}`);
}

export async function checkAddress(page: Page, view: View, volume: VolumeInfo, context: string): Promise<void> {
  await page.waitForTimeout(300); // the page writes it at most so late
  const { volume: id, overrides, faults } = parseFragment(new URL(page.url()).hash);
  const drawn = drawnOf(view, volume);
  const clip = overrides.clip ?? null;
  assert.deepEqual({ faults, id }, { faults: [], id: volume.id }, context);
  assert.deepEqual({
    mode: overrides.mode,
    filter: overrides.filter ?? "nearest",
    lit: overrides.lit ?? false,
    background: overrides.background,
    ranges: overrides.ranges,
    drawn: overrides.drawn ?? volume.channels.map((_, number) => number),
    iso: overrides.iso ?? null,
    clip: clip === null ? null : [...clip.min, ...clip.max],
    planes: overrides.planes ?? [],
    transfers: volume.type === "rgba8" ? [] : (overrides.transfers ?? volume.channels.map(() => "auto")),
    extinction: overrides.extinction ?? null,
    isOrtho: overrides.ortho !== undefined && overrides.ortho !== null,
    samples: overrides.others?.samples ?? "1",
  }, drawn, `address, ${context}`);
  for (const name of ["eye", "target", "up"] as const) {
    const told = view[name] as Numbers;
    const near = overrides.camera?.[name]?.every((part, axis) => Math.abs(part - (told[axis] ?? 0)) <= 1e-8 * Math.max(1, Math.abs(part)));
    assert.ok(near, `${name}, ${context}: ${String(overrides.camera?.[name])} is not ${String(told)}`);
  }
}
