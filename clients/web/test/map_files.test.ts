// SPDX-License-Identifier: Apache-2.0
// Files of colour maps: each kind, and each way in which one can be broken.

import assert from "node:assert/strict";
import { test } from "node:test";
import { fittedMap, kMostFileBytes, parseMapFile, writeMapJson } from "../src/map_files";
import { formatPoints, kMostPoints, parsePoints } from "../src/transfer";

const kNow = parsePoints("0:000000:0,100:ffffff:0.5") ?? [];
const bytesOf = (text: string): Uint8Array => new TextEncoder().encode(text);
const fitted = (bytes: Uint8Array): string => formatPoints(fittedMap(parseMapFile(bytes), kNow, [0, 100]).points);
const refused = (bytes: Uint8Array, reason: RegExp): void => assert.throws(() => parseMapFile(bytes), { name: "FormatError", message: reason });

const changed = (lines: readonly string[], index: number, line: string): readonly string[] => lines.map((own, i) => (i === index ? line : own));
const kSlicer = ["1", "1", "0.9", "0.1", "0.2", "10", "6 -1000 0 0 0.25 500 1", "4 0 1 255 1", "8 -1000 0 0 0 500 1 0.5 0"];

test("a file of our own comes back as it was", () => {
  const text = "-3.5:102030:0,7:ff8800:0.25,8.25:ffffff:1";
  assert.equal(fitted(bytesOf(writeMapJson(parsePoints(text) ?? []))), text);
});

test("a file of our own that is broken is refused by the member", () => {
  const file = (points: unknown, version = 1): Uint8Array => bytesOf(JSON.stringify({ type: "blockwalk transfer function", version, points }));
  const point = { value: 1, color: "ff0000", opacity: 0.5 };
  refused(file([]), /points: expected 1 to 4096; there are 0/);
  refused(file([point], 2), /version: expected 1/);
  refused(file([{ ...point, opacity: 1.5 }]), /points\[0\].opacity: expected 0 to 1/);
  refused(file([point, { ...point, value: "2" }]), /points\[1\].value: expected a finite number/);
  refused(file([{ ...point, color: "red" }]), /points\[0\].color: expected rrggbb/);
  refused(file(Array.from({ length: 4097 }, () => point)), /there are 4097/);
  refused(bytesOf('{"type": "something else"}'), /type: expected "blockwalk transfer function"/);
  refused(bytesOf('{"type": "blockwalk transf'), /file: expected JSON/);
  refused(bytesOf('{"type": "blockwalk transfer function", "version": 1, "points": [{"value": NaN}]}'), /expected JSON/);
  assert.throws(() => fittedMap(parseMapFile(file([{ ...point, value: 5 }, point])), kNow, [0, 100]), /points: expected values that ascend/);
});

test("volume properties of 3D Slicer have opacity and colour in values of the data", () => {
  assert.equal(fitted(bytesOf(kSlicer.join("\n"))), "-1000:000000:0,0:aa5500:0.25,500:ff8000:1");
  assert.equal(fitted(bytesOf(kSlicer.join("\r\n\r\n"))), "-1000:000000:0,0:aa5500:0.25,500:ff8000:1", "other line ends");
  const step = changed(kSlicer, 6, "8 -1000 0 0 0 0 1 500 1");
  const points = fittedMap(parseMapFile(bytesOf(step.join("\n"))), kNow, [0, 100]).points;
  assert.deepEqual(points.map(({ opacity }) => opacity), [0, 0, 1, 1], "a step is two points");
  assert.ok((points[2]?.value ?? 0) > (points[1]?.value ?? 0), "one above the other, as the server wants them");
  const gradient = parseMapFile(bytesOf(changed(kSlicer, 7, "4 0 0 255 1").join("\n")));
  assert.match(gradient.notes.join(), /Opacity by gradient is left out/);
});

test("volume properties that are broken are refused by the line", () => {
  for (let lines = 1; lines < kSlicer.length; lines++) refused(bytesOf(kSlicer.slice(0, lines).join("\n")), /no such line/);
  refused(bytesOf(changed(kSlicer, 6, "6 -1000 0 0 0.25 500").join("\n")), /scalar opacity: expected 6 numbers; the line has 5/);
  refused(bytesOf(changed(kSlicer, 6, "5 -1000 0 0 0.25 500").join("\n")), /scalar opacity: expected 2 numbers a point/);
  refused(bytesOf(changed(kSlicer, 6, "6 -1000 0 0 nan 500 1").join("\n")), /scalar opacity, number 4: expected a finite number/);
  refused(bytesOf(changed(kSlicer, 8, "8 -1000 0 0 0 500 1 2 0").join("\n")), /colour, point 2: expected 0 to 1/);
  refused(bytesOf(changed(kSlicer, 6, "4 500 0 -1000 1").join("\n")), /scalar opacity, point 2: expected a value not below/);
  refused(bytesOf(changed(kSlicer, 2, "shiny").join("\n")), /diffuse: expected a number, the file has "shiny"/);
  refused(bytesOf(changed(kSlicer, 6, `10000 ${Array.from({ length: 10000 }, (_, i) => (i % 2 === 0 ? i : 0)).join(" ")}`).join("\n")), /at most 4096 points/);
});

test("maps of ParaView are stretched over the window, and keep the opacity there is unless they have their own", () => {
  const map = { Name: "fire", ColorSpace: "RGB", RGBPoints: [-1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 1, 1] };
  assert.equal(fitted(bytesOf(JSON.stringify([map]))), "0:000000:0,50:ff0000:0.25,100:ffffff:0.5");
  assert.equal(fitted(bytesOf(JSON.stringify(map))), "0:000000:0,50:ff0000:0.25,100:ffffff:0.5");
  const opaque = { ...map, Points: [-1, 0, 0.5, 0, 0.5, 0.8, 0.5, 0, 1, 1, 0.5, 0] };
  assert.equal(fitted(bytesOf(JSON.stringify([opaque]))), "0:000000:0,50:ff0000:0.5333,75:ff8080:0.8,100:ffffff:1");
  const notes = parseMapFile(bytesOf(JSON.stringify([{ ...map, ColorSpace: "Lab" }, map]))).notes.join(" ");
  assert.match(notes, /Of its 2 maps this is the first, fire.*not in Lab/);
  refused(bytesOf("[]"), /the array is empty/);
  refused(bytesOf("[3]"), /\[0\]: expected an object/);
  refused(bytesOf(JSON.stringify([{ IndexedColors: [1, 0, 0] }])), /RGBPoints: expected value, r, g, b/);
  refused(bytesOf(JSON.stringify([{ RGBPoints: [0, 1, 1] }])), /RGBPoints: expected 4 numbers a point; there are 3/);
  refused(bytesOf(JSON.stringify([{ RGBPoints: [0, 1, 1, 2] }])), /RGBPoints, point 1: expected 0 to 1/);
  refused(bytesOf(JSON.stringify([{ RGBPoints: [0, 1, 1, null] }])), /RGBPoints: expected finite numbers/);
  refused(bytesOf(JSON.stringify([map]).slice(0, -9)), /file: expected JSON/);
});

const table = (i: number, part: number): number => (part === 0 ? i : part === 1 ? 255 - i : 7);
const raw = Uint8Array.from({ length: 768 }, (_, at) => table(at % 256, Math.floor(at / 256)));
const header = (count: number): Uint8Array => {
  const bytes = new Uint8Array(32);
  bytes.set(bytesOf("ICOL"));
  new DataView(bytes.buffer).setUint16(6, count);
  return bytes;
};
const joined = (...parts: readonly Uint8Array[]): Uint8Array => Uint8Array.from(parts.flatMap((part) => [...part]));

test("tables of Fiji are read as bytes, with and without a header, and as text", () => {
  const points = fittedMap(parseMapFile(raw), kNow, [0, 100]).points;
  assert.deepEqual([points.length, points[0], points.at(-1)], [256, { value: 0, colour: "00ff07", opacity: 0 }, { value: 100, colour: "ff0007", opacity: 0.5 }]);
  assert.equal(fitted(joined(header(256), raw)), formatPoints(points));
  assert.equal(fitted(joined(raw, new Uint8Array(202))), formatPoints(points), "what NIH Image wrote without its header");
  assert.equal(fitted(joined(header(2), Uint8Array.of(0, 255, 0, 255, 0, 255))), "0:000000:0,100:ffffff:0.5");
  const rows = Array.from({ length: 256 }, (_, i) => [i, table(i, 0), table(i, 1), table(i, 2)]);
  assert.equal(fitted(bytesOf(rows.map((row) => row.join("\t")).join("\n"))), formatPoints(points));
  assert.equal(fitted(bytesOf(`Index,Red,Green,Blue\n${rows.map((row) => row.join(",")).join("\n")}`)), formatPoints(points));
  assert.equal(fitted(bytesOf(rows.map((row) => row.slice(1).join(" ")).join("\n"))), formatPoints(points));
  const short = rows.slice(0, 99).map((row) => row.join(" "));
  refused(bytesOf(short.join("\n")), /lines: expected 256 of 4 numbers; there are 99/);
  const broken = changed(rows.map((row) => row.join(" ")), 9, "9 9 NaN 9");
  refused(bytesOf(broken.join("\n")), /line 10: expected 4 numbers, colours from 0 to 255; it is "9 9 NaN 9"/);
});

test("tables of Fiji that end early, and what is no map at all, are refused", () => {
  const whole = joined(header(256), raw);
  for (const length of [4, 8, 31]) refused(whole.slice(0, length), /header: expected 32 bytes/);
  refused(whole.slice(0, 700), /colours: expected 768 bytes after the header; the file ends after 668/);
  refused(joined(header(0), raw), /header, colours: expected 2 to 256, it says 0/);
  refused(joined(header(999), raw), /it says 999/);
  refused(raw.slice(0, 767), /neither text nor 768 bytes/);
  refused(new Uint8Array(0), /it is empty/);
  refused(bytesOf("Dear reader"), /line 1: expected a number: it is "Dear reader"/);
  refused(new Uint8Array(kMostFileBytes + 1), /at most 1048576 bytes, it has 1048577/);
});

test("more points than the server takes are fewer, and it is said", () => {
  const points = Array.from({ length: 3000 }, (_, i) => ({ value: i, color: "ffffff", opacity: i / 2999 }));
  const { points: fewer, notes } = fittedMap(parseMapFile(bytesOf(JSON.stringify({ type: "blockwalk transfer function", version: 1, points }))), kNow, [0, 100]);
  assert.deepEqual([fewer.length, fewer[0]?.value, fewer.at(-1)?.value], [kMostPoints, 0, 2999]);
  assert.ok(fewer.every(({ value, opacity }) => Math.abs(opacity - value / 2999) < 1e-9));
  assert.match(notes.join(), /Of its 3000 points 1024 are left/);
});
