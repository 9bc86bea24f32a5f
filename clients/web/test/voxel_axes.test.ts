// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { voxelAxis, voxelRange } from "../src/voxel_axes";
import { parseVolumeInfo, type VolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const placed = (world_from_index: readonly (readonly number[])[], world_box: readonly number[]): VolumeInfo =>
  parseVolumeInfo({ ...sampleVolume("v", "u8"), world_from_index, world_box });

test("an axis of the world goes along one of the voxels, from either end", () => {
  const straight = placed([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0]], [0, 0, 0, 96, 80, 128]);
  assert.deepEqual(voxelAxis(straight, 2), { step: 2, voxels: 64, isReversed: false });
  assert.deepEqual(voxelRange(straight, 2, [32, 128]), [16, 64]);
  const turned = placed([[-1, 0, 0, 96], [0, 0, 2, -100], [0, -1, 0, 80]], [0, -100, 0, 96, 28, 80]);
  assert.deepEqual([0, 1, 2].map((axis) => voxelAxis(turned, axis as 0 | 1 | 2).voxels), [96, 64, 80]);
  assert.deepEqual(voxelRange(turned, 0, [0, 90]), [6, 96], "counted from the far end");
  assert.deepEqual(voxelRange(turned, 1, [-100, -80]), [0, 10]);
});

test("one that goes obliquely through them has no voxels, and steps of about one", () => {
  const [c, s] = [Math.cos(0.3), Math.sin(0.3)];
  const oblique = placed([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 2, 0]], [-24, 0, 0, 92, 105, 128]);
  assert.deepEqual(voxelAxis(oblique, 0), { step: 1, voxels: null, isReversed: false });
  assert.equal(voxelRange(oblique, 1, [0, 9]), null);
  assert.deepEqual(voxelRange(oblique, 2, [0, 9]), [0, 4.5]);
});
