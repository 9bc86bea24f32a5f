// SPDX-License-Identifier: Apache-2.0
// The page's own part of a view in the address, and tools and words that follow from it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { MarkTool } from "../src/mark_tool";
import { kNoSlices, parseSlab } from "../src/slice_state";
import { valuesOf, voxelQuery } from "../src/slice_probe";
import { directionWords, summaryOf } from "../src/summary";
import { fitMarks, formatFragment, imageQuery, parseFragment } from "../src/url_state";
import { fitted, initialView, membersOf } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kVolume = parseVolumeInfo(sampleVolume("vessels", "u8"));
const kView = initialView(kVolume, [800, 600], {});

test("slices, marks and what stands beside come back from the address, and nobody else is told", () => {
  const camera = { eye: [196.5, 158.75, 242.25], target: [48, 40, 64], up: [0, 1, 0] } as const; // an address has 10 digits
  const plain = initialView(kVolume, [800, 600], { camera });
  const view = initialView(kVolume, [800, 600], {
    camera,
    slices: { layout: "oblique", crosshair: [1.5, 79, 0.25], thickness: 7, reduce: "mean", isGrey: true },
    marks: [{ kind: "text", points: [[1, 2, 3]], colour: "ffb454", text: "5 % + a;b" }],
    beside: "volume=vessels&mode=mip",
  });
  const { overrides, faults } = parseFragment(formatFragment("vessels", view, false));
  assert.deepEqual(faults, []);
  assert.deepEqual(initialView(kVolume, [800, 600], fitted(kVolume, overrides).change), view);
  assert.equal(imageQuery(view, false), imageQuery(plain, false));
  assert.deepEqual(membersOf(view, false), membersOf(plain, false));
  assert.doesNotMatch(formatFragment("vessels", plain, false), /slices|crosshair|slab|marks|beside/);
});

test("what the address gets wrong of slices is named and left out", () => {
  const { overrides, faults } = parseFragment("slices=both&crosshair=1,2&slab=0:max&slice-colors=red&marks=dot");
  assert.deepEqual(faults.map((fault) => fault.split(":")[0]), ["slices", "crosshair", "slab", "slice-colors", "marks"]);
  assert.deepEqual(overrides, {});
  const outside = fitted(kVolume, parseFragment("slices=x&crosshair=1,2,129").overrides);
  assert.deepEqual([outside.change.slices, outside.faults], [{ ...kNoSlices, layout: "x" }, ["crosshair: lies outside of this volume"]]);
  assert.deepEqual(["5", "999:min", "1:mean", "1000", "2:sum", "", "-1", "2.5"].map(parseSlab), [
    { thickness: 5, reduce: "max" }, { thickness: 999, reduce: "min" }, { thickness: 1, reduce: "mean" }, null, null, null, null, null,
  ]);
});

test("marks that are too long are not in the address", () => {
  const marks = Array.from({ length: 60 }, (_, i) => ({ kind: "point" as const, points: [[i + 0.123456, 2.345678, 3.456789]] as const, colour: "ffb454", text: "somewhere" }));
  assert.equal(fitMarks({ ...kView, marks }), false);
  assert.doesNotMatch(formatFragment("vessels", { ...kView, marks }, false), /marks=/);
  assert.equal(fitMarks({ ...kView, marks: marks.slice(0, 10) }), true);
});

test("a mark is made of as many points as it has, in one picture, and a double click is one point", () => {
  const made: string[] = [];
  const pointsOf = (own: MarkTool): number | undefined => own.pending?.points.length;
  const tool = new MarkTool((kind, points) => made.push(`${kind} ${points.map((point) => point[0]).join()}`), () => undefined);
  tool.set([0, 0, 0], "z");
  assert.equal(pointsOf(tool), undefined, "a crosshair is no mark");
  tool.choose("ruler");
  tool.set([1, 0, 0], "z");
  tool.hover([9, 0, 0], "x");
  assert.equal(pointsOf(tool), 1, "what is hovered in another picture is none of it");
  tool.set([2, 0, 0], "x");
  tool.set([3, 0, 0], "x");
  tool.choose("area");
  for (const x of [1, 2]) tool.set([x, 0, 0], "z");
  assert.equal(tool.finish(), false, "two points have no area");
  for (const x of [3, 4, 4]) tool.set([x, 0, 0], "z");
  assert.equal(tool.finish(true), true);
  tool.set([7, 0, 0], "z");
  assert.equal(tool.cancel(), true);
  assert.equal(tool.cancel(), false);
  assert.deepEqual(made, ["ruler 2,3", "area 1,2,3,4"]);
});

test("a voxel's bytes are data values", () => {
  const bytes = (...parts: number[]): ArrayBuffer => new Uint8Array(parts).buffer;
  const header = (type: string, channels = 1): string => JSON.stringify({ dims: [1, 1, 1], channels, type });
  const scaled = { channels: [{ ...kVolume.channels[0]!, valueScale: 0.5, valueOffset: -100 }, { ...kVolume.channels[0]!, valueScale: 2, valueOffset: 0 }] };
  assert.deepEqual(valuesOf(header("u8"), bytes(42), kVolume), [42]);
  assert.deepEqual(valuesOf(header("u16", 2), bytes(0, 1, 3, 0), scaled), [28, 6]);
  assert.deepEqual(valuesOf(header("i16"), bytes(0x18, 0xfc), { channels: [{ ...kVolume.channels[0]!, valueOffset: -32768 }] }), [-1000], "signed ones are as they come");
  assert.deepEqual(valuesOf(header("rgba8"), bytes(1, 2, 3, 255), kVolume), [1, 2, 3, 255]);
  assert.throws(() => valuesOf(header("u16"), bytes(1), kVolume), /2 bytes/);
  assert.throws(() => valuesOf(header("f64"), bytes(1), kVolume), /type/);
  assert.throws(() => valuesOf(null, bytes(1), kVolume), /JSON/);
  assert.equal(voxelQuery([3, 0, 9], "2"), "format=raw&level=0&box=3,0,9,4,1,10&time=2");
});

test("the view in words: what, how, cut, from where, how good", () => {
  const view = {
    ...kView, clip: { min: [0, 0, 0], max: [1, 1, 1] }, planes: [[1, 0, 0, 0]], mode: "iso", iso: 120, ortho: 30,
    camera: { eye: [148, 40, 64], target: [48, 40, 64], up: [0, 1, 0] }, marks: [{ kind: "ruler", points: [[0, 0, 0], [1, 0, 0]], colour: "ffffff", text: "" }],
  } as const;
  assert.equal(
    summaryOf(view, kVolume, "Full quality", ["z slice, slice 3 of 0–63"]),
    "vessels of the mock, 96 × 80 × 64 voxels. Drawn: a surface of 120. Values shown: 10 to 250. Cut to a box and by a plane. Seen from +x, in parallel projection. "
      + "Slices: z slice, slice 3 of 0–63. Marks: 1 distance. Picture: Full quality.",
  );
  assert.match(summaryOf(kView, kVolume, "", []), /Nothing is cut away.*Picture: none yet\.$/);
  const patient = { ...kVolume, space: "left-posterior-superior" };
  assert.equal(directionWords({ camera: { eye: [0, -100, 60], target: [0, 0, 0], up: [0, 0, 1] } }, patient), "anterior and superior");
  assert.equal(directionWords({ camera: { eye: [80, -100, 60], target: [0, 0, 0], up: [0, 0, 1] } }, patient), "anterior, left and superior");
});
