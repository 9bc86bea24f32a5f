// SPDX-License-Identifier: Apache-2.0
// The views of volumes that were open before, as a page that is loaded again finds them.

import assert from "node:assert/strict";
import { test } from "node:test";
import { kMostViewCharacters, kMostViews, KeptViews, type TabStorage } from "../src/kept_views";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kView = initialView(parseVolumeInfo(sampleVolume("vessels", "u8")), [800, 600], {});

function storage(text: string | null = null): TabStorage & { text: string | null } {
  return {
    text,
    getItem() { return this.text; },
    setItem(_, value) { this.text = value; },
  };
}

test("a view is there as it was, and as an address for the next page", () => {
  const tab = storage();
  const kept = new KeptViews(tab);
  kept.keep("a", kView, "#volume=a&iso=1");
  kept.keep("b", kView, "#volume=b");
  kept.keep("a", { ...kView, iso: 2 }, "#volume=a&iso=2");
  assert.deepEqual([kept.viewOf("a")?.iso, kept.viewOf("c")], [2, null]);
  const next = new KeptViews(tab);
  assert.deepEqual([next.viewOf("a"), next.addressOf("a"), next.addressOf("b"), next.addressOf("c")], [null, "#volume=a&iso=2", "#volume=b", null]);
});

test("they have a bound in number and in characters, and the oldest go", () => {
  const tab = storage();
  const kept = new KeptViews(tab);
  for (let i = 0; i < kMostViews + 3; i++) kept.keep(`v${i}`, kView, `#volume=v${i}`);
  assert.deepEqual([kept.addressOf("v2"), kept.addressOf("v3")], [null, "#volume=v3"]);
  kept.keep("long", kView, "x".repeat(kMostViewCharacters / 2));
  assert.ok(kept.addressOf(`v${kMostViews}`) !== null);
  kept.keep("longer", kView, "x".repeat(kMostViewCharacters / 2));
  assert.deepEqual([kept.addressOf("long"), kept.addressOf(`v${kMostViews}`), kept.addressOf("longer")?.length], [null, null, kMostViewCharacters / 2]);
  kept.keep("endless", kView, "x".repeat(kMostViewCharacters));
  assert.equal(kept.addressOf("endless"), null, "what has no room by itself is not kept");
  assert.equal(kept.viewOf("endless"), kView, "but while the page is open");
  assert.ok((tab.text ?? "").length <= kMostViewCharacters);
});

test("what is broken is left out, and a browser that keeps nothing is none the worse", () => {
  for (const text of ["", "{", "7", "null", '{"a":"#volume=a"}']) assert.equal(new KeptViews(storage(text)).addressOf("a"), null, text);
  assert.equal(new KeptViews(storage('[["a",1],["a"],null,["a","#volume=a"]]')).addressOf("a"), "#volume=a");
  const refusing: TabStorage = {
    getItem() { throw new DOMException("no", "SecurityError"); },
    setItem() { throw new DOMException("no", "QuotaExceededError"); },
  };
  for (const kept of [new KeptViews(refusing), new KeptViews(null)]) {
    kept.keep("a", kView, "#volume=a");
    assert.deepEqual([kept.viewOf("a"), kept.addressOf("a")], [kView, null]);
  }
});
