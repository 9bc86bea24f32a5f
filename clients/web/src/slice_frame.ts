// SPDX-License-Identifier: Apache-2.0
// Which part of a plane a slice view shows: what lies in its middle, and what a pixel is long. All pure.

import type { PlanePoint, SlicePlane } from "./slice_plane";

export interface SliceFrame {
  readonly centre: PlanePoint;
  readonly unit: number; // world length of a CSS pixel
}

type Size = readonly [width: number, height: number]; // CSS pixels

const kMargin = 1.06;
const kFinest = 1 / 256; // of a voxel's side a pixel
const kCoarsest = 8; // times as small as it fits

export function fittedFrame({ extent: { min, max } }: SlicePlane, [width, height]: Size): SliceFrame {
  const unit = kMargin * Math.max((max[0] - min[0]) / Math.max(1, width), (max[1] - min[1]) / Math.max(1, height));
  return { centre: [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2], unit };
}

export function panned({ centre, unit }: SliceFrame, dx: number, dy: number): SliceFrame {
  return { centre: [centre[0] - dx * unit, centre[1] - dy * unit], unit };
}

// Keeps what is under (x, y). `voxel`: the shortest side of one.
export function zoomedAt(frame: SliceFrame, factor: number, x: number, y: number, size: Size, fit: number, voxel: number): SliceFrame {
  const unit = Math.min(kCoarsest * fit, Math.max(kFinest * voxel, frame.unit * factor));
  const [s, t] = pointAt(frame, x, y, size);
  const share = unit / frame.unit;
  return { centre: [s + (frame.centre[0] - s) * share, t + (frame.centre[1] - t) * share], unit };
}

export function pointAt({ centre, unit }: SliceFrame, x: number, y: number, [width, height]: Size): PlanePoint {
  return [centre[0] + (x - width / 2) * unit, centre[1] + (y - height / 2) * unit];
}

export function pixelOf({ centre, unit }: SliceFrame, [s, t]: readonly [number, number, ...number[]], [width, height]: Size): readonly [number, number] {
  return [width / 2 + (s - centre[0]) / unit, height / 2 + (t - centre[1]) / unit];
}
