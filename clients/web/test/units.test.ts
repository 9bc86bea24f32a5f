// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { formatIn, valueIn } from "../src/units";

test("a share of a range is a value of its own, however narrow the range and far from 0, and never beyond it", () => {
  for (const range of [[101300, 101350], [0, 1], [-3, 7], [-101350.5, -101350.25], [1e-9, 2e-9], [0, 65535], [1e7, 1e7 + 1]] as const) {
    const values = Array.from({ length: 101 }, (_, i) => valueIn(range, i / 100));
    assert.equal(new Set(values).size, 101, range.join(":"));
    assert.ok(values.every((value, i) => value >= range[0] && value <= range[1] && Math.abs(value - (range[0] + ((range[1] - range[0]) * i) / 100)) <= 2e-3 * (range[1] - range[0])), range.join(":"));
    assert.deepEqual([values[0], values[100]], range);
  }
  assert.equal(valueIn([5, 5], 0.7), 5);
  assert.equal(valueIn([0, 1 / 3], 0.1), 0.03333, "short where that is enough");
  assert.equal(formatIn(101312.35, 50), "101312.4");
});
