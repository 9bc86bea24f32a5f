// SPDX-License-Identifier: Apache-2.0
// What the page shows besides the picture in 3D: which slices, through which point, how thick. The page's own part of a view.

import type { Vec3 } from "./vector";

export const kLayouts = ["3d", "all", "x", "y", "z", "oblique"] as const;
export type Layout = (typeof kLayouts)[number]; // an axis: that slice alone; oblique: beside the picture in 3D
export const kReduces = ["max", "min", "mean"] as const;
export type Reduce = (typeof kReduces)[number];
export const kMostThickness = 999; // voxels

export interface SliceState {
  readonly layout: Layout;
  readonly crosshair: Vec3 | null; // world; null: the middle of the volume
  readonly thickness: number; // voxels, at least 1
  readonly reduce: Reduce; // what a slab of several shows
  readonly isGrey: boolean; // from black to white, instead of the colours in 3D
}

export const kNoSlices: SliceState = { layout: "3d", crosshair: null, thickness: 1, reduce: "max", isGrey: false };

export function sliceParts(slices: SliceState, vector: (v: readonly number[]) => string): string[] {
  return [
    ...(slices.layout === "3d" ? [] : [`slices=${slices.layout}`]),
    ...(slices.crosshair === null ? [] : [`crosshair=${vector(slices.crosshair)}`]),
    ...(slices.thickness === 1 && slices.reduce === "max" ? [] : [`slab=${slices.thickness}:${slices.reduce}`]),
    ...(slices.isGrey ? ["slice-colors=grey"] : []),
  ];
}

export const kSlabForm = `voxels:reduce, from 1 to ${kMostThickness} voxels, of ${kReduces.join(", ")}`;

// 5:mean; of a number alone the largest value.
export function parseSlab(text: string): Pick<SliceState, "thickness" | "reduce"> | null {
  const [, digits = "", name = "max"] = /^(\d{1,3})(?::([a-z]+))?$/.exec(text) ?? [];
  const reduce = kReduces.find((candidate) => candidate === name);
  const thickness = Number(digits);
  return digits !== "" && reduce !== undefined && thickness >= 1 ? { thickness, reduce } : null;
}
