// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { AcceptedViews } from "../src/accepted_views";
import { initialView } from "../src/view_state";
import { parseVolumeInfo } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kOwn = initialView(parseVolumeInfo(sampleVolume("vessels", "u8")), [800, 600], {});
const kMip = { ...kOwn, mode: "mip" } as const;
const kBone = { ...kMip, transfers: ["ct-bone"] };

test("the member to blame is as it was taken last, the others stay", () => {
  const views = new AcceptedViews();
  views.sent(1, kOwn);
  views.taken(1);
  views.sent(2, kBone);
  assert.deepEqual(views.refused(2, "tf", kBone, kOwn), kMip);
});

test("before anything was taken it is as the volume's own view has it", () => {
  const views = new AcceptedViews();
  const asked = { ...kBone, others: { level: "99", samples: "4" } };
  views.sent(1, asked);
  const without = views.refused(1, "tf", asked, kOwn);
  assert.deepEqual(without, { ...asked, transfers: ["auto"] });
  assert.ok(without);
  views.sent(2, without);
  assert.deepEqual(views.refused(2, "level", without, kOwn), { ...kMip, others: { samples: "4" } });
});

test("with nobody to blame the whole view is as it was taken last, but for the window's size", () => {
  const views = new AcceptedViews();
  views.sent(1, kOwn);
  views.taken(1);
  const wider = { ...kBone, size: [900, 600] } as const;
  views.sent(2, wider);
  assert.deepEqual(views.refused(2, null, wider, kOwn), { ...kOwn, size: [900, 600] });
});

test("refusals of what was sent before the way back was taken change nothing, and there is no circle", () => {
  const views = new AcceptedViews();
  views.sent(1, kOwn);
  views.taken(1);
  views.sent(2, kBone);
  views.sent(3, { ...kBone, lit: true });
  assert.deepEqual(views.refused(2, "tf", { ...kBone, lit: true }, kOwn), { ...kMip, lit: true });
  assert.equal(views.refused(3, "tf", { ...kMip, lit: true }, kOwn), null);
  views.taken(3);
  assert.deepEqual(views.current, kOwn, "what stood on a refused view is none that was taken");
  views.sent(4, kOwn);
  assert.equal(views.refused(4, "size", kOwn, kOwn), null, "nothing is left to go back to");
});
