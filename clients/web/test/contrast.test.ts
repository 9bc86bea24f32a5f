// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { autoWindow, contrastOf, quantile, transferOf, withColour, withPreset, type Contrast } from "../src/contrast";
import { fitsPreset, formatPoints, gradientOf, parsePoints } from "../src/transfer";
import { parseVolumeInfo, type ChannelInfo } from "../src/volume_info";
import { sampleCt, sampleVolume } from "./sample_volume";

const kOwn = "20:590000:0,80:8f3c3c:0.06,240:ff0000:0.4";
const kChannel = parseVolumeInfo({ ...sampleVolume("vessels", "u8"), default_view: { ...sampleVolume("vessels", "u8").default_view, tf: kOwn } }).channels[0];
assert.ok(kChannel);
const kCt = parseVolumeInfo(sampleCt("abdomen")).channels[0];
assert.ok(kCt);
const contrast = (text: string, channel: ChannelInfo = kChannel): Contrast => {
  const found = contrastOf(channel, text);
  assert.ok(found, text);
  return found;
};

test("points are read and written, and what is none is refused", () => {
  assert.equal(formatPoints(parsePoints(kOwn) ?? []), kOwn);
  for (const text of ["", "1:ff0000", "2:ff0000:0,1:ff0000:1", "1:ff0000:2", "x:ff0000:1", "1:red:1", ":ff0000:1"]) assert.equal(parsePoints(text), null, text);
});

test("a preset that nothing was done to stays a preset", () => {
  for (const name of ["auto", "grey", "viridis", "cividis", "inferno"]) assert.equal(transferOf(contrast(name), kChannel), name);
  assert.deepEqual(contrast("viridis").window, [20, 240]);
});

test("window, brightness and opacity are read back from the points", () => {
  for (const name of ["auto", "grey", "viridis", "inferno"]) {
    const wanted = { ...contrast(name), window: [30.5, 200] as const, gamma: 1.6, opacity: 0.8 };
    const { window, gamma, opacity, name: known } = contrast(transferOf(wanted, kChannel));
    assert.deepEqual([known, window, gamma, opacity], [name, [30.5, 200], 1.6, 0.8]);
  }
  const grey = contrast(transferOf({ ...contrast("grey"), window: [0, 100] }, kChannel));
  assert.deepEqual([grey.name, grey.window], ["grey", [0, 100]]);
  const bent = contrast(transferOf({ ...contrast("grey"), gamma: 2 }, kChannel));
  assert.equal(transferOf({ ...bent, gamma: 1 }, kChannel), "grey", "and back, though gamma needs points between black and white");
});

test("a colour of one's own goes from dark to full, and is known again", () => {
  const text = transferOf({ ...withColour(contrast("auto"), kChannel, "3366ff"), gamma: 0.5 }, kChannel);
  assert.match(text, /:3366ff:/);
  const { name, gamma, window } = contrast(text);
  assert.deepEqual([name, gamma, window], ["colour", 0.5, [20, 240]]);
});

test("points of any other kind can be stretched too", () => {
  const own = contrast("10:123456:0,50:abcdef:0.3,70:ffffff:1");
  assert.equal(own.name, "own");
  assert.equal(transferOf({ ...own, window: [100, 400] }, kChannel), "100:123456:0,300:abcdef:0.3,400:ffffff:1");
});

test("other colours keep the window, Hounsfield units their own", () => {
  const stretched = { ...contrast("auto"), window: [50, 60] as const };
  assert.deepEqual(withPreset(stretched, kChannel, "viridis").window, [50, 60]);
  assert.deepEqual(withPreset(stretched, kChannel, "ct-bone").window, [130, 1500]);
});

test("of CT, whose own colours are by tissue, every preset is there, and stays one", () => {
  for (const name of ["auto", "grey", "viridis", "cividis", "inferno", "ct-bone", "ct-soft-tissue", "angiography"] as const) {
    const chosen = withPreset(contrast("auto", kCt), kCt, name);
    assert.equal(transferOf(chosen, kCt), name);
    assert.equal(contrast(name, kCt).name, name);
    assert.equal(transferOf(withPreset(chosen, kCt, "auto"), kCt), "auto", `back from ${name}`);
  }
  assert.deepEqual(contrast("auto", kCt).window, [-200, 1000]);
  assert.deepEqual(withPreset(contrast("auto", kCt), kCt, "viridis").window, [-988.28125, 1451.171875], "that of the map");
});

test("of CT window, brightness and opacity are read back, of each colours", () => {
  for (const name of ["auto", "grey", "viridis", "cividis", "inferno"] as const) {
    const wanted = { ...contrast(name, kCt), window: [-150, 250] as const, gamma: 1.6, opacity: 0.3 };
    const text = transferOf(wanted, kCt);
    assert.ok(parsePoints(text), text);
    const { window, gamma, opacity, name: known } = contrast(text, kCt);
    assert.deepEqual([known, window, gamma, opacity], [name, [-150, 250], 1.6, 0.3]);
    // Among maps the window stays; to colours by tissue, and back, it goes.
    const other = withPreset(contrast(text, kCt), kCt, "inferno");
    assert.deepEqual(other.window, name === "auto" ? contrast("inferno", kCt).window : [-150, 250]);
    assert.equal(transferOf(withPreset(contrast(text, kCt), kCt, "auto"), kCt), "auto");
  }
});

test("of CT one colour has the opacities of the tissues, and is known again", () => {
  const text = transferOf({ ...withColour(contrast("auto", kCt), kCt, "3366ff"), gamma: 0.5 }, kCt);
  const { name, gamma, window, opacity } = contrast(text, kCt);
  assert.deepEqual([name, gamma, window, opacity], ["colour", 0.5, [-200, 1000], 0.8]);
  const plain = transferOf({ ...contrast(text, kCt), gamma: 1 }, kCt);
  assert.deepEqual(parsePoints(plain)?.map((point) => point.opacity), parsePoints(kCt.transfer ?? "")?.map((point) => point.opacity));
  assert.equal(plain.endsWith("1000:3366ff:0.8"), true, plain);
  assert.equal(transferOf(withPreset(contrast(text, kCt), kCt, "auto"), kCt), "auto");
});

test("a map whose values are not known goes by its name", () => {
  const flat = { ...kCt, densityRange: [300, 300] as const };
  assert.equal(transferOf(withPreset(contrast("auto", flat), flat, "viridis"), flat), "viridis");
  assert.equal(contrastOf(flat, "viridis"), null);
});

test("the automatic window leaves out the rare ends", () => {
  const histogram = { lo: 0, hi: 100, counts: Array.from({ length: 100 }, () => 10) };
  assert.deepEqual([quantile(histogram, 0), quantile(histogram, 0.5), quantile(histogram, 1)], [0, 50, 100]);
  assert.deepEqual(autoWindow(histogram).map((value) => Math.round(value * 100) / 100), [0.35, 99.8]);
  assert.deepEqual(autoWindow({ lo: 7, hi: 7, counts: [5] }), [7, 7]);
});

test("presets in Hounsfield units are offered where values can be some", () => {
  assert.equal(fitsPreset("ct-bone", [-1000, 3000], null), true);
  assert.equal(fitsPreset("ct-bone", [1, 255], null), false, "a photograph");
  for (const unit of ["HU", "hu", "Hounsfield", "Hounsfield units"]) assert.equal(fitsPreset("ct-bone", [1, 255], unit), true, unit);
  assert.equal(fitsPreset("ct-bone", [-1000, 3000], "1/cm"), false);
  assert.equal(fitsPreset("ct-bone", [-20, 29], "HU"), false, "nothing lies above 130");
  assert.equal(fitsPreset("viridis", [0, 1], null), true);
});

test("a gradient has the colours where their values are", () => {
  assert.equal(gradientOf(parsePoints("10:000000:0,20:ffffff:1") ?? [], [0, 40]), "linear-gradient(90deg, #000000 25.0%, #ffffff 50.0%)");
});

test("labels have no contrast", () => {
  assert.equal(contrastOf({ ...kChannel, areLabels: true }, "auto"), null);
  assert.equal(contrastOf({ ...kChannel, transfer: null }, "auto"), null);
});
