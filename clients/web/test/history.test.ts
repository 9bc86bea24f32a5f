// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { ViewHistory } from "../src/history";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kHome = initialView(parseVolumeInfo(sampleVolume("vessels", "u8")), [800, 600], {});
const at = (iso: number) => ({ ...kHome, iso });

test("a step goes back and forth, and a change ends the way forth", () => {
  const history = new ViewHistory();
  history.begin(kHome);
  history.changed(at(1), 1000);
  history.changed(at(2), 3000);
  history.changed({ ...at(2), lit: true }, 3001);
  assert.deepEqual(history.step("back"), at(2));
  assert.deepEqual(history.step("back"), at(1));
  assert.deepEqual(history.step("back"), kHome);
  assert.equal(history.step("back"), null);
  assert.deepEqual(history.step("forth"), at(1));
  history.changed(at(7), 3010);
  assert.equal(history.has("forth"), false);
  assert.deepEqual(history.step("back"), at(1));
});

test("what a pointer changes while it is held is one step, however slowly it comes", () => {
  const history = new ViewHistory();
  history.begin(kHome);
  history.press(true);
  for (let i = 0; i < 5; i++) history.changed(at(i), 1000 + 3000 * i);
  history.press(false);
  history.press(true);
  history.changed(at(9), 60000);
  history.press(false);
  history.changed(at(10), 70000);
  assert.deepEqual(history.step("back"), at(9));
  assert.deepEqual(history.step("back"), at(4));
  assert.deepEqual(history.step("back"), kHome);
  assert.equal(history.step("back"), null);
});

test("what is added or taken away is a step, however soon", () => {
  const history = new ViewHistory();
  const points = (...values: number[]) => ({ ...kHome, transfers: [values.map((value) => `${value}:ffffff:1`).join()] });
  history.begin(points(1, 9));
  history.changed(points(1, 5, 9), 1000);
  history.changed(points(1, 6, 9), 1010);
  history.changed(points(1, 7, 9), 1020);
  history.changed(points(1, 9), 1030);
  assert.deepEqual(history.step("back"), points(1, 7, 9));
  assert.deepEqual(history.step("back"), points(1, 5, 9));
  assert.deepEqual(history.step("back"), points(1, 9));
});

test("changes that follow each other closely are one step, and the window's size is none", () => {
  const history = new ViewHistory();
  history.begin(kHome);
  for (let i = 0; i < 50; i++) history.changed(at(i), 1000 + 100 * i);
  assert.deepEqual(history.step("back"), kHome);
  assert.equal(history.has("back"), false);
  history.changed({ ...kHome, size: [1, 1] }, 99999);
  assert.equal(history.has("back"), false);
});

test("a scroll is one step, however long a hand rests in it, until something else is done", () => {
  const history = new ViewHistory();
  const crosshair = (x: number): typeof kHome => ({ ...kHome, slices: { ...kHome.slices, crosshair: [x, 1, 1] } });
  history.begin(kHome);
  for (let i = 0; i < 9; i++) history.changed(crosshair(i), 1000 + 1200 * i, "scroll z");
  history.changed(crosshair(20), 10700, "scroll x");
  history.changed({ ...crosshair(20), lit: true }, 10800);
  history.changed({ ...crosshair(21), lit: true }, 10900, "scroll x");
  history.changed({ ...crosshair(22), lit: true }, 20900, "scroll x");
  assert.deepEqual(history.step("back"), { ...crosshair(21), lit: true }, "ten seconds later it is another");
  assert.deepEqual(history.step("back"), { ...crosshair(20), lit: true });
  assert.deepEqual(history.step("back"), crosshair(20));
  assert.deepEqual(history.step("back"), crosshair(8));
  assert.deepEqual(history.step("back"), kHome);
  assert.equal(history.step("back"), null);
});

test("the first place of the crosshair, and the first of a cut, belong to what follows", () => {
  const history = new ViewHistory();
  history.begin(kHome);
  history.press(true);
  for (let i = 0; i < 3; i++) history.changed({ ...kHome, clip: { min: [i, 0, 0], max: [9, 9, 9] } }, 1000 + 100 * i);
  history.press(false);
  assert.deepEqual(history.step("back"), kHome);
});

test("a view that is refused is nothing to go back to, however late the refusal comes", () => {
  const points = (...values: number[]) => ({ ...at(1), transfers: [values.map((value) => `${value}:ffffff:1`).join()] });
  const history = new ViewHistory();
  history.begin(kHome);
  history.changed(at(1), 1000);
  history.changed(points(1, 2, 3), 3000);
  history.refused([points(1, 2, 3)], at(1)); // of which the server knows nothing else
  assert.equal(history.has("forth"), false);
  assert.deepEqual(history.step("back"), kHome);
  assert.deepEqual(history.step("forth"), at(1));
  assert.equal(history.has("forth"), false);
  // What was changed since stays, without the refused member; the step to it leads from what was there before.
  history.changed(points(4, 5), 10000);
  history.changed({ ...points(4, 5), lit: true }, 12000);
  history.refused([points(4, 5)], { ...at(1), lit: true });
  assert.deepEqual(history.step("back"), at(1));
  assert.deepEqual(history.step("back"), kHome);
  assert.equal(history.step("back"), null);
});

test("a view that is refused when one goes back to it is left out, and what lies before it is reached", () => {
  const history = new ViewHistory();
  history.begin(kHome);
  history.changed(at(1), 1000);
  history.changed(at(2), 3000);
  history.changed(at(3), 5000);
  assert.deepEqual(history.step("back"), at(2));
  history.refused([at(2)], at(3));
  assert.equal(history.has("forth"), false, "that is shown");
  assert.deepEqual(history.step("back"), at(1));
  assert.deepEqual(history.step("back"), kHome);
});
