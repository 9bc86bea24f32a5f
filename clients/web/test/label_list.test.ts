// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { labelsOf, opacitiesAt, sampleAlong, shownIn, withShown, type LabelList } from "../src/label_list";
import { formatPoints, kMostPoints, parsePoints, pointsOf } from "../src/transfer";
import { parseVolumeInfo, type ChannelInfo } from "../src/volume_info";
import { sampleLabels } from "./sample_volume";

const channelOf = (count: number, names: Readonly<Record<number, string>> = {}): ChannelInfo => {
  const channel = parseVolumeInfo(sampleLabels("atlas", count, names)).channels[0];
  assert.ok(channel);
  return channel;
};
const toggled = (list: LabelList, transfer: string, hidden: (value: number) => boolean): string => {
  const text = withShown(list, transfer, list.labels.map(({ value }) => !hidden(value)));
  assert.ok(text !== null);
  return text;
};
const check = (list: LabelList, text: string, hidden: (value: number) => boolean): void => {
  assert.ok(text === "auto" || parsePoints(text) !== null, "the server takes it");
  const shown = shownIn(list, text);
  const wrong = list.labels.find(({ value }, i) => shown[i] === hidden(value));
  assert.equal(wrong, undefined, `label ${wrong?.value}`);
};

test("labels have names and counts, and those without a voxel are none", () => {
  const { labels, isWhole } = labelsOf(channelOf(40, { 3: "liver", 7: "spleen" }));
  assert.equal(isWhole, true);
  assert.deepEqual(labels.slice(0, 3), [
    { value: 1, name: null, count: 100 }, { value: 2, name: null, count: 200 }, { value: 3, name: "liver", count: 300 },
  ]);
  assert.equal(labels.some(({ value }) => value === 5), false, "no voxel is a 5");
  assert.equal(labels.length, 39);
});

test("counts are told where each label has a bar of its own alone", () => {
  const channelWith = (top: number): ChannelInfo => ({ ...channelOf(40), densityRange: [1, top], histogram: { lo: 1, hi: top, counts: Array.from({ length: 256 }, (_, i) => i + 1) } });
  const last = (top: number) => labelsOf(channelWith(top)).labels.slice(-2).map(({ value, count }) => [value, count]);
  assert.deepEqual(last(256), [[255, 255], [256, 256]]);
  assert.deepEqual(last(257), [[256, null], [257, null]], "both are in the last bar");
});

test("a hidden label has opacity 0, the others stay as they are, and showing it again leaves nothing behind", () => {
  const list = labelsOf(channelOf(40));
  const text = toggled(list, "auto", (value) => value === 3);
  assert.match(text, /^1:000001:0.3,2:000002:0.3,3:000003:0,4:000004:0.3,6:/);
  check(list, text, (value) => value === 3);
  assert.equal(toggled(list, text, () => false), "auto");
  const only = toggled(list, text, (value) => value !== 9);
  check(list, only, (value) => value !== 9);
  assert.equal(toggled(list, only, () => false), "auto");
});

test("colours and opacities of one's own stay", () => {
  const list = labelsOf(channelOf(4));
  const text = toggled(list, "1:ff0000:0.9,2:00ff00:0.8,3:0000ff:0,4:ffffff:1", (value) => value === 2 || value === 3);
  assert.equal(text, "1:ff0000:0.9,2:00ff00:0,3:0000ff:0,4:ffffff:1");
  assert.equal(toggled(list, text, (value) => value === 3), "1:ff0000:0.9,2:00ff00:0.3,3:0000ff:0,4:ffffff:1", "as opaque as at first");
});

test("of more labels than points those in a row share two, exactly", () => {
  const list = labelsOf(channelOf(20000));
  assert.equal(list.labels.length, 20000);
  for (const hidden of [(v: number) => v === 777, (v: number) => v !== 777, (v: number) => v > 5000 && v < 9000, (v: number) => v % 200 === 0, () => true]) {
    const text = toggled(list, "auto", hidden);
    assert.ok(text.split(",").length <= kMostPoints);
    check(list, text, hidden);
  }
  const text = toggled(list, "auto", (value) => value === 777);
  const coloursOf = (tf: string): readonly string[] => [10, 775, 4000, 19000].map((value) => sampleAlong(pointsOf(tf, list.channel), value).colour);
  assert.deepEqual(coloursOf(text), coloursOf("auto"));
  assert.equal(toggled(list, text, () => false), "auto");
  assert.equal(withShown(list, "auto", list.labels.map((_, i) => i % 2 === 0)), null, "in turns they need more than there are");
});

test("where labels are not all listed, hiding one hides none beside it", () => {
  const list = labelsOf(channelOf(2_000_000, { 1000: "thalamus" }));
  assert.equal(list.isWhole, false);
  assert.ok(list.labels.some(({ name }) => name === "thalamus"));
  const text = toggled(list, "auto", (value) => value === 1000);
  const opacities = opacitiesAt(parsePoints(text) ?? [], [999, 1000, 1001]);
  assert.deepEqual(opacities, [0.3, 0, 0.3]);
  const none = toggled(list, "auto", () => true);
  assert.ok(opacitiesAt(parsePoints(none) ?? [], [1, 500, 999, 1_234_567, 2_000_000]).every((opacity) => opacity === 0));
});

test("ten thousands of labels are hidden at once", () => {
  const list = labelsOf(channelOf(60000));
  const begin = performance.now();
  for (let i = 0; i < 5; i++) check(list, toggled(list, "auto", (value) => value > 100 * i && value < 9000), (value) => value > 100 * i && value < 9000);
  assert.ok((performance.now() - begin) / 5 < 400, `${(performance.now() - begin) / 5} ms`);
});

test("points are read off in one walk", () => {
  const points = parsePoints("0:000000:0,10:ffffff:1") ?? [];
  assert.deepEqual(opacitiesAt(points, [-1, 0, 5, 10, 11]), [0, 0, 0.5, 1, 1]);
  assert.equal(formatPoints([sampleAlong(points, 5)]), "5:808080:0.5");
});
