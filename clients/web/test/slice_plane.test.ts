// SPDX-License-Identifier: Apache-2.0
// How slices lie: as radiologists look where a volume is a patient's, else as the file has it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { indexOf, indexSpaceOf, isInside, worldOf } from "../src/index_space";
import { fittedFrame, panned, pixelOf, pointAt, zoomedAt } from "../src/slice_frame";
import { axisMatrix } from "../src/slice_picture";
import { boxCorners, facingPlane, orientationsOf, orthogonalPlane, sectionOf } from "../src/slice_plane";
import { axisPictures, colourParts, levelFor, overviewLevel, ownWindows, planePicture } from "../src/slice_query";
import { kNoSlices } from "../src/slice_state";
import { edgeNames, sliceText } from "../src/slice_text";
import { rulerOf } from "../src/measure";
import { kMostPoints, parsePoints } from "../src/transfer";
import { dot, type Vec3 } from "../src/vector";
import { initialView, type ViewChange } from "../src/view_state";
import { parseVolumeInfo, type VolumeInfo } from "../src/volume_info";
import { sampleCt, sampleVolume } from "./sample_volume";

const volumeOf = (fields: object): VolumeInfo => parseVolumeInfo({ ...sampleVolume("v", "u8"), ...fields });
const kPlain = volumeOf({});
const orientations = (volume: VolumeInfo) => orientationsOf(indexSpaceOf(volume), volume.space, volume.defaultView.camera.up);
const patient = (space: string, rows: readonly (readonly number[])[]): VolumeInfo => volumeOf({ world_from_index: rows, metadata: { space, length_unit: "mm" } });

function edgesOf(volume: VolumeInfo): Record<string, string> {
  const space = indexSpaceOf(volume);
  return Object.fromEntries(orientations(volume).map((orientation) => {
    const plane = orthogonalPlane(space, orientation, 3, 1);
    const { left, right, top, bottom } = edgeNames({ volume, space, ruler: rulerOf(volume, space), orientation }, plane);
    return [orientation.title, left + right + top + bottom];
  }));
}

test("what is no patient lies as its file has it, row 0 on top", () => {
  assert.deepEqual(orientations(kPlain).map(({ title, across, down }) => [title, across, down]), [
    ["z", { axis: 0, sign: 1 }, { axis: 1, sign: 1 }], ["y", { axis: 0, sign: 1 }, { axis: 2, sign: 1 }], ["x", { axis: 1, sign: 1 }, { axis: 2, sign: 1 }],
  ]);
  assert.deepEqual(edgesOf(kPlain), { z: "−x+x−y+y", y: "−x+x−z+z", x: "−y+y−z+z" });
});

test("a patient's right is on the left, the front on top of an axial slice and on the left of a sagittal one", () => {
  const wanted = { Axial: "RLAP", Coronal: "RLSI", Sagittal: "APSI" };
  const identity = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]];
  assert.deepEqual(edgesOf(patient("left-posterior-superior", identity)), wanted);
  assert.deepEqual(edgesOf(patient("right-anterior-superior", identity)), wanted);
  assert.deepEqual(edgesOf(patient("LAS", identity)), wanted);
  // A sagittal acquisition whose axes run back, down and to the right.
  assert.deepEqual(edgesOf(patient("right-anterior-superior", [[0, 0, 2, 0], [-1, 0, 0, 0], [0, -1, 0, 0]])), wanted);
  // Axes turned by up to 40 degrees are named by the nearest.
  assert.deepEqual(edgesOf(patient("left-posterior-superior", [[0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0]])), wanted);
});

test("slices of a patient's volume that lies on its side are found along the right axis", () => {
  const volume = patient("right-anterior-superior", [[0, 0, 2, 0], [-1, 0, 0, 0], [0, -1, 0, 0]]);
  assert.deepEqual(orientations(volume).map(({ title, axis }) => [title, axis]), [["Axial", 1], ["Coronal", 0], ["Sagittal", 2]]);
  const space = indexSpaceOf(volume);
  const [axial] = orientations(volume);
  assert.ok(axial);
  assert.equal(sliceText({ volume, space, ruler: rulerOf(volume, space), orientation: axial }, 12, [4, -3, -12.5]), "slice 12 of 0–79 · I 12.5 mm");
});

test("places in the plane and in the world are each other's, through any axes", () => {
  const sheared = volumeOf({ world_from_index: [[0.5, 0.1, 0, 10], [0, 2, 0.3, -4], [0, 0, 3, 7]] });
  const space = indexSpaceOf(sheared);
  for (const point of [[0, 0, 0], [12.5, 3.25, 60]] as const) {
    const back = indexOf(space, worldOf(space, point));
    assert.ok(back.every((part, i) => Math.abs(part - (point[i] ?? 0)) < 1e-9));
  }
  for (const orientation of orientations(sheared)) {
    const plane = orthogonalPlane(space, orientation, 7, 1);
    const [s, t, depth] = plane.locate(plane.place([5, -2]));
    assert.ok(Math.abs(s - 5) < 1e-9 && Math.abs(t + 2) < 1e-9 && Math.abs(depth) < 1e-9);
  }
  assert.equal(isInside(space, [0, 0, 64.1]), false);
});

test("a slab reaches as far as the server's: from index - (thickness - 1) / 2 on", () => {
  const space = indexSpaceOf(kPlain);
  const [z] = orientations(kPlain);
  assert.ok(z);
  const inSlab = (thickness: number, index: number): boolean => {
    const plane = orthogonalPlane(space, z, 10, thickness);
    return Math.abs(plane.locate(worldOf(space, [1, 1, index + 0.5]))[2]) <= plane.reach;
  };
  assert.deepEqual([9, 10, 11].map((index) => inSlab(1, index)), [false, true, false]);
  assert.deepEqual([8, 9, 10, 11, 12].map((index) => inSlab(2, index)), [false, false, true, true, false]);
  assert.deepEqual([7, 8, 9, 10, 11, 12, 13].map((index) => inSlab(5, index)), [false, true, true, true, true, true, false]);
});

test("zooming keeps what is under the pointer, panning moves by its pixels", () => {
  const space = indexSpaceOf(kPlain);
  const [z] = orientations(kPlain);
  assert.ok(z);
  const plane = orthogonalPlane(space, z, 10, 1);
  const size = [400, 200] as const;
  const frame = fittedFrame(plane, size);
  assert.deepEqual(frame.centre, [48, 40]);
  assert.ok(Math.abs(frame.unit - (1.06 * 80) / 200) < 1e-12);
  const near = zoomedAt(frame, 0.5, 30, 20, size, frame.unit, 1);
  const [before, after] = [pointAt(frame, 30, 20, size), pointAt(near, 30, 20, size)];
  assert.ok(Math.abs(before[0] - after[0]) < 1e-9 && Math.abs(before[1] - after[1]) < 1e-9);
  assert.deepEqual(pixelOf(panned(near, 7, -3), pointAt(near, 30, 20, size), size).map((part) => Math.round(part * 1e6) / 1e6), [37, 17]);
});

test("a picture's pixels fall on their voxels, transposed and turned round too", () => {
  const volume = patient("right-anterior-superior", [[0, 0, 2, 0], [-1, 0, 0, 0], [0, -1, 0, 0]]);
  const space = indexSpaceOf(volume);
  const size = [300, 300] as const;
  for (const orientation of orientations(volume)) {
    const plane = orthogonalPlane(space, orientation, 3, 1);
    const frame = fittedFrame(plane, size);
    const [a, b, c, d, e, f] = axisMatrix({ kind: "axis", space, orientation, level: 1, begin: [16, 32] }, frame, size);
    const [columns, rows] = orientation.axis === 0 ? [1, 2] : orientation.axis === 1 ? [0, 2] : [0, 1];
    const index = [0.5, 0.5, 0.5].map((half, axis) => (axis === columns ? 16 + 2 * 5 : axis === rows ? 32 + 2 * 9 : 3 + half));
    const wanted = pixelOf(frame, plane.locate(worldOf(space, [index[0] ?? 0, index[1] ?? 0, index[2] ?? 0])), size);
    assert.ok(Math.abs(a * 5 + c * 9 + e - wanted[0]) < 1e-9 && Math.abs(b * 5 + d * 9 + f - wanted[1]) < 1e-9, orientation.title);
  }
});

test("a plane through a box cuts a polygon of 3 to 6 corners", () => {
  const space = indexSpaceOf(kPlain);
  const corners = boxCorners(space, [0, 0, 0], space.dims);
  const facing = (eye: Vec3, through: Vec3) => facingPlane(space, { eye, target: [48, 40, 64], up: [0, 1, 0] }, through, 1);
  assert.equal(sectionOf(facing([48, 40, 500], [48, 40, 64]), corners).length, 4);
  assert.equal(sectionOf(facing([448, 440, 464], [48, 40, 64]), corners).length, 6);
  assert.equal(sectionOf(facing([448, 440, 464], [95, 79, 127]), corners).length, 3);
  assert.equal(sectionOf(facing([448, 440, 464], [950, 790, 1270]), corners).length, 0);
  const plane = facing([448, 440, 464], [48, 40, 64]);
  assert.ok(sectionOf(plane, corners).every((point) => Math.abs(plane.locate(point)[2]) < 1e-9));
  assert.ok(Math.abs(dot(plane.right, plane.down)) < 1e-12);
});

const kLarge = volumeOf({ dims: [5000, 4000, 3000], levels: Array.from({ length: 5 }, (_, level) => ({ ...sampleVolume("v", "u8").levels[0], level })) });

test("from afar the whole slice is one picture, close up tiles of what is in sight", () => {
  const [space, view] = [indexSpaceOf(kLarge), initialView(kLarge, [800, 600], {})];
  assert.equal(overviewLevel(space, 2, 5), 3);
  assert.deepEqual([0.3, 1, 1.9, 2, 8, 1000].map((pixel) => levelFor(pixel, space, 2, 5)), [0, 0, 0, 1, 3, 4]);
  const far = axisPictures(kLarge, space, view, 2, 1500, 9, { min: [0, 0, 0], max: [5000, 4000, 1] });
  assert.deepEqual(far.map(({ query }) => query), ["axis=z&index=1500&level=3&tf=auto&format=png"]);
  const near = axisPictures(kLarge, space, view, 2, 1500, 1, { min: [1000, 100, 0], max: [2100, 900, 1] });
  assert.deepEqual(near.map(({ begin, level }) => [level, ...begin]), [[3, 0, 0], [0, 1024, 0], [0, 2048, 0], [0, 0, 0]]);
  assert.match(near[1]?.query ?? "", /&level=0&box=1024,0,0,2048,1024,3000&/);
  const edge = axisPictures(kLarge, space, view, 2, 1500, 1, { min: [4900, 3900, 0], max: [6000, 5000, 1] });
  assert.match(edge[1]?.query ?? "", /box=4096,3072,0,5000,4000,3000/);
  const beyond = axisPictures(kLarge, space, view, 2, 1500, 1, { min: [7000, 3900, 0], max: [8000, 5000, 1] });
  assert.equal(beyond.length, 1, "nothing of it is in sight");
});

test("slices have the colours of the picture in 3D, on black where that shows nothing; labels and colours are themselves", () => {
  const of = (volume: VolumeInfo, change: ViewChange, isGrey = false): string[] => colourParts(initialView(volume, [800, 600], change), volume, isGrey);
  assert.deepEqual(of(kPlain, {}), ["tf=auto"], "its own begin in black");
  assert.deepEqual(of(kPlain, { transfers: ["10:ff0000:0,20:00ff00:0.5"] }), ["tf=9.999:000000:0,10:ff0000:0,20:00ff00:0.5"]);
  assert.deepEqual(of(kPlain, { transfers: ["10:ff0000:0.1,20:00ff00:0.5"] }), ["tf=10:ff0000:0.1,20:00ff00:0.5"]);
  assert.match(of(kPlain, { transfers: ["viridis"] })[0] ?? "", /^tf=-0.0255:000000:0,0:440154:0,/);
  assert.deepEqual(of(kPlain, { transfers: ["10:ff0000:0,20:00ff00:0.5"] }, true), ["window=10:20", "gamma=1", "colors=ffffff"]);
  const cells = parseVolumeInfo(sampleVolume("cells", "u16", ["a", "b"]));
  // An item a channel of the volume, as the server reads them (browser_test.ts asks it).
  assert.deepEqual(of(cells, { drawn: [1] }, true), ["channels=1", "window=;1000:1255", "gamma=;1", "colors=;ffffff"]);
  const three = parseVolumeInfo(sampleVolume("cells", "u16", ["a", "b", "c"]));
  assert.deepEqual(of(three, { drawn: [0, 2] }, true), ["channels=0,2", "window=0:255;;2000:2255", "gamma=1;;1", "colors=ffffff;;ffffff"]);
  assert.deepEqual(of(three, { drawn: [0, 2], transfers: ["viridis", "inferno", "auto"] }).map((text) => text.replace(/[\d.]+:[0-9a-f]{6}:[\d.,:a-f-]*(?=;)/, "P")), ["channels=0,2", "tf=-P;;auto"]);
  // A channel of one single value has no contrast, and need not have one where it is not drawn.
  const flat = parseVolumeInfo({ ...sampleVolume("cells", "u16", ["a", "b"]), default_view: { ...sampleVolume("cells", "u16", ["a", "b"]).default_view, tf: ["5:ffffff:1", "0:000000:0,9:ffffff:1"] } });
  assert.deepEqual(of(flat, { drawn: [1] }, true), ["channels=1", "window=;0:9", "gamma=;1", "colors=;ffffff"]);
  assert.deepEqual(of(parseVolumeInfo(sampleVolume("fossil", "rgba8")), {}, true), []);
});

test("grey slices of CT begin with soft tissue, and follow what is chosen from then on", () => {
  const ct = parseVolumeInfo(sampleCt("abdomen"));
  const of = (change: ViewChange, volume = ct, isGrey = true): string => colourParts(initialView(volume, [800, 600], change), volume, isGrey)[0] ?? "";
  assert.equal(of({}), "window=-160:240");
  assert.equal(of({ transfers: ["ct-soft-tissue"] }), "window=-200:1000", "the preset was chosen");
  assert.equal(of({ transfers: ["-300:e8c39e:0,900:ffffff:0.8"] }), "window=-300:900");
  assert.match(of({}, ct, false), /^tf=-200\.12:000000:0,-200:e8c39e:0,/, "in colour they have those of the tissues");
  const told = (change: ViewChange, volume = ct, isGrey = true): readonly string[] => {
    const view = initialView(volume, [800, 600], change);
    return ownWindows({ ...view, slices: { ...view.slices, isGrey } }, volume);
  };
  assert.deepEqual(told({}), ["grey −160 to 240 HU"], "which is not what the panel says, and stands on the slice");
  assert.deepEqual(told({ transfers: ["ct-soft-tissue"] }), []);
  assert.deepEqual(told({}, kPlain), []);
  assert.deepEqual(told({}, ct, false), [], "in colour the panel's stands");
  // Where the server found no bone in it, colours are a ramp over what there is; other units have no tissues.
  const described = sampleCt("lung");
  const ramp = parseVolumeInfo({ ...described, default_view: { ...described.default_view, tf: "-900:000000:0,-700:808080:0.06,-300:ffffff:0.4" } });
  assert.equal(of({}, ramp), "window=-900:-300");
  const counts = parseVolumeInfo({ ...described, channels: [{ ...described.channels[0], unit: "1/cm" }] });
  assert.equal(of({}, counts), "window=-200:1000");
});

test("a function that begins in colour stays one that the server takes, however long and however narrow it is", () => {
  const of = (transfer: string): string => colourParts(initialView(kPlain, [800, 600], { transfers: [transfer] }), kPlain, false)[0]?.slice("tf=".length) ?? "";
  const long = Array.from({ length: kMostPoints }, (_, i) => `${i / 4}:ff00${(i % 256).toString(16).padStart(2, "0")}:${i / 2048}`).join(",");
  const narrow = "100000:ff0000:0,100000.01:00ff00:1";
  for (const text of [long, narrow, "-7e20:ff0000:0,-6.99999999e20:00ff00:1"]) {
    const points = parsePoints(of(text));
    assert.ok(points !== null, `ascending, at most ${kMostPoints} points`);
    assert.deepEqual([points[0]?.colour, points[0]?.opacity], ["000000", 0]);
    assert.equal(points.at(-1)?.value, parsePoints(text)?.at(-1)?.value);
  }
});

test("a slab that lies anyhow is no deeper than the volume, whose diagonal is the most that the server takes", () => {
  const space = indexSpaceOf(kPlain);
  const { min, max } = kPlain.worldBox;
  const diagonal = Math.hypot(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
  const thicknessOf = (thickness: number): number => {
    const view = initialView(kPlain, [800, 600], { slices: { ...kNoSlices, thickness } });
    const plane = facingPlane(space, view.camera, [48, 40, 64], thickness);
    return Number(new URLSearchParams(planePicture(kPlain, view, plane, [0, 0], 1, 100, 100).query).get("thickness"));
  };
  assert.equal(thicknessOf(20), 20);
  for (const thickness of [178, 179, 200, 999]) assert.ok(thicknessOf(thickness) <= diagonal && thicknessOf(thickness) > 0.999 * Math.min(thickness, diagonal), `${thickness}`);
});

test("what is lifted to a depth of the slab stays over its place, on a sheared volume and on a plane that lies anyhow", () => {
  const volume = volumeOf({ world_from_index: [[1, 0.3, 0, 5], [0, 1, 0.2, 0], [0, 0, 2.5, 0]] });
  const space = indexSpaceOf(volume);
  const planes = [...orientations(volume).map((orientation) => orthogonalPlane(space, orientation, 12, 4)), facingPlane(space, volume.defaultView.camera, [48, 40, 64], 4)];
  for (const plane of planes) {
    const point = plane.place([7, 9]);
    for (const depth of [-plane.reach, 0, plane.reach]) {
      const [s, t, d] = plane.locate(plane.lift(point, depth));
      assert.ok(Math.abs(s - 7) < 1e-9 && Math.abs(t - 9) < 1e-9 && Math.abs(d - depth) < 1e-9, `${s} ${t} ${d}`);
    }
  }
});

test("a plane that lies anyhow is asked for as it fills its frame, at most 2048 pixels a side", () => {
  const [space, view] = [indexSpaceOf(kPlain), initialView(kPlain, [800, 600], {})];
  const plane = facingPlane(space, { eye: [48, 40, 500], target: [48, 40, 64], up: [0, 1, 0] }, [48, 40, 64], 1);
  const { query, size, pixel } = planePicture(kPlain, view, plane, [10, -5], 0.25, 4096, 1024);
  assert.deepEqual([size, pixel], [[2048, 512], 0.5]);
  assert.equal(query, "centre=58,45,64&right=1,0,0&down=0,-1,0&pixel=0.5&size=2048x512&tf=auto&format=png".replaceAll("-0,", "0,"));
});
