// SPDX-License-Identifier: Apache-2.0
// Which pictures of slices are asked for, kept and asked for again, with a server that is here.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import type { Problem } from "../src/protocol";
import { kMostBytes, SliceSource } from "../src/slice_source";

const kSide = 1024;
const kPlaces = kMostBytes / (4 * kSide * kSide);
const asked: string[] = [];
const problems: Problem[] = [];
const pauses: number[] = [];
let statusOf: (address: string) => number = () => 200;
let pictures = 0; // that are open

// The browser, as far as a source has to do with it. Pauses are as short as may be.
const browser = globalThis as unknown as Record<string, unknown>;
const before = new Map(["fetch", "createImageBitmap", "window"].map((name) => [name, browser[name]]));
beforeEach(() => {
  browser["window"] = {
    setTimeout: (act: () => void, pause: number) => {
      pauses.push(pause);
      return setTimeout(act, 0);
    },
    clearTimeout,
  };
  browser["fetch"] = (address: string) => {
    asked.push(address);
    const status = statusOf(address);
    return status === 0 ? Promise.reject(new TypeError("away")) : Promise.resolve(new Response("{\"detail\":\"no\"}", { status }));
  };
  browser["createImageBitmap"] = () => Promise.resolve({ width: kSide, height: kSide, close: () => pictures-- });
});
afterEach(() => {
  for (const [name, value] of before) browser[name] = value;
  asked.length = problems.length = pauses.length = 0;
  statusOf = () => 200;
  pictures = 0;
});

const settle = async (): Promise<void> => {
  for (let i = 0; i < 400; i++) await new Promise((resolve) => setTimeout(resolve, 0));
};

// As a pane does: at each picture it takes what it wishes for.
function paneOf(first: readonly string[], ahead: readonly string[] = []): SliceSource & { show(wishes: readonly string[]): void } {
  let wishes = first;
  const draw = (): void => {
    source.wish(wishes, ahead);
    for (const address of wishes) source.get(address);
  };
  const show = (others: readonly string[]): void => {
    wishes = others;
    draw();
  };
  const source = Object.assign(new SliceSource(draw, (problem) => problems.push(problem)), { show });
  draw();
  return source;
}
const names = (count: number, of = "tile"): readonly string[] => Array.from({ length: count }, (_, i) => `${of}${i}`);

test("what is in sight comes once, however many pictures it takes", async () => {
  for (const count of [kPlaces - 3, kPlaces - 2, kPlaces - 1, kPlaces, kPlaces + 1, kPlaces + 5]) {
    const wishes = names(count);
    const source = paneOf(wishes, ["next", "after"]);
    await settle();
    assert.equal(new Set(asked).size, asked.length, `${count} pictures: none is asked for twice`);
    assert.ok(wishes.every((address) => source.get(address) !== null), `${count} pictures are there`);
    assert.equal(asked.length, count + Math.max(0, Math.min(2, kPlaces - count)), "ahead as many as there is room for");
    source.clear();
    asked.length = 0;
  }
});

test("what was in sight earlier gives way, the oldest first", async () => {
  const source = paneOf(names(kPlaces));
  await settle();
  source.show(names(3, "other"));
  await settle();
  assert.deepEqual(names(4).map((address) => source.get(address) !== null), [false, false, false, true]);
  assert.ok(names(3, "other").every((address) => source.get(address) !== null));
});

test("a server that is away or busy is asked again until it answers, after growing pauses, and it is said once", async () => {
  const faults = [0, 429, 500, 502, 503];
  let left = 30;
  statusOf = () => (left-- > 0 ? (faults[left % faults.length] ?? 0) : 200);
  const source = paneOf(["a"]);
  await settle();
  assert.ok(source.get("a") !== null, "it came");
  assert.equal(asked.length, 31);
  assert.deepEqual(problems.map(({ title }) => title), ["A slice does not come"]);
  assert.ok(pauses.every((pause, i) => i === 0 || pause >= (pauses[i - 1] ?? 0)));
  assert.ok((pauses[0] ?? 0) < 1000 && pauses.at(-1) === 5000);
});

test("what is refused is not asked for again, and a view that is too long is said in words", async () => {
  statusOf = (address) => (address === "a" ? 400 : address === "b" ? 414 : 200);
  const source = paneOf(["a", "b", "c"]);
  await settle();
  assert.deepEqual(asked, ["a", "b", "c"]);
  assert.ok(source.get("c") !== null);
  assert.match(problems[0]?.detail ?? "", /^no$/);
  assert.match(problems[1]?.detail ?? "", /too long to be sent.*too many points/);
});
