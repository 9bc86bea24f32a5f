// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { hintFor } from "../src/file_drop";

test("a file has a command that makes it a volume and serves it", () => {
  assert.equal(hintFor("scan.nrrd"), "Where the server runs: blockwalk import scan.nrrd -o scan.bwv, then blockwalkd scan.bwv");
  assert.equal(hintFor("brain.nii.gz"), "Where the server runs: blockwalk import brain.nii.gz -o brain.bwv, then blockwalkd brain.bwv");
  assert.equal(hintFor("my cells.tif"), "Where the server runs: blockwalk import 'my cells.tif' -o 'my cells.bwv', then blockwalkd 'my cells.bwv'");
  assert.equal(hintFor("done.bwv"), "Where the server runs: blockwalkd done.bwv");
  assert.equal(hintFor("-a.bwv"), "Where the server runs: blockwalkd ./-a.bwv");
  for (const name of ["marks.json", "bone.vp", "fire.lut"]) assert.match(hintFor(name), /buttons in the panel/);
});
