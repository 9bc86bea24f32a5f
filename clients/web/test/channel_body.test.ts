// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { bodyOf } from "../src/channel_body";
import { presetPoints } from "../src/transfer";
import { parseVolumeInfo, type ChannelInfo } from "../src/volume_info";
import { sampleCt, sampleLabels, sampleVolume } from "./sample_volume";

const channelOf = (volume: unknown): ChannelInfo => {
  const channel = parseVolumeInfo(volume).channels[0];
  assert.ok(channel);
  return channel;
};
const kCt = channelOf(sampleCt("abdomen"));

// tests/view/transfer_presets_test.cpp has the same numbers.
test("of CT, whose own colours are by tissue, maps run over the body as the server has them", () => {
  assert.deepEqual(bodyOf(kCt), [-988.28125, -970.703125, 1451.171875]);
  const points = presetPoints("viridis", kCt) ?? [];
  assert.deepEqual(points.map(({ colour }) => colour).filter((_, i) => i % 5 === 0), ["440154", "21918c", "fde725"]);
  assert.deepEqual([points[0]?.value, points[5]?.value, points[10]?.value], [-988.28125, 231.4453125, 1451.171875]);
  assert.deepEqual([points[0]?.opacity, points[10]?.opacity], [0, 0.4]);
  assert.ok(Math.abs((points[5]?.opacity ?? 0) - 0.2287661) < 1e-7);
  assert.equal(presetPoints("grey", kCt)?.length, 2);
});

test("what the file says to show first comes before the histogram", () => {
  const points = presetPoints("viridis", { ...kCt, window: [-160, 240] }) ?? [];
  assert.deepEqual([0, 5, 10].map((i) => points[i]?.value), [-160, 40, 240]);
  assert.equal(points[5]?.opacity, 0.06);
  assert.deepEqual(bodyOf({ ...kCt, window: [240, 240] }), bodyOf(kCt), "a window has a width");
});

test("a ramp of one's own is the body", () => {
  const points = presetPoints("inferno", channelOf(sampleVolume("vessels", "u8"))) ?? [];
  assert.deepEqual([points[0]?.value, points[10]?.value], [0, 255], "not what the histogram says");
});

test("three labels are none", () => {
  const labels = channelOf(sampleLabels("atlas", 3));
  assert.notEqual(presetPoints("viridis", labels)?.at(-1)?.value, 3);
});

test("a mask has no body", () => {
  const counts = kCt.histogram.counts.map(() => 0);
  assert.equal(bodyOf({ ...kCt, densityRange: [7, 7] }), null);
  assert.equal(bodyOf({ ...kCt, histogram: { lo: 0, hi: 1, counts } }), null);
  assert.equal(presetPoints("viridis", { ...kCt, densityRange: [7, 7] }), null);
});
