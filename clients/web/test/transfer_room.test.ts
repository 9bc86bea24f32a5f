// SPDX-License-Identifier: Apache-2.0
// Transfer functions of several channels as they fit a request.

import assert from "node:assert/strict";
import { test } from "node:test";
import { pickQuery } from "../src/pick";
import { colourParts } from "../src/slice_query";
import { kMostPoints, parsePoints } from "../src/transfer";
import { sampleAlong } from "../src/label_list";
import { kMostTransferCharacters, roomed } from "../src/transfer_room";
import { formatFragment, imageQuery, parseFragment } from "../src/url_state";
import { initialView, membersOf, type ViewState } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";
import { viewMessage } from "../src/protocol";

const kCells = parseVolumeInfo(sampleVolume("cells", "u16", ["nuclei", "membranes", "", "marker"]));
const kAtlas = { channels: kCells.channels.map((channel) => ({ ...channel, areLabels: true })) };
const long = (count = kMostPoints, phase = 0): string =>
  Array.from({ length: count }, (_, i) => `${(1000.123457 + 2 * i).toFixed(6)}:${(0x111111 + i).toString(16)}:${((1 + Math.sin(i / 99 + phase)) / 2).toFixed(4)}`).join(",");
const viewWith = (...transfers: string[]): ViewState => ({ ...initialView(kCells, [800, 600], {}), transfers });
const kNone = ["auto", "auto", "auto", "auto"];
const kHeader = 32 * 1024; // of a request: of the server's options the default

test("what fits stays as it is", () => {
  const view = viewWith(long(), "auto", "viridis", "inferno");
  assert.deepEqual(roomed(view, kCells, kNone), { view, problem: null });
});

test("functions that are too long together have fewer points, evenly, and it is said", () => {
  const asked = viewWith(long(), long(800, 1), "1:000000:0,2:ffffff:1", long(kMostPoints, 2));
  const { view, problem } = roomed(asked, kCells, kNone);
  assert.ok(view.transfers.join(";").length <= kMostTransferCharacters);
  assert.ok(view.transfers.join(";").length > 0.9 * kMostTransferCharacters, "no fewer than it takes");
  assert.equal(view.transfers[2], asked.transfers[2], "a short one stays");
  const counts = view.transfers.map((text) => parsePoints(text)?.length ?? 0);
  assert.ok(counts[0] === counts[1] && counts[1] === counts[3], counts.join());
  assert.equal(problem?.field, "tf");
  assert.match(problem?.detail ?? "", new RegExp(`take \\d+ characters, and 28672 can be sent: nuclei has ${counts[0]}, membranes has ${counts[0]}, marker has ${counts[0]} points now`));
  // They are what they were, as far as so many points tell.
  const [before, after] = [parsePoints(asked.transfers[0] ?? "") ?? [], parsePoints(view.transfers[0] ?? "") ?? []];
  assert.equal(after[0]?.value, before[0]?.value);
  assert.ok(Math.abs((after.at(-1)?.value ?? 0) - (before.at(-1)?.value ?? 0)) < 1e-5);
  for (let value = 1010; value < 3000; value += 97) assert.ok(Math.abs(sampleAlong(before, value).opacity - sampleAlong(after, value).opacity) < 0.02);
});

test("labels need each of their points: then nothing changes, and it is said", () => {
  const asked = viewWith(long(), long(), "auto", "auto");
  const { view, problem } = roomed(asked, kAtlas, kNone);
  assert.deepEqual(view.transfers, kNone);
  assert.match(problem?.detail ?? "", /labels need each of their points, so nothing is changed/);
});

test("whatever a person chooses fits the requests, and what is not drawn is left out of those for pictures", () => {
  const planes = Array.from({ length: 6 }, () => [0.1234567891, 0.1234567891, 0.1234567891, -1234.567891] as const);
  const { view } = roomed({ ...viewWith(long(), long(), long(), long()), planes, drawn: [0, 1, 2, 3] }, kCells, kNone);
  const queries = (of: ViewState): readonly string[] => [imageQuery(of, false), pickQuery(of, 1, 1, 800, 600, false), colourParts(of, kCells, false).join("&")];
  for (const query of queries(view)) assert.ok(query.length < kHeader - 2048, `${query.length}`);
  assert.ok(viewMessage(1, membersOf(view, false)).length < 65536);
  const some = { ...view, drawn: [1] };
  for (const query of queries(some)) {
    const items = new URLSearchParams(query).get("tf")?.split(";") ?? [];
    assert.deepEqual(items.map((item) => item === "" || item === "auto"), [true, false, true, true]);
  }
  assert.deepEqual(parseFragment(formatFragment("cells", some, false)).overrides.transfers, view.transfers, "the address keeps them");
});
