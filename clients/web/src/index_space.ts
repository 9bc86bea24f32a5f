// SPDX-License-Identifier: Apache-2.0
// Where a volume's voxels lie in the world, and back. Voxel (i, j, k) reaches from (i, j, k) to (i + 1, j + 1, k + 1); its
// centre is half a voxel further on.

import { add, cross, dot, length, scale, subtract, type Vec3 } from "./vector";
import type { VolumeInfo } from "./volume_info";

export type Axis = 0 | 1 | 2;
export const kAxes: readonly Axis[] = [0, 1, 2];

export interface IndexSpace {
  readonly dims: Vec3;
  readonly columns: readonly [Vec3, Vec3, Vec3]; // the world's way of one voxel along each axis
  readonly spacing: Vec3; // how long they are
  readonly origin: Vec3; // of index (0, 0, 0)
}

export function indexSpaceOf({ dims, worldFromIndex: rows }: Pick<VolumeInfo, "dims" | "worldFromIndex">): IndexSpace {
  const column = (at: number): Vec3 => [rows[0][at] ?? 0, rows[1][at] ?? 0, rows[2][at] ?? 0];
  const columns = [column(0), column(1), column(2)] as const;
  return { dims, columns, spacing: [length(columns[0]), length(columns[1]), length(columns[2])], origin: column(3) };
}

export function worldOf({ columns, origin }: IndexSpace, index: Vec3): Vec3 {
  return kAxes.reduce((sum, axis) => add(sum, scale(columns[axis], index[axis])), origin);
}

// By Cramer's rule: the server refuses volumes whose axes are not independent.
export function indexOf({ columns: [a, b, c], origin }: IndexSpace, world: Vec3): Vec3 {
  const offset = subtract(world, origin);
  const whole = dot(a, cross(b, c));
  return [dot(offset, cross(b, c)) / whole, dot(offset, cross(c, a)) / whole, dot(offset, cross(a, b)) / whole];
}

// The voxel that a point of index space lies in; of one beyond the volume the nearest.
export function voxelAt({ dims }: IndexSpace, index: Vec3): Vec3 {
  const voxel = (axis: Axis): number => Math.min(dims[axis] - 1, Math.max(0, Math.floor(index[axis])));
  return [voxel(0), voxel(1), voxel(2)];
}

export function isInside({ dims }: IndexSpace, index: Vec3): boolean {
  return kAxes.every((axis) => index[axis] >= -1e-6 && index[axis] <= dims[axis] + 1e-6);
}

export function middleOf(space: IndexSpace): Vec3 {
  return worldOf(space, [space.dims[0] / 2, space.dims[1] / 2, space.dims[2] / 2]);
}

// The world's box of all corners of a box of index space.
export function worldBoxOf(space: IndexSpace, begin: Vec3, end: Vec3): { readonly min: Vec3; readonly max: Vec3 } {
  const side = (corner: number, axis: Axis): number => ((corner >> axis) & 1 ? end : begin)[axis];
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => worldOf(space, [side(corner, 0), side(corner, 1), side(corner, 2)]));
  const bound = (choose: (...parts: number[]) => number, axis: Axis): number => choose(...corners.map((point) => point[axis]));
  return { min: [bound(Math.min, 0), bound(Math.min, 1), bound(Math.min, 2)], max: [bound(Math.max, 0), bound(Math.max, 1), bound(Math.max, 2)] };
}

export function withPart(v: Vec3, axis: Axis, part: number): Vec3 {
  return [axis === 0 ? part : v[0], axis === 1 ? part : v[1], axis === 2 ? part : v[2]];
}
