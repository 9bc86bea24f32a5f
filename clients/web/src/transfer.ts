// SPDX-License-Identifier: Apache-2.0
// Transfer functions as points and as text, value:rrggbb:opacity,... with ascending values, and the presets' points.

import { bodyOf, type Body } from "./channel_body";
import { kPresets, type Preset } from "./protocol";
import type { ChannelInfo, Range } from "./volume_info";

export interface TransferPoint {
  readonly value: number; // data units
  readonly colour: string; // rrggbb
  readonly opacity: number; // over the unit distance
}

export const kMostPoints = 1024; // of a transfer function the server takes
export const kThinOpacity = 0.06; // where the body of the data begins
const kBodyOpacity = 0.4; // where it ends

// Tenths of the maps that the server's presets of these names have.
export const kMaps = {
  grey: ["000000", "ffffff"],
  viridis: ["440154", "482475", "414487", "355f8d", "2a788e", "21918c", "22a884", "44bf70", "7ad151", "bddf26", "fde725"],
  cividis: ["00224e", "083370", "35456c", "4f576c", "666970", "7d7c78", "948e77", "aea371", "c8b866", "e5cf52", "fee838"],
  inferno: ["000004", "160b39", "420a68", "6a176e", "932667", "bc3754", "dd513a", "f37819", "fca50a", "f6d746", "fcffa4"],
} as const;
type MapName = keyof typeof kMaps;

const kHounsfield: Readonly<Partial<Record<Preset, string>>> = {
  "ct-bone": "130:a5825f:0,300:d9c3a3:0.12,700:f2e8d6:0.6,1500:ffffff:0.9",
  "ct-soft-tissue": "-200:e8c39e:0,-90:e8c39e:0.012,20:c8694c:0.06,80:b04a3a:0.15,200:e8d8bc:0.4,1000:ffffff:0.8",
  angiography: "120:5a0c0c:0,180:b01818:0.2,350:e04a2a:0.6,600:f5dcc0:0.7,1500:ffffff:0.8",
};
const kHounsfieldUnits = ["hu", "hounsfield", "hounsfield units"];
const kWater = 0;
const kLeastHounsfield = -4096;

export function isPreset(text: string): text is Preset {
  return kPresets.some((name) => name === text);
}

// Null where the text is none.
export function parsePoints(text: string): readonly TransferPoint[] | null {
  const points = text.split(",").map((item) => {
    const [, value = "", colour = "", opacity = ""] = /^\s*([^:\s]+):([0-9a-f]{6}):([^:\s]+)\s*$/i.exec(item) ?? [];
    return { value: numberOf(value), colour: colour.toLowerCase(), opacity: numberOf(opacity) };
  });
  const isFine = ({ value, opacity }: TransferPoint, i: number): boolean =>
    Number.isFinite(value) && opacity >= 0 && opacity <= 1 && value > (points[i - 1]?.value ?? -Infinity);
  return points.length <= kMostPoints && points.every(isFine) ? points : null;
}

// The points of a transfer function's text for a channel: a preset's, or those it has. Of a preset that is not known for
// the channel, the channel's own.
export function pointsOf(transfer: string, channel: ChannelInfo): readonly TransferPoint[] {
  return (isPreset(transfer) ? presetPoints(transfer, channel) : parsePoints(transfer)) ?? ownPoints(channel) ?? [];
}

// Of a channel that nobody has given colours: a ramp's three points, or what its labels or its unit say. Null where voxels
// have their colours.
export function ownPoints({ transfer }: ChannelInfo): readonly TransferPoint[] | null {
  return parsePoints(transfer ?? "");
}

const numberOf = (text: string): number => (text === "" ? NaN : Number(text));

export function formatPoints(points: readonly TransferPoint[]): string {
  return points.map(({ value, colour, opacity }) => `${short(value, 10)}:${colour}:${short(opacity, 4)}`).join(",");
}

const short = (value: number, digits: number): number => Number(value.toPrecision(digits));

// A preset as the server makes it for a channel. Null where it is not known.
export function presetPoints(name: Preset, channel: ChannelInfo): readonly TransferPoint[] | null {
  if (name === "auto") return ownPoints(channel);
  const fixed = kHounsfield[name];
  if (fixed !== undefined) return parsePoints(fixed);
  const body = rampOf(channel) ?? bodyOf(channel);
  if (body === null) return null;
  const [first, middle, last] = body;
  const colours: readonly string[] = kMaps[name as MapName];
  return colours.map((colour, i) => {
    const value = first + (i / (colours.length - 1)) * (last - first);
    const opacity = value < middle
      ? (kThinOpacity * (value - first)) / (middle - first)
      : kThinOpacity + ((kBodyOpacity - kThinOpacity) * (value - middle)) / (last - middle);
    return { value, colour, opacity };
  });
}

// The values of the channel's own transfer function, where that is a ramp over its body.
function rampOf(channel: ChannelInfo): Body | null {
  const [first, middle, last, ...others] = ownPoints(channel) ?? [];
  if (channel.areLabels || !first || !middle || !last || others.length > 0) return null;
  return [first.value, middle.value, last.value];
}

// Whether a preset's values are those of tissues, and no map's over the body of the data: CT has such an `auto` too.
export function isByTissue(name: string, channel: ChannelInfo): boolean {
  return name === "auto" ? rampOf(channel) === null : name in kHounsfield;
}

export function isHounsfield(unit: string | null): boolean {
  return unit !== null && kHounsfieldUnits.includes(unit.toLowerCase());
}

// Whether a preset in Hounsfield units shows something sensible of values in this range and unit.
export function fitsPreset(name: Preset, [lo, hi]: Range, unit: string | null): boolean {
  const fixed = kHounsfield[name];
  if (fixed === undefined) return true;
  if (!(hi > (parsePoints(fixed)?.[0]?.value ?? Infinity))) return false;
  return unit === null ? lo < kWater && lo >= kLeastHounsfield : isHounsfield(unit);
}

// CSS of the colours from left to right where `lo` stands at the left and `hi` at the right.
export function gradientOf(points: readonly TransferPoint[], [lo, hi]: Range): string {
  const span = hi > lo ? hi - lo : 1;
  const stops = points.map(({ value, colour }) => `#${colour} ${(((value - lo) / span) * 100).toFixed(1)}%`);
  return stops.length === 1 ? `linear-gradient(90deg, ${stops[0]}, ${stops[0]})` : `linear-gradient(90deg, ${stops.join(", ")})`;
}
