// SPDX-License-Identifier: Apache-2.0
// Lengths, angles and areas against arithmetic by hand, and marks as text.

import assert from "node:assert/strict";
import { test } from "node:test";
import { indexSpaceOf, worldOf } from "../src/index_space";
import { csvOf, cornersOf, formatMarks, labelOf, marksFile, parseMarks, parseMarksFile, valueOf, type Mark } from "../src/marks";
import { angleOf, polygonArea, polylineLength, rulerOf } from "../src/measure";
import type { Vec3 } from "../src/vector";
import { parseVolumeInfo, type VolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const volumeOf = (fields: object): VolumeInfo => parseVolumeInfo({ ...sampleVolume("v", "u8"), ...fields });
const markOf = (kind: Mark["kind"], points: readonly Vec3[], text = ""): Mark => ({ kind, points, colour: "ff8800", text });
const isNear = (a: number | undefined, b: number): void => assert.ok(a !== undefined && Math.abs(a - b) < 1e-9, `${a} is not ${b}`);

// 0.5 x 0.5 x 2.5 mm, the stack of a thick-sliced scan.
const kThick = volumeOf({ spacing: [0.5, 0.5, 2.5], world_from_index: [[0.5, 0, 0, -100], [0, 0.5, 0, 20], [0, 0, 2.5, 7]] });

test("lengths through voxels that are no cubes are those of the world", () => {
  const space = indexSpaceOf(kThick);
  const ruler = rulerOf(kThick, space);
  const at = (x: number, y: number, z: number): Vec3 => worldOf(space, [x, y, z]);
  // 6 voxels of 0.5 mm and 1.6 of 2.5 mm: 3 and 4 mm, so 5.
  isNear(valueOf(markOf("ruler", [at(10, 10, 1), at(16, 10, 2.6)]), ruler)?.value, 5);
  assert.equal(labelOf(markOf("ruler", [at(10, 10, 1), at(16, 10, 2.6)], "cyst"), ruler), "5 mm · cyst");
  // A rectangle of 8 x 2 voxels in the x-z plane is 4 mm by 5 mm.
  const rectangle = [at(0, 5, 0), at(8, 5, 0), at(8, 5, 2), at(0, 5, 2)];
  isNear(valueOf(markOf("area", rectangle), ruler)?.value, 20);
  assert.equal(valueOf(markOf("area", rectangle), ruler)?.unit, "mm²");
  isNear(valueOf(markOf("line", rectangle), ruler)?.value, 4 + 5 + 4);
  // One voxel up and five across, in the world a square's diagonal.
  isNear(valueOf(markOf("angle", [at(5, 0, 0), at(0, 0, 0), at(5, 0, 1)]), ruler)?.value, 45);
});

test("where a file has no spacing and no unit, voxels are counted", () => {
  const counted = volumeOf({ spacing: [1, 1, 1], world_from_index: [[0, 1, 0, 5], [1, 0, 0, 5], [0, 0, 1, 5]], metadata: {} });
  const ruler = rulerOf(counted, indexSpaceOf(counted));
  assert.deepEqual(valueOf(markOf("ruler", [[5, 5, 5], [8, 9, 5]]), ruler), { value: 5, unit: "voxels" });
  assert.equal(valueOf(markOf("area", [[5, 5, 5], [8, 5, 5], [8, 9, 5]]), ruler)?.unit, "voxels²");
  const spaced = volumeOf({ spacing: [1, 1, 3], metadata: {} });
  assert.equal(rulerOf(spaced, indexSpaceOf(spaced)).unit, "", "lengths without a name");
});

test("angles and areas of plain figures", () => {
  isNear(angleOf([[1, 0, 0], [0, 0, 0], [0, 2, 0]]) ?? NaN, 90);
  isNear(angleOf([[1, 0, 0], [0, 0, 0], [-3, 0, 0]]) ?? NaN, 180);
  assert.equal(angleOf([[1, 0, 0], [1, 0, 0], [0, 2, 0]]), null, "without a length there is no angle");
  assert.equal(valueOf(markOf("angle", [[1, 0, 0], [1, 0, 0], [0, 2, 0]]), rulerOf(kThick, indexSpaceOf(kThick))), null);
  isNear(polylineLength([[0, 0, 0], [3, 4, 0], [3, 4, 12]]), 17);
  isNear(polylineLength([[1, 1, 1]]), 0);
  // An L of three unit squares, turned into another plane and far from the origin.
  const flat: readonly Vec3[] = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]];
  isNear(polygonArea(flat), 3);
  isNear(polygonArea(flat.map(([x, y]): Vec3 => [1000 + x * 0.6, 5 * y, -70 + x * 0.8])), 15);
  isNear(polygonArea([[0, 0, 0], [1, 1, 1]]), 0);
});

test("half of a character is no text: a file with it is refused, and no text keeps the address from being written", () => {
  const mark = { kind: "point", color: "ff8800", points: [[1, 2, 3]] };
  const fileOf = (text: string): string => `{"type":"blockwalk-marks","version":1,"volume":"v","marks":[${JSON.stringify({ ...mark, text: "fine 😀" })},{"kind":"point","color":"ff8800","points":[[1,2,3]],"text":"${text}"}]}`;
  for (const text of ["\\ud800", "a\\udc00", "\\ude00\\ud83d"]) assert.throws(() => parseMarksFile(fileOf(text)), { name: "FormatError", message: /marks\[1\]\.text: expected whole characters/ });
  assert.equal(parseMarksFile(fileOf("\\ud83d\\ude00"))[1]?.text, "😀");
  assert.equal(parseMarks(formatMarks([markOf("text", [[1, 2, 3]], "cut \ud83d")]))?.[0]?.text, "cut \ufffd");
});

const kMarks: readonly Mark[] = [
  markOf("ruler", [[1.5, -2, 3e-7], [4, 5, 6]], "tip; 50% & \"more\": ö"),
  { kind: "area", points: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], colour: "00ff7f", text: "" },
  { kind: "box", points: [[3, 9, 1], [1, 2, 8]], colour: "ffffff", text: "here" },
];

test("marks are the same through the address and through a file", () => {
  assert.deepEqual(parseMarks(formatMarks(kMarks)), kMarks);
  assert.deepEqual(parseMarksFile(marksFile("v", kMarks)), kMarks);
});

test("what is no mark is refused, and the member named", () => {
  for (const text of ["", "ruler", "ruler:ff8800:1,2,3", "ruler:ff8800:1,2,3,4,5,x", "ruler:zz8800:1,2,3,4,5,6", "circle:ff8800:1,2,3", "point:ff8800:1,2,,", "point:ff8800:1,2,3:a:b", "point:ff8800:1,2,3:%E0", `point:ff8800:1,2,3:${"a".repeat(121)}`]) {
    assert.equal(parseMarks(text), null, text);
  }
  assert.equal(parseMarks(Array.from({ length: 201 }, () => "point:ff8800:1,2,3").join(";")), null);
  const file = (change: object) => () => parseMarksFile(JSON.stringify({ type: "blockwalk-marks", version: 1, marks: [{ kind: "point", color: "ff8800", text: "", points: [[1, 2, 3]], ...change }] }));
  assert.equal(file({})().length, 1);
  assert.throws(file({ kind: "dot" }), /file\.marks\[0\]\.kind: expected one of ruler/);
  assert.throws(file({ points: [[1, 2]] }), /file\.marks\[0\]\.points\[0\]\.point: expected 3 finite numbers/);
  assert.throws(file({ points: [] }), /file\.marks\[0\]\.points: expected 1 points/);
  assert.throws(file({ color: "red" }), /color: expected rrggbb/);
  assert.throws(() => parseMarksFile("{}"), /file\.type/);
  assert.throws(() => parseMarksFile("no"), /expected JSON/);
});

test("a spreadsheet gets a line a mark, and no formula", () => {
  const ruler = rulerOf(kThick, indexSpaceOf(kThick));
  const lines = csvOf([markOf("ruler", [[0, 0, 0], [3, 4, 0]], "=1+1"), markOf("point", [[1, 2, 3]], "a, \"b\"")], ruler).split("\n");
  assert.deepEqual(lines, ["number,kind,text,value,unit,points", "1,ruler,'=1+1,5,mm,\"0 0 0; 3 4 0\"", "2,point,\"a, \"\"b\"\"\",,,1 2 3", ""]);
});

test("a box lies along the volume's axes, whichever corners were given", () => {
  const space = indexSpaceOf(kThick);
  const [a, b] = [worldOf(space, [8, 2, 6]), worldOf(space, [1, 4, 3])];
  assert.deepEqual(cornersOf(markOf("box", [a, b]), space)[0], worldOf(space, [1, 2, 3]));
  assert.deepEqual(cornersOf(markOf("box", [a, b]), space)[7], worldOf(space, [8, 4, 6]));
});
