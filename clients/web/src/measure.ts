// SPDX-License-Identifier: Apache-2.0
// Lengths, angles and areas of points of the world. Where nobody said how far voxels are apart, they are counted.

import { indexOf, type IndexSpace } from "./index_space";
import { add, cross, dot, length, scale, subtract, type Vec3 } from "./vector";
import type { VolumeInfo } from "./volume_info";

export function polylineLength(points: readonly Vec3[]): number {
  return points.slice(1).reduce((sum, point, i) => sum + length(subtract(point, points[i] ?? point)), 0);
}

// Degrees in the second of three points; null where two of them are one.
export function angleOf([from, at, to]: readonly Vec3[]): number | null {
  if (!from || !at || !to) return null;
  const [a, b] = [subtract(from, at), subtract(to, at)];
  if (length(a) === 0 || length(b) === 0) return null;
  return (Math.atan2(length(cross(a, b)), dot(a, b)) * 180) / Math.PI;
}

// Of a flat polygon that does not cross itself: half of the sum of cross products (the shoelace formula in space).
export function polygonArea(points: readonly Vec3[]): number {
  const [origin] = points;
  if (!origin) return 0;
  const sum = points.slice(2).reduce<Vec3>((total, point, i) => {
    const before = points[i + 1] ?? origin;
    return add(total, cross(subtract(before, origin), subtract(point, origin)));
  }, [0, 0, 0]);
  return length(scale(sum, 0.5));
}

// Lengths of measures, and what they are counted in.
export interface Ruler {
  readonly unit: string; // "" where a file has lengths but no name for them
  measured(point: Vec3): Vec3; // a place in that unit
}

export function rulerOf(volume: Pick<VolumeInfo, "lengthUnit" | "spacing">, space: IndexSpace): Ruler {
  if (volume.lengthUnit !== null) return { unit: volume.lengthUnit.replace("um", "µm"), measured: (point) => point };
  const isKnown = volume.spacing.some((part) => Math.abs(part - 1) > 1e-9);
  return isKnown ? { unit: "", measured: (point) => point } : { unit: "voxels", measured: (point) => indexOf(space, point) };
}

// Four digits.
export function formatMeasure(value: number, unit: string): string {
  const number = String(Number(value.toPrecision(4)));
  return unit === "" ? number : unit === "°" ? `${number}°` : `${number} ${unit}`;
}
