// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { sidesOf } from "../src/axes";
import { formatLength, projectionOf, roundLength } from "../src/projection";
import { dot } from "../src/vector";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

test("sides have the patient's names where the space says so", () => {
  const names = (space: string | null) => sidesOf(space, [0, 1, 0]).map((side) => side.name).join("");
  assert.equal(names("left-posterior-superior"), "LRPASI");
  assert.equal(names("RAS"), "RLAPSI");
  for (const space of [null, "scanner-xyz", "3D-right-handed", "left-posterior"]) assert.equal(names(space), "+x−x+y−y+z−z", String(space));
});

test("the head is up, and a view from above has the front up", () => {
  for (const space of ["left-posterior-superior", "RAS", null]) {
    for (const side of sidesOf(space, [0, 1, 0])) assert.equal(dot(side.up, side.direction), 0, `${space} ${side.name}`);
  }
  const up = (name: string) => sidesOf("LPS", [0, 1, 0]).find((side) => side.name === name)?.up;
  assert.deepEqual([up("A"), up("S")], [[0, 0, 1], [0, -1, 0]]);
});

test("lengths are round, and in a unit in which they are short", () => {
  assert.deepEqual([roundLength(1), roundLength(4.9), roundLength(5), roundLength(73), roundLength(0.034)], [1, 2, 5, 50, 0.02]);
  assert.deepEqual([formatLength(50, "um"), formatLength(2000, "um"), formatLength(0.5, "mm"), formatLength(20, null), formatLength(3, "voxel")], ["50 µm", "2 mm", "500 µm", "20", "3 voxel"]);
});

test("the target stands in the middle, in perspective and parallel", () => {
  const view = initialView(parseVolumeInfo(sampleVolume("a", "u8")), [800, 600], {});
  for (const ortho of [null, 100]) {
    const [x, y] = projectionOf(view, { width: 800, height: 600, fovDegrees: 40, ortho })(view.camera.target) ?? [];
    assert.deepEqual([Math.round(x ?? 0), Math.round(y ?? 0)], [400, 300]);
  }
  assert.equal(projectionOf(view, { width: 800, height: 600, fovDegrees: 40 })([1000, 1000, 1000]), null, "behind the eye");
});
