// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { SentMembers } from "../src/sent_members";

test("a first message has the whole view, a later one only what changed", () => {
  const sent = new SentMembers();
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 2] }), { mode: "mip", range: [1, 2] });
  sent.sent({ mode: "mip", range: [1, 2] });
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 2] }), {});
  assert.deepEqual(sent.missing({ mode: "mip", range: [1, 3] }), { range: [1, 3] });
  sent.forget();
  assert.deepEqual(sent.missing({ mode: "mip" }), { mode: "mip" });
});

test("what is no more in the view is taken back, once", () => {
  const sent = new SentMembers();
  sent.sent({ mode: "mip", samples: "16", clip: [0, 0, 0, 1, 1, 1] });
  assert.deepEqual(sent.missing({ mode: "mip" }), { samples: "1", clip: "none" });
  sent.sent({ samples: "1", clip: "none" });
  assert.deepEqual(sent.missing({ mode: "mip" }), {});
});

test("after a refusal everything is said again, and what may still stand is taken back", () => {
  const sent = new SentMembers();
  sent.sent({ mode: "mip", tf: "viridis", samples: "16" });
  sent.doubt();
  assert.deepEqual(sent.missing({ mode: "mip", tf: "auto" }), { mode: "mip", tf: "auto", samples: "1" });
  sent.sent({ mode: "mip", tf: "auto", samples: "1" });
  assert.deepEqual(sent.missing({ mode: "mip", tf: "auto" }), {});
});

test("a field of view and a height take each other's place", () => {
  const sent = new SentMembers();
  sent.sent({ fov: 40 });
  sent.sent({ ortho: 10 });
  assert.deepEqual(sent.missing({ ortho: 10 }), {});
  assert.deepEqual(sent.missing({ fov: 40 }), { fov: 40 });
});
