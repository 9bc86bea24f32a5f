// SPDX-License-Identifier: Apache-2.0
// What the page asks for: one immutable value, and the difference between two of them as a view message.

import { refitted, type Camera } from "./camera";
import type { Filter, Mode, Preset, ViewMembers } from "./protocol";
import type { Range, VolumeInfo } from "./volume_info";

export type Size = readonly [width: number, height: number];

export interface ViewState {
  readonly size: Size; // pixels of the picture
  readonly camera: Camera;
  readonly fovDegrees: number;
  readonly ranges: readonly Range[]; // of each channel of the volume, drawn or not
  readonly drawn: readonly number[]; // channels, ascending, at least one
  readonly mode: Mode;
  readonly iso: number | null; // mode iso; null: the middle of the range
  readonly filter: Filter;
  readonly lit: boolean;
  readonly extinction: number; // only rgba8 volumes have one
  readonly tf: Preset; // only scalar volumes of one channel have one: of several each has its own colours
  readonly background: string; // rrggbb
}

export type ViewChange = Partial<Omit<ViewState, "size" | "fovDegrees">>;

// What an address asks of a volume that is not known yet. Ranges that are null, or not there, are the channel's own.
export type ViewOverrides = Omit<ViewChange, "ranges" | "drawn"> & {
  readonly ranges?: readonly (Range | null)[];
  readonly drawn?: readonly number[] | "all";
};

export const kDefaultExtinction = 0.2;
export const kDefaultBackground = "000000";
const kMaxSide = 8192;
const kMaxPixels = 4 * 1024 * 1024;

// The volume's own view at this size, with this change on top.
export function initialView(volume: VolumeInfo, size: Size, change: ViewChange): ViewState {
  return {
    size,
    camera: refitted(volume.defaultView.camera, [1, 1], size),
    fovDegrees: volume.defaultView.fovDegrees,
    ranges: volume.channels.map((channel) => channel.defaultRange),
    drawn: volume.channels.map((_, number) => number),
    mode: "blend",
    iso: null,
    filter: "nearest",
    lit: false,
    tf: "auto",
    extinction: kDefaultExtinction,
    background: kDefaultBackground,
    ...change,
  };
}

// What an address asks for, as far as this volume has it; `faults` names what it has not and is left out, for people.
export function fitted(volume: VolumeInfo, overrides: ViewOverrides): { readonly change: ViewChange; readonly faults: readonly string[] } {
  const { ranges, drawn: wanted, tf, ...rest } = overrides;
  const drawn = wanted === "all" ? volume.channels.map((_, number) => number) : wanted;
  const count = volume.channels.length;
  const has = count === 1 ? "this volume has one channel, 0" : `this volume has ${count} channels, from 0`;
  const faults: string[] = [];
  const areRanges = ranges === undefined || ranges.length <= count;
  if (!areRanges) faults.push(`range: given for ${ranges.length} channels; ${has}`);
  const areDrawn = drawn?.every((number) => number < count) ?? true;
  if (!areDrawn) faults.push(`channels: ${drawn?.join(",")}; ${has}`);
  const isColour = tf === undefined || tf === "auto" || count === 1;
  if (!isColour) faults.push(`tf: ${tf} colours one channel; here each keeps its own colours`);
  const change = {
    ...rest,
    ...(ranges && areRanges && { ranges: volume.channels.map((channel, number) => ranges[number] ?? channel.defaultRange) }),
    ...(drawn && areDrawn && { drawn }),
    ...(tf && isColour && { tf }),
  };
  return { change, faults };
}

export function withRange(view: ViewState, channel: number, range: Range): ViewChange {
  return { ranges: view.ranges.map((own, number) => (number === channel ? range : own)) };
}

// The last channel that is drawn stays. A surface is of the first drawn channel: a value chosen for another is none of it.
export function withDrawn(view: ViewState, channel: number, isDrawn: boolean): ViewChange {
  const drawn = view.ranges.flatMap((_, number) => ((number === channel ? isDrawn : view.drawn.includes(number)) ? [number] : []));
  if (drawn.length === 0) return {};
  return drawn[0] === view.drawn[0] ? { drawn } : { drawn, iso: null };
}

// The picture's size for an element of this size in CSS pixels: device pixels, as far as the bounds allow.
export function pictureSize(cssWidth: number, cssHeight: number, pixelRatio: number): Size {
  const width = Math.max(1, cssWidth);
  const height = Math.max(1, cssHeight);
  const byArea = Math.sqrt(kMaxPixels / (width * height));
  const ratio = Math.min(pixelRatio, byArea, kMaxSide / width, kMaxSide / height);
  const side = (length: number): number => Math.max(1, Math.floor(length * ratio));
  return [side(width), side(height)];
}

// What a message says of a view. `isColoured`: the volume is rgba8, so has an extinction and no transfer function; others
// have it the other way round, and of several channels the page names none.
export function membersOf(view: ViewState, isColoured: boolean): ViewMembers {
  const [first, ...others] = view.ranges;
  const isSingle = others.length === 0;
  return {
    size: view.size,
    eye: view.camera.eye,
    target: view.camera.target,
    up: view.camera.up,
    fov: view.fovDegrees,
    ...(!isSingle && { channels: view.drawn }),
    range: first && isSingle ? first : view.ranges,
    mode: view.mode,
    iso: view.iso ?? "auto",
    filter: view.filter,
    lit: view.lit,
    ...(isColoured && { extinction: view.extinction }),
    ...(!isColoured && isSingle && { tf: view.tf }),
    background: view.background,
  };
}
