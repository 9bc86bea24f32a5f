// SPDX-License-Identifier: Apache-2.0
// What the page asks for: one immutable value, and the difference between two of them as a view message.

import { framed, isUsable, type Camera } from "./camera";
import { indexOf, indexSpaceOf, isInside } from "./index_space";
import type { Mark } from "./marks";
import { textOfMembers, type Members } from "./members";
import type { Filter, Mode, ViewMembers } from "./protocol";
import { kNoSlices, type SliceState } from "./slice_state";
import { subtract, type Vec3 } from "./vector";
import type { Range, VolumeInfo } from "./volume_info";

export type Size = readonly [width: number, height: number];
export type Plane = readonly [nx: number, ny: number, nz: number, d: number]; // shown is where nx x + ny y + nz z + d >= 0

export interface Box {
  readonly min: Vec3;
  readonly max: Vec3;
}

export interface ViewState {
  readonly size: Size; // pixels of the picture
  readonly camera: Camera;
  readonly fovDegrees: number;
  readonly ortho: number | null; // world height of the picture where it is orthographic; null: in perspective
  readonly ranges: readonly Range[]; // of each channel of the volume, drawn or not
  readonly drawn: readonly number[]; // channels, ascending, at least one
  readonly mode: Mode;
  readonly iso: number | null; // mode iso; null: the middle of the range
  readonly filter: Filter;
  readonly lit: boolean;
  readonly extinction: number; // only rgba8 volumes have one
  readonly transfers: readonly string[]; // of each channel, a preset's name or points; only scalars have them
  readonly clip: Box | null; // world
  readonly planes: readonly Plane[];
  readonly background: string; // rrggbb or rrggbbaa
  readonly others: Members; // those without a place of their own here, where they are not the server's default
  // The page's own, which the server is not told:
  readonly slices: SliceState;
  readonly marks: readonly Mark[];
  readonly beside: string | null; // the view that is shown beside this one, as an address has it
}

export type ViewChange = Partial<Omit<ViewState, "size">>;
export const kNoPagePart: Pick<ViewState, "slices" | "marks" | "beside"> = { slices: kNoSlices, marks: [], beside: null };

// What an address asks of a volume that is not known yet. What is null, or not there, is the volume's own.
export type ViewOverrides = Omit<ViewChange, "camera" | "ranges" | "drawn" | "transfers" | "slices"> & {
  readonly camera?: Partial<Camera>;
  readonly ranges?: readonly (Range | null)[];
  readonly drawn?: readonly number[] | "all";
  readonly transfers?: readonly string[];
  readonly slices?: Partial<SliceState>;
};

export const kDefaultExtinction = 0.2;
export const kDefaultBackground = "000000";
const kMaxSide = 8192;
const kMaxPixels = 4 * 1024 * 1024;

// What the volume is first seen with at this size: what of it is not empty fills the picture, as the server frames it.
export function ownCamera({ contentBox, defaultView: { camera, fovDegrees } }: VolumeInfo, size: Size): Camera {
  return framed(contentBox, subtract(camera.eye, camera.target), camera.up, fovDegrees, size);
}

// The volume's own view at this size, with this change on top.
export function initialView(volume: VolumeInfo, size: Size, change: ViewChange): ViewState {
  return {
    size,
    camera: ownCamera(volume, size),
    fovDegrees: volume.defaultView.fovDegrees,
    ortho: null,
    ranges: volume.channels.map((channel) => channel.defaultRange),
    drawn: volume.channels.map((_, number) => number),
    mode: "blend",
    iso: null,
    filter: "nearest",
    lit: false,
    transfers: volume.channels.map(() => "auto"),
    extinction: kDefaultExtinction,
    clip: null,
    planes: [],
    background: kDefaultBackground,
    others: {},
    ...kNoPagePart,
    ...change,
  };
}

// What an address asks for, as far as this volume has it; `faults` names what it has not and is left out, for people.
// `own` is the camera that the members of one it does not name come from.
export function fitted(volume: VolumeInfo, overrides: ViewOverrides, own: Camera = volume.defaultView.camera): { readonly change: ViewChange; readonly faults: readonly string[] } {
  const { camera: asked, ranges, drawn: wanted, transfers, filter, slices: cutAt, ...rest } = overrides;
  const drawn = wanted === "all" ? volume.channels.map((_, number) => number) : wanted;
  const count = volume.channels.length;
  const has = count === 1 ? "this volume has one channel, 0" : `this volume has ${count} channels, from 0`;
  const faults: string[] = [];
  const camera = asked && { ...own, ...asked };
  const isCamera = camera === undefined || isUsable(camera);
  if (!isCamera) faults.push("eye: must differ from target, and up must not point along the view");
  const areRanges = ranges === undefined || ranges.length <= count;
  if (!areRanges) faults.push(`range: given for ${ranges.length} channels; ${has}`);
  const areDrawn = drawn?.every((number) => number < count) ?? true;
  if (!areDrawn) faults.push(`channels: ${drawn?.join(",")}; ${has}`);
  const isColoured = volume.type === "rgba8" && (transfers?.some((text) => text !== "auto") ?? false);
  if (isColoured) faults.push("tf: this volume's voxels have their own colours");
  const areTransfers = transfers === undefined || transfers.length <= count;
  if (!areTransfers) faults.push(`tf: given for ${transfers.length} channels; ${has}`);
  const isFilter = filter !== "linear" || volume.channels.every((channel) => !channel.areLabels);
  if (!isFilter) faults.push("filter: labels have nothing between them");
  const isOutside = cutAt?.crosshair ? !isInside(indexSpaceOf(volume), indexOf(indexSpaceOf(volume), cutAt.crosshair)) : false;
  if (isOutside) faults.push("crosshair: lies outside of this volume");
  const change = {
    ...rest,
    ...(cutAt && { slices: { ...kNoSlices, ...cutAt, ...(isOutside && { crosshair: null }) } }),
    ...(camera && isCamera && { camera }),
    ...(filter && isFilter && { filter }),
    ...(ranges && areRanges && { ranges: volume.channels.map((channel, number) => ranges[number] ?? channel.defaultRange) }),
    ...(drawn && areDrawn && { drawn }),
    ...(transfers && areTransfers && !isColoured && { transfers: volume.channels.map((_, number) => transfers[number] ?? "auto") }),
  };
  return { change, faults };
}

// What goes along to a volume that was not open yet; camera, channels, ranges, cuts and colours are each volume's own.
export function lookOf({ mode, background, filter, lit, slices: { layout, isGrey } }: ViewState): ViewOverrides {
  return { mode, background, lit, ...(filter === "linear" && { filter }), ...((layout !== "3d" || isGrey) && { slices: { layout, isGrey } }) };
}

export function withRange(view: ViewState, channel: number, range: Range): ViewChange {
  return { ranges: view.ranges.map((own, number) => (number === channel ? range : own)) };
}

export function withTransfer(view: ViewState, channel: number, transfer: string): ViewChange {
  return { transfers: view.transfers.map((own, number) => (number === channel ? transfer : own)) };
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
// have it the other way round.
export function membersOf(view: ViewState, isColoured: boolean): ViewMembers {
  const [first, ...others] = view.ranges;
  const isSingle = others.length === 0;
  const { clip } = view;
  return {
    size: view.size,
    eye: view.camera.eye,
    target: view.camera.target,
    up: view.camera.up,
    ...(view.ortho === null ? { fov: view.fovDegrees } : { ortho: view.ortho }),
    ...(!isSingle && { channels: view.drawn }),
    range: first && isSingle ? first : view.ranges,
    mode: view.mode,
    iso: view.iso ?? "auto",
    filter: view.filter,
    lit: view.lit,
    ...(isColoured && { extinction: view.extinction }),
    ...(!isColoured && (isSingle || view.transfers.some((text) => text !== "auto")) && { tf: view.transfers.join(";") }),
    ...(clip && { clip: [...clip.min, ...clip.max] }),
    ...(view.planes.length > 0 && { planes: view.planes }),
    background: view.background,
    ...textOfMembers(view.others),
  };
}
