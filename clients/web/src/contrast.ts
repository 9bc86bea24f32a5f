// SPDX-License-Identifier: Apache-2.0
// A channel's contrast: which colours, from which value to which, how bright the middle is and how opaque it all is.
// It is kept nowhere but in the points of the transfer function: what this page wrote is read back from them.
//
// Point i of the colours stands at share u of the way from black to white, and at u^(1/gamma) in the window.

import { formatPoints, isByTissue, isPreset, kMaps, ownPoints, parsePoints, presetPoints, type TransferPoint } from "./transfer";
import type { Preset } from "./protocol";
import type { ChannelInfo, Histogram, Range } from "./volume_info";

export interface Contrast {
  readonly base: readonly TransferPoint[]; // before window, gamma and opacity; its ends are 0 and 1 of the window
  readonly name: Preset | "colour" | "own"; // what it is: a preset, one colour, or points that are none of these
  readonly window: Range; // black, white
  readonly gamma: number; // above 1 the middle is darker
  readonly opacity: number; // of the densest point
}

const kFineParts = 8;
const kDark = 0.35; // of a colour, where it begins
export const kAutoShares: Range = [0.0035, 0.998]; // of the voxels, from black to white

// Null where there is nothing to stretch: labels, voxels of their own colours, a channel of one single value.
export function contrastOf(channel: ChannelInfo, transfer: string): Contrast | null {
  if (channel.areLabels || ownPoints(channel) === null) return null;
  const points = isPreset(transfer) ? presetPoints(transfer, channel) : parsePoints(transfer);
  if (points === null) return null;
  const [first, last] = [points[0], points.at(-1)];
  if (!first || !last || !(last.value > first.value)) return null;
  const [window, opacity]: [Range, number] = [[first.value, last.value], last.opacity];
  if (isPreset(transfer)) return { base: points, name: transfer, window, gamma: 1, opacity };
  const known = knownBase(points, channel);
  if (known === null) return { base: points, name: "own", window, gamma: 1, opacity };
  return { ...known, window, gamma: gammaOf(points, points.length === known.base.length ? known.base : fineBase(known.base)), opacity };
}

// Where a base has its two ends alone, gamma needs points between them.
export function fineBase(base: readonly TransferPoint[]): readonly TransferPoint[] {
  const [first, last] = base;
  if (!first || !last || base.length !== 2) return base;
  return Array.from({ length: kFineParts + 1 }, (_, i) => {
    const between = (from: number, to: number): number => from + (i / kFineParts) * (to - from);
    const byte = (at: number): number => Math.round(between(parseInt(first.colour.slice(at, at + 2), 16), parseInt(last.colour.slice(at, at + 2), 16)));
    const colour = [0, 2, 4].map((at) => byte(at).toString(16).padStart(2, "0")).join("");
    return { value: between(first.value, last.value), colour, opacity: between(first.opacity, last.opacity) };
  });
}

// The text of the transfer function: the preset's name where nothing differs from it, or where its points are not known.
export function transferOf(contrast: Contrast, channel: ChannelInfo): string {
  const { name, window: [black, white], gamma, opacity } = contrast;
  const base = gamma === 1 ? contrast.base : fineBase(contrast.base);
  const [first, last] = [base[0], base.at(-1)];
  if (!first || !last) return "auto";
  const strength = last.opacity > 0 ? opacity / last.opacity : 1;
  const points = base.map((point) => {
    const share = shareIn(base, point.value);
    return {
      value: black + (white - black) * share ** (1 / gamma),
      colour: point.colour,
      opacity: Math.min(1, point.opacity * strength),
    };
  });
  const text = formatPoints(points);
  if (!isPreset(name)) return text;
  const preset = presetPoints(name, channel);
  return preset === null || text === formatPoints(preset) ? name : text;
}

// The same window and brightness in other colours; those that are by tissue have a window of their own.
export function withPreset(contrast: Contrast, channel: ChannelInfo, name: Preset): Contrast {
  const base = presetPoints(name, channel) ?? contrast.base;
  const [first, last] = [base[0], base.at(-1)];
  const keepsWindow = !isByTissue(name, channel) && !isByTissue(contrast.name, channel);
  if (keepsWindow || !first || !last) return { ...contrast, base, name };
  return { base, name, window: [first.value, last.value], gamma: 1, opacity: last.opacity };
}

// From dark to full, as the server colours several channels.
export function withColour(contrast: Contrast, channel: ChannelInfo, colour: string): Contrast {
  return { ...contrast, base: colouredBase(ownPoints(channel) ?? [], colour), name: "colour" };
}

// The window from which to which this share of the voxels lies.
export function autoWindow(histogram: Histogram): Range {
  const [lo, hi] = kAutoShares.map((share) => quantile(histogram, share));
  return lo !== undefined && hi !== undefined && hi > lo ? [lo, hi] : [histogram.lo, histogram.hi];
}

export function quantile({ lo, hi, counts }: Histogram, share: number): number {
  const wanted = share * counts.reduce((sum, count) => sum + count, 0);
  const width = (hi - lo) / counts.length;
  let below = 0;
  for (const [bin, count] of counts.entries()) {
    if (count > 0 && below + count >= wanted) return lo + width * (bin + (wanted - below) / count);
    below += count;
  }
  return hi;
}

function colouredBase(own: readonly TransferPoint[], colour: string): readonly TransferPoint[] {
  return own.map((point) => {
    const share = kDark + (1 - kDark) * shareIn(own, point.value);
    const bytes = [0, 2, 4].map((at) => Math.round(share * parseInt(colour.slice(at, at + 2), 16)));
    return { ...point, colour: bytes.map((byte) => byte.toString(16).padStart(2, "0")).join("") };
  });
}

// What these points are but for window, gamma and opacity: their colours tell.
function knownBase(points: readonly TransferPoint[], channel: ChannelInfo): Pick<Contrast, "base" | "name"> | null {
  const hasColoursOf = (base: readonly TransferPoint[] | null): base is readonly TransferPoint[] =>
    base !== null && base.length === points.length && base.every(({ colour }, i) => colour === points[i]?.colour);
  for (const name of ["auto", ...Object.keys(kMaps)]) {
    const base = isPreset(name) ? presetPoints(name, channel) : null;
    if (base !== null && isPreset(name) && (hasColoursOf(base) || hasColoursOf(fineBase(base)))) return { base, name };
  }
  const coloured = colouredBase(ownPoints(channel) ?? [], points.at(-1)?.colour ?? "");
  return hasColoursOf(coloured) ? { base: coloured, name: "colour" } : null;
}

// As a point in the middle tells it, in hundredths; 1 where none does.
function gammaOf(points: readonly TransferPoint[], base: readonly TransferPoint[]): number {
  const middle = Math.floor(base.length / 2);
  const [point, from] = [points[middle], base[middle]];
  if (!point || !from || base.length < 3) return 1;
  const gamma = Math.log(shareIn(base, from.value)) / Math.log(shareIn(points, point.value));
  return Number.isFinite(gamma) && gamma > 0 ? Math.round(100 * gamma) / 100 : 1;
}

function shareIn(points: readonly TransferPoint[], value: number): number {
  const [first, last] = [points[0]?.value ?? 0, points.at(-1)?.value ?? 1];
  return last > first ? (value - first) / (last - first) : 0;
}
