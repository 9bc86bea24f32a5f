// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { animationBody, bookmarkedViews, ZipCount } from "../src/animation";
import { withMember } from "../src/members";
import { formatFragment } from "../src/url_state";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { StoredZip } from "./mock_animation";
import { sampleVolume } from "./sample_volume";

const kVolume = parseVolumeInfo(sampleVolume("vessels", "u8"));
const kView = { ...initialView(kVolume, [320, 240], { mode: "mip" }), others: { quality: "60", samples: "4" } };

test("a turn is the view, its time and its axis", () => {
  const order = { frames: 50, seconds: 4, format: "zip", way: { kind: "turn", axis: [0, 0, 1] } } as const;
  const body = animationBody(order, kView, false) as Record<string, Record<string, unknown>>;
  assert.deepEqual([body["frames"], body["size"], body["format"], body["turntable"]], [50, [320, 240], "zip", { seconds: 4, axis: [0, 0, 1] }]);
  assert.equal(body["quality"], undefined, "PNG has none");
  assert.equal(body["view"]?.["mode"], "mip");
  assert.equal(body["view"]?.["samples"], "4");
  for (const name of ["size", "quality", "format"]) assert.ok(!(name in (body["view"] ?? {})), `${name} is of the animation`);
  const webp = animationBody({ ...order, format: "webp", way: { kind: "turn", axis: null } }, kView, false) as Record<string, unknown>;
  assert.deepEqual([webp["quality"], webp["turntable"]], [60, { seconds: 4 }]);
});

test("bookmarks of this volume are keys, evenly in time, in the size and quality that are asked for", () => {
  const first = formatFragment("vessels", initialView(kVolume, [10, 10], { camera: { eye: [1, 2, 300], target: [0, 0, 0], up: [0, 1, 0] } }), false);
  const second = formatFragment("vessels", { ...initialView(kVolume, [10, 10], { mode: "iso" }), others: withMember({}, "samples", "16") }, false);
  const bookmarks = [first, "#volume=other", second, "#volume=vessels"].map((view) => ({ name: "a", view, picture: null }));
  const views = bookmarkedViews(bookmarks, kVolume, [320, 240]);
  assert.equal(views.length, 3);
  const order = { frames: 50, seconds: 4, format: "zip", way: { kind: "bookmarks", views } } as const;
  const body = animationBody(order, { ...kView, background: "11223300" }, false) as { keys: { seconds: number; view: Record<string, unknown> }[] };
  assert.deepEqual(body.keys.map(({ seconds }) => seconds), [0, 2, 4]);
  assert.deepEqual(body.keys[0]?.view["eye"], [1, 2, 300]);
  assert.deepEqual(body.keys.map(({ view }) => view["mode"]), ["blend", "iso", "blend"]);
  for (const { view } of body.keys) assert.deepEqual([view["samples"], view["background"]], ["4", "00000000"]);
});

test("frames of a zip are counted as they come, however they are cut", () => {
  const zip = new StoredZip();
  const parts = [5, 0, 70, 1000].map((bytes, i) => zip.entry(`frame${i}.png`, Buffer.alloc(bytes, "PK\x03\x04", "latin1")));
  const whole = Buffer.concat([...parts, zip.end()]);
  for (const step of [1, 7, 29, 31, 64, whole.length]) {
    const count = new ZipCount();
    const seen: number[] = [];
    for (let at = 0; at < whole.length; at += step) {
      count.add(whole.subarray(at, at + step));
      seen.push(count.entries);
    }
    assert.equal(count.entries, 4, `${step} bytes at a time`);
    if (step === 1) assert.equal(seen[(parts[0]?.length ?? 0) - 1], 1, "with its last byte");
  }
});
