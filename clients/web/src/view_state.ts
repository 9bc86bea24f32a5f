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
  readonly range: Range;
  readonly mode: Mode;
  readonly iso: number | null; // mode iso; null: the middle of the range
  readonly filter: Filter;
  readonly lit: boolean;
  readonly extinction: number; // only rgba8 volumes have one
  readonly tf: Preset; // only scalar volumes have one
  readonly background: string; // rrggbb
}

export type ViewOverrides = Partial<Omit<ViewState, "size" | "fovDegrees">>;

export const kDefaultExtinction = 0.2;
export const kDefaultBackground = "000000";
const kMaxSide = 8192;
const kMaxPixels = 4 * 1024 * 1024;

// The volume's own view at this size, with what the address or the previous volume asks for on top.
export function initialView(volume: VolumeInfo, size: Size, overrides: ViewOverrides): ViewState {
  return {
    size,
    camera: refitted(volume.defaultView.camera, [1, 1], size),
    fovDegrees: volume.defaultView.fovDegrees,
    range: volume.defaultView.range,
    mode: "blend",
    iso: null,
    filter: "nearest",
    lit: false,
    tf: "auto",
    extinction: kDefaultExtinction,
    background: kDefaultBackground,
    ...overrides,
  };
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

// The members that differ; all of them where there is no previous view. `isColoured`: the volume is rgba8, so has an
// extinction and no transfer function; others have it the other way round.
export function changedMembers(previous: ViewState | null, next: ViewState, isColoured: boolean): ViewMembers {
  const differs = <T>(pick: (view: ViewState) => T): boolean =>
    previous === null || JSON.stringify(pick(previous)) !== JSON.stringify(pick(next));
  return {
    ...(differs((v) => v.size) && { size: next.size }),
    ...(differs((v) => v.camera.eye) && { eye: next.camera.eye }),
    ...(differs((v) => v.camera.target) && { target: next.camera.target }),
    ...(differs((v) => v.camera.up) && { up: next.camera.up }),
    ...(differs((v) => v.fovDegrees) && { fov: next.fovDegrees }),
    ...(differs((v) => v.range) && { range: next.range }),
    ...(differs((v) => v.mode) && { mode: next.mode }),
    ...(differs((v) => v.iso) && { iso: next.iso ?? "auto" }),
    ...(differs((v) => v.filter) && { filter: next.filter }),
    ...(differs((v) => v.lit) && { lit: next.lit }),
    ...(isColoured && differs((v) => v.extinction) && { extinction: next.extinction }),
    ...(!isColoured && differs((v) => v.tf) && { tf: next.tf }),
    ...(differs((v) => v.background) && { background: next.background }),
  };
}
