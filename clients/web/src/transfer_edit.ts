// SPDX-License-Identifier: Apache-2.0
// Changes of a transfer function's points, all pure: each gives other points that the server takes.

import { kMostPoints, type TransferPoint } from "./transfer";
import type { Range } from "./volume_info";

export type Points = readonly TransferPoint[];

export interface Edited {
  readonly points: Points;
  readonly index: number; // of the point it is about
}

// The least distance between two values that stays one in the text, where values lie within `range`.
export function leastGap([lo, hi]: Range): number {
  return Math.max((hi - lo) * 1e-5, Math.max(Math.abs(lo), Math.abs(hi)) * 1e-8, Number.MIN_VALUE);
}

// What the function is at a value: straight between two points, and beyond the ends as they are.
export function sampleAt(points: Points, value: number): TransferPoint {
  const after = points.findIndex((point) => point.value >= value);
  const [a, b] = [points[after - 1] ?? points[0], points[after] ?? points.at(-1)];
  if (a === undefined || b === undefined) return { value, colour: "ffffff", opacity: 0 };
  if (after === 0 || b.value <= a.value) return { ...(after === 0 ? a : b), value };
  const share = Math.min(1, (value - a.value) / (b.value - a.value));
  return { value, colour: mixed(a.colour, b.colour, share), opacity: a.opacity + share * (b.opacity - a.opacity) };
}

// Null where there is no room for another point, or one stands there.
export function inserted(points: Points, value: number, opacity: number | null, gap: number): Edited | null {
  if (points.length >= kMostPoints || points.some((point) => Math.abs(point.value - value) < gap)) return null;
  const point = sampleAt(points, value);
  const index = points.filter((other) => other.value < value).length;
  return { points: [...points.slice(0, index), { ...point, opacity: opacity ?? point.opacity }, ...points.slice(index)], index };
}

// The middle of the wider side of a point; at an end without a wider side there is only one.
export function besides(points: Points, index: number): number {
  const at = (i: number): number | null => points[i]?.value ?? null;
  const [before, own, after] = [at(index - 1), at(index) ?? 0, at(index + 1)];
  const [left, right] = [before === null ? 0 : own - before, after === null ? 0 : after - own];
  return right >= left ? own + right / 2 : own - left / 2;
}

// A point stops before its neighbours, and between 0 and 1.
export function moved(points: Points, index: number, value: number, opacity: number, gap: number): Points {
  const least = (points[index - 1]?.value ?? -Infinity) + gap;
  const most = (points[index + 1]?.value ?? Infinity) - gap;
  const own = points[index];
  if (own === undefined || !Number.isFinite(value) || !Number.isFinite(opacity)) return points;
  const placed = least > most ? own.value : Math.max(least, Math.min(most, value));
  return replaced(points, index, { ...own, value: placed, opacity: Math.max(0, Math.min(1, opacity)) });
}

export function recoloured(points: Points, index: number, colour: string): Points {
  const own = points[index];
  return own === undefined ? points : replaced(points, index, { ...own, colour });
}

// The last point stays: a function has one at least.
export function without(points: Points, index: number): Points {
  return points.length < 2 ? points : points.filter((_, i) => i !== index);
}

// As many points as the server takes at most, evenly over the same values; the ends stay as they are.
export function resampled(points: Points, most: number = kMostPoints): Points {
  const [first, last] = [points[0], points.at(-1)];
  if (points.length <= most || first === undefined || last === undefined) return points;
  return Array.from({ length: most }, (_, i) => sampleAt(points, first.value + (i / (most - 1)) * (last.value - first.value)));
}

// Values that stand on one spot, as they do at a step, are moved apart. Null where they descend.
export function ascending(points: Points): Points | null {
  const [first, last] = [points[0]?.value ?? 0, points.at(-1)?.value ?? 0];
  const gap = leastGap([first, last]);
  const apart: TransferPoint[] = [];
  for (const point of points) {
    const before = apart.at(-1)?.value ?? -Infinity;
    if (point.value < before - points.length * gap) return null;
    apart.push(point.value - before < gap ? { ...point, value: before + gap } : point);
  }
  return apart;
}

const replaced = (points: Points, index: number, point: TransferPoint): Points => points.map((other, i) => (i === index ? point : other));

function mixed(a: string, b: string, share: number): string {
  return [0, 2, 4].map((at) => {
    const [from, to] = [parseInt(a.slice(at, at + 2), 16), parseInt(b.slice(at, at + 2), 16)];
    return Math.round(from + share * (to - from)).toString(16).padStart(2, "0");
  }).join("");
}
