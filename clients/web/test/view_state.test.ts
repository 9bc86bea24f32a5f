// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { histogramPath, positionOf, valueAt, valueScale } from "../src/histogram_shape";
import { Meter } from "../src/meter";
import { noticeFor } from "../src/notice";
import { qualityOf } from "../src/readout";
import { formatFragment, imageQuery, parseFragment } from "../src/url_state";
import { fitted, initialView, membersOf, pictureSize, withDrawn, withRange } from "../src/view_state";
import { formatIn } from "../src/units";
import { parseVolumeInfo, parseVolumeList } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kVolume = parseVolumeInfo(sampleVolume("fossil", "rgba8"));
const kHistogram = { lo: 10, hi: 250, counts: [0, 3, 900, 40, 0, 1] };
const kView = initialView(kVolume, [800, 600], {});
const kScalar = parseVolumeInfo(sampleVolume("vessels", "u8"));
const kLabels = parseVolumeInfo({ ...sampleVolume("parts", "u8"), channels: sampleVolume("parts", "u8").channels.map((channel) => ({ ...channel, values: "labels" })) });
const kCells = parseVolumeInfo(sampleVolume("cells", "u16", ["a", "b", "c"]));
const kCellsView = initialView(kCells, [800, 600], {});

test("a message says the whole view", () => {
  assert.deepEqual(membersOf(kView, true), {
    size: [800, 600], ...kView.camera, fov: 40, range: kView.ranges[0], mode: "blend", iso: "auto", filter: "nearest", lit: false, extinction: 0.2, background: "000000",
  });
  assert.deepEqual(membersOf({ ...kView, iso: 4 }, true).iso, 4);
});

test("a volume without extinction is sent none, one of colours no transfer function", () => {
  assert.equal("extinction" in membersOf(kView, false), false);
  assert.equal(membersOf({ ...kView, transfers: ["viridis"] }, false).tf, "viridis");
  assert.equal("tf" in membersOf({ ...kView, transfers: ["viridis"] }, true), false);
});

test("the picture is in device pixels, within four million and 8192 a side", () => {
  assert.deepEqual(pictureSize(800, 600, 1), [800, 600]);
  assert.deepEqual(pictureSize(390, 700, 2), [780, 1400]);
  assert.deepEqual(pictureSize(0, 0, 2), [2, 2]);
  for (const [width, height, ratio] of [[1440, 900, 3], [3840, 2160, 2], [20000, 30, 1], [7, 9000, 2]] as const) {
    const [w, h] = pictureSize(width, height, ratio);
    assert.ok(w <= 8192 && h <= 8192 && w * h <= 4 * 1024 * 1024 && w >= 1 && h >= 1, `${w}x${h}`);
    if (w > 100 && h > 100) assert.ok(Math.abs(w / h - width / height) < 0.01, `${w}x${h} keeps its shape`);
  }
});

test("the address gives back the view", () => {
  const view = initialView(kVolume, [800, 600], {
    camera: { eye: [1.25, -2.5, 1e-7], target: [0, 0.5, 100000], up: [0, 1, 0] },
    ranges: [[10.123456789012, 200]], mode: "first-hit", extinction: 0.75, background: "1c232b", iso: -3.25, filter: "linear", lit: true,
  });
  const { volume, overrides, faults } = parseFragment(formatFragment("a b&c", view, true));
  assert.equal(volume, "a b&c");
  assert.deepEqual(faults, []);
  assert.deepEqual(initialView(kVolume, [800, 600], fitted(kVolume, overrides).change), view);
});

test("of several channels ranges go together, and the drawn ones by number", () => {
  const whole = membersOf(kCellsView, false);
  assert.deepEqual(whole.channels, [0, 1, 2]);
  assert.deepEqual(whole.range, [[10, 250], [1010, 1250], [2010, 2250]]);
  assert.equal("tf" in whole, false);
  const ranged = { ...kCellsView, ...withRange(kCellsView, 1, [1020, 1030]) };
  assert.deepEqual(membersOf(ranged, false), { ...whole, range: [[10, 250], [1020, 1030], [2010, 2250]] });
  const without = { ...kCellsView, ...withDrawn(kCellsView, 1, false) };
  assert.deepEqual(membersOf(without, false), { ...whole, channels: [0, 2] });
  assert.deepEqual(withDrawn(without, 1, true), { drawn: [0, 1, 2] });
});

test("the last channel stays, and a surface's value with its channel", () => {
  const surface = { ...kCellsView, iso: 42 };
  assert.deepEqual(withDrawn(surface, 2, false), { drawn: [0, 1] });
  assert.deepEqual(withDrawn(surface, 0, false), { drawn: [1, 2], iso: null });
  assert.deepEqual(withDrawn({ ...surface, drawn: [1] }, 1, false), {});
  assert.deepEqual(withDrawn({ ...surface, drawn: [1] }, 0, true), { drawn: [0, 1], iso: null });
});

test("the address gives back the view of several channels", () => {
  for (const drawn of [[0, 1, 2], [0, 2], [1]]) {
    const camera = { eye: [248, 200, 304], target: [48, 40, 64], up: [0, 1, 0] } as const; // an address has ten digits
    const view = initialView(kCells, [800, 600], { camera, drawn, ranges: [[10.123456789012, 200], [-3, 1e9], [2010, 2250]] });
    const fragment = formatFragment("cells", view, false);
    assert.match(fragment, drawn.length === 3 ? /^((?!channels=).)*$/ : new RegExp(`&channels=${drawn.join(",")}&`));
    const { change, faults } = fitted(kCells, parseFragment(fragment).overrides);
    assert.deepEqual(faults, []);
    assert.deepEqual(initialView(kCells, [800, 600], change), view);
  }
  assert.doesNotMatch(formatFragment("cells", kCellsView, false), /tf=/);
  assert.match(formatFragment("cells", { ...kCellsView, transfers: ["auto", "viridis", "0:000000:0,9:ff0000:1"] }, false), /&tf=auto;viridis;0:000000:0,9:ff0000:1&/);
});

test("what the address leaves out of the channels is their own", () => {
  const change = (fragment: string) => fitted(kCells, parseFragment(fragment).overrides).change;
  assert.deepEqual(change("range=;1020:1030"), { ranges: [[10, 250], [1020, 1030], [2010, 2250]] });
  assert.deepEqual(change("range=20:30"), { ranges: [[20, 30], [1010, 1250], [2010, 2250]] });
  assert.deepEqual(change("range=auto;auto;7:8"), { ranges: [[10, 250], [1010, 1250], [7, 8]] });
  assert.deepEqual(change("channels=2,0"), { drawn: [0, 2] });
  assert.deepEqual(change("channels=all"), { drawn: [0, 1, 2] });
});

test("what the volume has not is named and left out", () => {
  for (const [volume, fragment, field] of [
    [kCells, "range=1:2;1:2;1:2;1:2", "range"], [kVolume, "range=1:2;1:2", "range"], [kCells, "channels=0,3", "channels"],
    [kVolume, "channels=1", "channels"], [kCells, "tf=viridis;grey;grey;grey", "tf"], [kVolume, "tf=viridis", "tf"],
    [kVolume, "eye=48,40,64", "eye"], [kVolume, "eye=48,90,64", "eye"], [kLabels, "filter=linear", "filter"],
  ] as const) {
    const { change, faults } = fitted(volume, parseFragment(fragment).overrides);
    assert.deepEqual(change, {}, fragment);
    assert.ok(faults.length === 1 && faults[0]?.startsWith(`${field}:`), `${fragment}: ${faults.join()}`);
  }
  assert.deepEqual(fitted(kScalar, { transfers: ["viridis"], mode: "mip" }), { change: { transfers: ["viridis"], mode: "mip" }, faults: [] });
});

test("a scalar volume's colours stand in the address", () => {
  const view = initialView(kVolume, [800, 600], { transfers: ["ct-bone"] });
  assert.match(formatFragment("a", view, false), /&tf=ct-bone&/);
  assert.deepEqual(parseFragment("tf=ct-bone&lit=off").overrides, { transfers: ["ct-bone"], lit: false });
  assert.doesNotMatch(formatFragment("a", view, true), /tf=/);
});

test("whatever a view may have stands in the address, and comes back", () => {
  const text = "eye=1,2,3&target=4,5,6&up=0,0,1&ortho=30&tf=10:000000:0,20:ff0000:0.5&clip=0,0,0,9,9,9&planes=1,0,0,-3;0,1,0,2&background=11223344&step=0.25&lod-alpha=0.5&samples=16&level=2";
  const { overrides, faults } = parseFragment(text);
  assert.deepEqual(faults, []);
  const { change } = fitted(kScalar, overrides);
  const view = initialView(kScalar, [800, 600], change);
  const members = membersOf(view, false);
  assert.deepEqual(
    [members.ortho, members.fov, members.tf, members.clip, members.planes, members.background, members["lod-alpha"], members.samples, members.level],
    [30, undefined, "10:000000:0,20:ff0000:0.5", [0, 0, 0, 9, 9, 9], [[1, 0, 0, -3], [0, 1, 0, 2]], "11223344", "0.5", "16", "2"],
  );
  const again = parseFragment(formatFragment("vessels", view, false));
  assert.deepEqual(initialView(kScalar, [800, 600], fitted(kScalar, again.overrides).change), view);
  for (const part of ["&ortho=30&", "&clip=0,0,0,9,9,9&planes=1,0,0,-3;0,1,0,2&", "samples=16"]) assert.ok(imageQuery(view, false).includes(part), part);
});

test("what a view does not name of a camera is the volume's own", () => {
  assert.deepEqual(fitted(kVolume, parseFragment("eye=9,9,300").overrides).change.camera, { ...kVolume.defaultView.camera, eye: [9, 9, 300] });
  const corner = parseVolumeInfo({ ...sampleVolume("fossil", "rgba8"), nonempty_box: [80, 0, 48, 96, 16, 64] });
  assert.deepEqual(initialView(corner, [800, 600], {}).camera.target, [88, 8, 112], "which looks at what is not empty");
  assert.deepEqual(parseFragment("eye=auto&clip=none&iso=auto").overrides, { clip: null, iso: null });
});

test("an empty address asks for nothing", () => {
  assert.deepEqual(parseFragment(""), { volume: null, overrides: {}, faults: [] });
  assert.deepEqual(parseFragment("#volume=x"), { volume: "x", overrides: {}, faults: [] });
});

test("what the address gets wrong is named and left out", () => {
  for (const [fragment, field] of [
    ["eye=1,2", "eye"], ["eye=1,2,x", "eye"], ["range=9:3", "range"],
    ["range=,3", "range"], ["range=NaN:3", "range"], ["range=1:Infinity", "range"], ["range=1:2;x", "range"], ["range=", "range"],
    ["channels=", "channels"], ["channels=0,0", "channels"], ["channels=0,", "channels"], ["channels=-1", "channels"], ["channels=0.5", "channels"], ["mode=xray", "mode"], ["filter=cubic", "filter"], ["lit=1", "lit"], ["tf=jet", "tf"], ["iso=", "iso"],
    ["extinction=-1", "extinction"], ["extinction=", "extinction"], ["background=red", "background"],
    ["ortho=0", "ortho"], ["clip=1,2,3,0,5,6", "clip"], ["clip=1,2", "clip"], ["planes=0,0,0,1", "planes"], ["planes=1,0,0", "planes"],
    ["tf=1:00ff00", "tf"], ["tf=5:000000:0,1:ffffff:1", "tf"], ["tf=", "tf"], ["lod_alpha=0", "lod_alpha"], ["size=5x5", "size"], ["output=depth", "output"],
  ] as const) {
    const { overrides, faults } = parseFragment(fragment);
    assert.equal(faults.length, 1, fragment);
    assert.ok(faults[0]?.startsWith(`${field}:`), `${fragment}: ${faults[0]}`);
    assert.deepEqual(overrides, {}, fragment);
  }
});

test("the image's query has the interface's names", () => {
  const query = imageQuery(kView, true);
  assert.match(query, /^size=800x600&fov=40&eye=196\.\d+,158\.\d+,242\.\d+&target=48,40,64&up=0,1,0&range=10:250&mode=blend&extinction=0.2&background=000000&format=png$/);
});

test("slider positions and values agree, and the ends are exact", () => {
  for (const scale of [valueScale([10, 250], 1), valueScale([-1024, 3071], 1), valueScale([0.001, 0.7312345], 0), valueScale([5, 5], 1)]) {
    assert.equal(valueAt(scale, 0), scale.lo);
    assert.equal(valueAt(scale, 1), scale.hi);
    assert.equal(valueAt(scale, -3), scale.lo);
    for (const position of [0.1, 0.37, 0.5, 0.93]) {
      const error = Math.abs(positionOf(scale, valueAt(scale, position)) - position) * (scale.hi - scale.lo);
      assert.ok(error <= scale.step * 0.51, `${JSON.stringify(scale)} at ${position}`);
    }
  }
  assert.equal(valueAt(valueScale([10, 250], 1), 0.5), 130);
});

test("a value among others has three digits of the distance between them", () => {
  assert.deepEqual([formatIn(0.000244141, 1), formatIn(0.123456, 1), formatIn(1234.5678, 10), formatIn(-1000.25, 4095), formatIn(42, 1)], ["0.000244", "0.123", "1234.57", "-1000", "42"]);
});

test("the histogram stays in its box", () => {
  for (const range of [[10, 250], [100, 120], [10, 10]] as const) {
    const path = histogramPath(kHistogram, valueScale(range, 1), range[0] !== 100);
    for (const number of path.match(/-?[\d.]+/g) ?? []) assert.ok(Number(number) >= 0 && Number(number) <= 1, number);
  }
  const single = histogramPath({ lo: 7, hi: 7, counts: [0, 12, 0] }, valueScale([7, 7], 1), true);
  assert.match(single, /V0H/, "the one value there is stands at full height");
});

test("latency is that of a view's first frame", () => {
  const meter = new Meter();
  meter.viewSent(1, 1000);
  meter.viewSent(2, 1010);
  meter.frameArrived(2, 5000, 1042);
  assert.equal(meter.figures(1050).latencyMs, 32);
  meter.frameArrived(2, 90000, 1900); // its refinement
  assert.deepEqual(meter.figures(1950), { framesPerSecond: 2, bytesPerSecond: 95000, latencyMs: 32 });
  assert.deepEqual(meter.figures(2500), { framesPerSecond: 1, bytesPerSecond: 90000, latencyMs: 32 });
});

test("the badge says how good a picture is", () => {
  const header = { id: 1, seq: 1, width: 1, height: 1, format: "png", level: 0, final: true, complete: true, scale: 1, samples: 1, gpuMs: 1, reasons: [] } as const;
  assert.equal(qualityOf(header, {}), "Full quality");
  assert.equal(qualityOf({ ...header, complete: false }, {}), "Coarse: parts are not in memory")
  assert.equal(qualityOf({ ...header, level: 2 }, { level: "2" }), "Coarse: level 2, as chosen");
  assert.equal(qualityOf({ ...header, complete: false, final: false }, {}), "Loading detail");
  assert.equal(qualityOf({ ...header, final: false, scale: 0.25 }, {}), "Moving");
  assert.equal(qualityOf({ ...header, final: false, samples: 8 }, { samples: "16" }), "Refining 50 %");
});

test("the overlay says where things stand", () => {
  const known = (...items: object[]) => ({ kind: "known", volumes: parseVolumeList({ volumes: items }) }) as const;
  const away = { kind: "unreachable", reason: "No answer" } as const;
  const ready = { id: "a", name: "A", state: "ready" };
  assert.equal(noticeFor({ kind: "unknown" }, null, "none", null)?.title, "Connecting…");
  assert.equal(noticeFor(away, "a", "none", null)?.title, "Connecting…");
  assert.equal(noticeFor(away, "a", "lost", null)?.title, "Reconnecting…");
  assert.equal(noticeFor({ kind: "refused", reason: "no token" }, "a", "lost", null)?.detail, "no token");
  assert.equal(noticeFor(known(ready), "a", "lost", null)?.title, "Reconnecting…");
  assert.equal(noticeFor(known(ready), "a", "live", null), null);
  assert.equal(noticeFor(known(), null, "none", null)?.kind, "empty");
  assert.equal(noticeFor(known({ ...ready, state: "loading" }), "a", "none", null)?.title, "Loading A…");
  assert.equal(noticeFor(known({ ...ready, state: "failed", error: "why" }), "a", "none", null)?.detail, "why");
  assert.equal(noticeFor(known(ready), "b", "none", null)?.kind, "failed");
  const full = { title: "Too Many Requests", detail: "64 streams are open, as many as may be", field: null };
  assert.equal(noticeFor(known(ready), "a", "connecting", full)?.title, "Too Many Requests");
  assert.equal(noticeFor(known(ready), "a", "lost", full)?.detail, "64 streams are open, as many as may be. Trying again…");
  assert.equal(noticeFor(known({ ...ready, state: "failed", error: "why" }), "a", "lost", full)?.detail, "why", "the list knows better");
  assert.equal(noticeFor(known(ready), "a", "live", null), null);
});
