// SPDX-License-Identifier: Apache-2.0
// How the axes of the world run through a volume's voxels: along one of theirs, from either end, or obliquely.

import type { Range, VolumeInfo } from "./volume_info";

export interface VoxelAxis {
  readonly step: number; // world length of a voxel along it
  readonly voxels: number | null; // how many lie along it; null where it runs obliquely through them
  readonly isReversed: boolean; // they are counted from its far end
}

const kAlong = 1e-6; // of a voxel: less is none

// Of the world's axis 0, 1 or 2.
export function voxelAxis({ worldFromIndex, dims, spacing, worldBox }: VolumeInfo, axis: 0 | 1 | 2): VoxelAxis {
  const row = worldFromIndex[axis] ?? [];
  const parts = [0, 1, 2].map((i) => Math.abs(row[i] ?? 0));
  const own = parts.indexOf(Math.max(...parts));
  const length = parts[own] ?? 1;
  const isAlone = parts.every((part, i) => i === own || part <= kAlong * length);
  // Along with nothing else of this index axis in the other rows.
  const isStraight = [0, 1, 2].every((other) => other === axis || Math.abs(worldFromIndex[other]?.[own] ?? 0) <= kAlong * length);
  if (isAlone && isStraight) return { step: length, voxels: dims[own] ?? 1, isReversed: (row[own] ?? 0) < 0 };
  return { step: Math.min(spacing[own] ?? 1, worldBox.max[axis] - worldBox.min[axis]), voxels: null, isReversed: false };
}

// A stretch of the world's axis in voxels: from the first to the one after the last. Null where it runs obliquely.
export function voxelRange(volume: VolumeInfo, axis: 0 | 1 | 2, [lo, hi]: Range): Range | null {
  const { step, voxels, isReversed } = voxelAxis(volume, axis);
  if (voxels === null) return null;
  const [from, to] = [lo, hi].map((bound) => Math.round((1000 * (bound - volume.worldBox.min[axis])) / step) / 1000);
  return isReversed ? [voxels - (to ?? 0), voxels - (from ?? 0)] : [from ?? 0, to ?? 0];
}
