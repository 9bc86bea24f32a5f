// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { SentMembers } from "../src/sent_members";

test("a first message has the whole view, a later one only what changed", () => {
  const sent = new SentMembers();
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 2] }), { mode: "mip", range: [1, 2] });
  sent.sent(1, { mode: "mip", range: [1, 2] });
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 2] }), {});
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 3] }), { range: [1, 3] });
  sent.forget();
  assert.deepEqual(sent.missing({ mode: "mip" }), { mode: "mip" });
});

test("of a message that was refused, all but the member to blame is sent again", () => {
  const sent = new SentMembers();
  sent.sent(1, { mode: "blend", range: [1, 9], lit: false });
  sent.sent(2, { mode: "mip", range: [9, 1], lit: true });
  assert.equal(sent.refused(2, "range"), true);
  assert.deepEqual(sent.missing({ mode: "mip", range: [9, 1], lit: true }), { mode: "mip", lit: true });
  assert.deepEqual(sent.missing({ mode: "mip", range: [2, 9], lit: true }), { mode: "mip", range: [2, 9], lit: true });
});

test("what a later message said stands", () => {
  const sent = new SentMembers();
  sent.sent(1, { mode: "mip", range: [9, 1] });
  sent.sent(2, { mode: "iso" });
  assert.equal(sent.refused(1, "range"), false);
  assert.deepEqual(sent.missing({ mode: "iso", range: [9, 1] }), {});
});

test("a member refused alone, or nobody to blame, starts no circle of messages", () => {
  const sent = new SentMembers();
  sent.sent(1, { range: [9, 1] });
  assert.equal(sent.refused(1, "range"), false);
  assert.deepEqual(sent.missing({ range: [9, 1] }), {});
  sent.sent(2, { mode: "mip" });
  assert.equal(sent.refused(2, "eye"), false);
  assert.deepEqual(sent.missing({ mode: "mip" }), { mode: "mip" }, "with the next change");
  assert.equal(sent.refused(2, "mode"), false, "known already");
});

test("what a frame has shown was taken", () => {
  const sent = new SentMembers();
  sent.sent(1, { mode: "mip" });
  sent.sent(2, { lit: true, step: 1 } as never);
  sent.taken(2);
  assert.equal(sent.refused(1, "mode"), false);
  assert.equal(sent.refused(2, "step"), false);
  assert.deepEqual(sent.missing({ mode: "mip", lit: true }), {});
});
