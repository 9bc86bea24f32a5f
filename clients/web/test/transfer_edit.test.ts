// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { formatPoints, kMostPoints, parsePoints, pointsOf } from "../src/transfer";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";
import { ascending, besides, inserted, leastGap, moved, recoloured, resampled, sampleAt, without, type Points } from "../src/transfer_edit";

const points = (text: string): Points => {
  const parsed = parsePoints(text);
  assert.ok(parsed, text);
  return parsed;
};
const kThree = points("0:000000:0,100:ff0000:0.5,200:ffffff:1");

test("a function is straight between its points, and as at its ends beyond", () => {
  assert.deepEqual(sampleAt(kThree, 50), { value: 50, colour: "800000", opacity: 0.25 });
  assert.deepEqual(sampleAt(kThree, 100), { value: 100, colour: "ff0000", opacity: 0.5 });
  assert.deepEqual(sampleAt(kThree, -9), { value: -9, colour: "000000", opacity: 0 });
  assert.deepEqual(sampleAt(kThree, 999), { value: 999, colour: "ffffff", opacity: 1 });
});

test("a point is added on the line, or where it is wanted, but not upon another", () => {
  const added = inserted(kThree, 150, null, 1e-3);
  assert.deepEqual([added?.index, formatPoints(added?.points ?? [])], [2, "0:000000:0,100:ff0000:0.5,150:ff8080:0.75,200:ffffff:1"]);
  assert.equal(inserted(kThree, 150, 0.1, 1e-3)?.points[2]?.opacity, 0.1);
  assert.equal(inserted(kThree, 300, null, 1e-3)?.index, 3);
  assert.equal(inserted(kThree, 100.0001, null, 1e-3), null);
  const full = Array.from({ length: kMostPoints }, (_, value) => ({ value, colour: "ffffff", opacity: 1 }));
  assert.equal(inserted(full, 0.5, null, 1e-3), null);
  assert.deepEqual([besides(kThree, 0), besides(kThree, 1), besides(kThree, 2)], [50, 150, 150]);
});

test("a point stops at its neighbours, and between transparent and opaque", () => {
  assert.equal(formatPoints(moved(kThree, 1, 500, 2, 1)), "0:000000:0,199:ff0000:1,200:ffffff:1");
  assert.equal(formatPoints(moved(kThree, 1, -500, -1, 1)), "0:000000:0,1:ff0000:0,200:ffffff:1");
  assert.equal(formatPoints(moved(kThree, 2, 900, 1, 1)), "0:000000:0,100:ff0000:0.5,900:ffffff:1");
  assert.equal(moved(kThree, 1, NaN, 0, 1), kThree);
  const tight = points("0:000000:0,1:ff0000:0.5,2:ffffff:1");
  assert.equal(moved(tight, 1, 5, 0.5, 3)[1]?.value, 1, "where there is no room it stays");
});

test("a point is coloured and deleted, but not the last", () => {
  assert.equal(formatPoints(recoloured(kThree, 0, "123456")), "0:123456:0,100:ff0000:0.5,200:ffffff:1");
  assert.equal(formatPoints(without(kThree, 1)), "0:000000:0,200:ffffff:1");
  assert.equal(without(points("1:ffffff:1"), 0).length, 1);
});

test("values that meet are moved apart so far that their text is, those that descend are refused", () => {
  for (const [lo, hi] of [[0, 1], [-3024, 3071], [1e6, 1e6 + 1], [0, 1e-9], [0, 0]] as const) {
    const apart = ascending([lo, lo, hi, hi].map((value) => ({ value, colour: "ffffff", opacity: 1 })));
    assert.ok(apart !== null && parsePoints(formatPoints(apart)) !== null, `${lo} to ${hi}: ${formatPoints(apart ?? [])}`);
    assert.ok(leastGap([lo, hi]) > 0);
  }
  assert.equal(ascending([5, 4].map((value) => ({ value, colour: "ffffff", opacity: 1 }))), null);
  assert.equal(parsePoints("1:ffffff:1,1:ffffff:0"), null, "the server refuses it");
});

test("fewer points keep ends and course", () => {
  assert.equal(resampled(kThree), kThree);
  assert.equal(formatPoints(resampled(kThree, 2)), "0:000000:0,200:ffffff:1");
});

test("a preset has points too", () => {
  const channel = parseVolumeInfo(sampleVolume("vessels", "u8")).channels[0];
  assert.ok(channel);
  assert.equal(formatPoints(pointsOf("auto", channel)), channel.transfer);
  assert.equal(pointsOf("viridis", channel).length, 11);
  assert.equal(pointsOf("1:ffffff:1", channel).length, 1);
});
