// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { Bookmarks, kMostBookmarks, parseBookmarks, volumeOf, writeBookmarks, type Bookmark } from "../src/bookmarks";

const kPicture = "data:image/jpeg;base64,/9j/4AAQ";
const bookmark = (name: string, volume = "fossil"): Bookmark => ({ name, view: `#volume=${volume}&range=10:20&mode=mip`, picture: kPicture });
const kStored = "blockwalk.bookmarks";
const shelf = (text: string | null = null) => {
  const kept = new Map(text === null ? [] : [[kStored, text]]);
  return { kept, getItem: (name: string) => kept.get(name) ?? null, setItem: (name: string, value: string) => void kept.set(name, value) };
};

test("what is kept is there for the next page, under its name", () => {
  const storage = shelf();
  const bookmarks = new Bookmarks(storage);
  assert.equal(bookmarks.read(), null);
  assert.equal(bookmarks.add([bookmark("a"), bookmark("b", "rock")]), null);
  assert.equal(bookmarks.add([bookmark("a")]), null);
  assert.equal(bookmarks.all.length, 2, "the same one is there once");
  const [first] = bookmarks.all;
  assert.ok(first);
  assert.equal(bookmarks.rename(first, " the claw "), null);
  const next = new Bookmarks(storage);
  assert.equal(next.read(), null);
  assert.deepEqual(next.all, [{ ...bookmark("a"), name: "the claw" }, bookmark("b", "rock")]);
  assert.deepEqual(next.all.map(volumeOf), ["fossil", "rock"]);
  const [again] = next.all;
  assert.ok(again);
  next.remove(again);
  assert.deepEqual(next.all.map(({ name }) => name), ["b"]);
});

test("a file of them comes back as it was", () => {
  const all = [bookmark("a"), { ...bookmark("b"), picture: null }];
  assert.deepEqual(parseBookmarks(writeBookmarks(all)), all);
});

test("a browser that is full, forbids, or kept something broken is told in words", () => {
  const full = new Bookmarks({ getItem: () => null, setItem: () => { throw new DOMException("no room", "QuotaExceededError"); } });
  assert.match(full.add([bookmark("a")]) ?? "", /no more room.*file/);
  assert.equal(full.read(), null);
  assert.equal(full.all.length, 1, "until the page is closed");
  const forbidden = { getItem: () => { throw new DOMException("no", "SecurityError"); }, setItem: () => { throw new DOMException("no", "SecurityError"); } };
  assert.match(new Bookmarks(forbidden).read() ?? "", /keeps nothing/);
  assert.match(new Bookmarks(forbidden).add([bookmark("a")]) ?? "", /until it is closed/);
  assert.match(new Bookmarks(null).add([bookmark("a")]) ?? "", /until it is closed/);
  const most = new Bookmarks(shelf());
  assert.equal(most.add(Array.from({ length: kMostBookmarks }, (_, i) => bookmark(`v${i}`))), null);
  assert.match(most.add([bookmark("one more")]) ?? "", /room for 100 bookmarks, and 100 are kept/);
  assert.equal(most.all.length, kMostBookmarks);
});

test("a broken file is refused by the member", () => {
  const file = (bookmarks: unknown, more: object = {}): string => JSON.stringify({ type: "blockwalk bookmarks", version: 1, bookmarks, ...more });
  const refused = (text: string, reason: RegExp): void => assert.throws(() => parseBookmarks(text), { name: "FormatError", message: reason });
  const whole = file([bookmark("a")]);
  for (const length of [0, 1, 20, whole.length - 1]) refused(whole.slice(0, length), /expected JSON/);
  refused(file([], { type: "recipe" }), /type: expected "blockwalk bookmarks"/);
  refused(file([], { version: 2 }), /version: expected 1/);
  refused(file("a"), /file.bookmarks: expected an array/);
  refused(file([{ name: "a" }]), /bookmarks\[0\].view: expected a string/);
  refused(file([bookmark("a"), { ...bookmark("b"), view: "javascript:alert(1)" }]), /bookmarks\[1\].view: expected an address from #/);
  refused(file([{ ...bookmark("b"), view: "#mode=mip" }]), /bookmarks\[0\].view: expected volume=ID/);
  refused(file([{ ...bookmark("b"), view: "#volume=a&range=9:3" }]), /bookmarks\[0\].view: expected a view; range/);
  refused(file([{ ...bookmark("b"), view: `#volume=${"a".repeat(70000)}` }]), /at most 65536 characters/);
  refused(file([{ ...bookmark("b"), name: "a".repeat(121) }]), /name: expected at most 120/);
  refused(file([{ ...bookmark("b"), picture: "https://elsewhere/x.png" }]), /picture: expected a data: address/);
  refused(file(Array.from({ length: 101 }, () => bookmark("a"))), /at most 100; there are 101/);
});

test("a view that could not be read again is not kept, and says why", () => {
  const storage = shelf();
  const bookmarks = new Bookmarks(storage);
  assert.equal(bookmarks.add([bookmark("a")]), null);
  assert.match(bookmarks.add([{ ...bookmark("long"), view: `#volume=a&tf=${"1:ffffff:1,".repeat(7000)}` }]) ?? "", /^This view cannot be kept.*at most 65536 characters/);
  assert.match(bookmarks.add([{ ...bookmark("odd"), view: "#volume=a&range=9:3" }]) ?? "", /cannot be kept.*range/);
  const next = new Bookmarks(storage);
  assert.equal(next.read(), null);
  assert.deepEqual(next.all.map(({ name }) => name), ["a"]);
});

test("of a broken store what can be read is there, and the whole of it stays aside", () => {
  const broken = JSON.stringify({ type: "blockwalk bookmarks", version: 1, bookmarks: [bookmark("a"), { name: "b" }, bookmark("c"), { name: "d" }] });
  const storage = shelf(broken);
  const bookmarks = new Bookmarks(storage);
  assert.match(bookmarks.read() ?? "", /cannot be read: bookmarks\[1\]\.view: expected a string, and 1 more\. It stays/);
  assert.deepEqual(bookmarks.all.map(({ name }) => name), ["a", "c"]);
  assert.equal(storage.kept.size, 1, "nothing is written yet");
  assert.equal(bookmarks.add([bookmark("e")]), null);
  assert.equal(storage.kept.get(`${kStored}.broken1`), broken);
  assert.equal(new Bookmarks(storage).read(), null);
  // Another one that is broken takes another place.
  storage.kept.set(kStored, "{");
  const again = new Bookmarks(storage);
  assert.match(again.read() ?? "", /cannot be read: file: expected JSON\./);
  assert.equal(again.add([bookmark("f")]), null);
  assert.deepEqual([storage.kept.get(`${kStored}.broken1`), storage.kept.get(`${kStored}.broken2`)], [broken, "{"]);
  assert.deepEqual(parseBookmarks(storage.kept.get(kStored) ?? ""), [bookmark("f")]);
});

test("where there is no room to put it aside a broken store stays as it is", () => {
  const storage = { getItem: (name: string) => (name === kStored ? "{" : null), setItem: () => { throw new DOMException("no room", "QuotaExceededError"); } };
  const bookmarks = new Bookmarks(storage);
  bookmarks.read();
  assert.match(bookmarks.add([bookmark("a")]) ?? "", /no more room/);
  assert.deepEqual(bookmarks.all.map(({ name }) => name), ["a"]);
});
