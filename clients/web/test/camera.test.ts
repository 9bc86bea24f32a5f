// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { atDistance, basisOf, centredOn, distanceFor, framed, heightAt, isUsable, lookAlong, orbit, pan, pointUnder, refitted, seesBox, zoomAt, type Camera, type Viewport } from "../src/camera";
import { add, cross, dot, length, normalize, scale, subtract, type Vec3 } from "../src/vector";

const kUp: Vec3 = [0, 1, 0];
const kFront: Camera = { eye: [0, 0, 5], target: [0, 0, 0], up: kUp };
const kOblique: Camera = { eye: [3, 2.4, 3.6], target: [0.5, -0.25, 1], up: kUp };
const kViewport: Viewport = { width: 800, height: 600, fovDegrees: 40 };
const kLimits = { nearest: 1e-3, farthest: 1e3 };

function assertNear(actual: Vec3, expected: Vec3, tolerance = 1e-9): void {
  assert.ok(length(subtract(actual, expected)) <= tolerance, `${actual.join(",")} is not near ${expected.join(",")}`);
}

// Where a world point appears, in pixels from the top left corner.
function project(camera: Camera, viewport: Viewport, point: Vec3): readonly [number, number] {
  const { right, up, forward } = basisOf(camera);
  const offset = subtract(point, camera.eye);
  const focal = viewport.height / 2 / Math.tan((viewport.fovDegrees * Math.PI) / 360);
  const depth = dot(offset, forward);
  return [viewport.width / 2 + (focal * dot(offset, right)) / depth, viewport.height / 2 - (focal * dot(offset, up)) / depth];
}

test("the basis is orthonormal and right-handed", () => {
  const { right, up, forward, distance } = basisOf(kOblique);
  for (const axis of [right, up, forward]) assert.ok(Math.abs(length(axis) - 1) < 1e-12);
  assertNear(cross(right, up), scale(forward, -1));
  assert.ok(Math.abs(distance - length(subtract(kOblique.target, kOblique.eye))) < 1e-12);
  assertNear(basisOf(kFront).right, [1, 0, 0]);
});

test("orbit keeps target and distance", () => {
  let camera = kOblique;
  for (let i = 0; i < 500; i++) camera = orbit(camera, 0.31, 0.17, kUp);
  assert.deepEqual(camera.target, kOblique.target);
  assert.ok(Math.abs(basisOf(camera).distance - basisOf(kOblique).distance) < 1e-9);
  assert.ok(isUsable(camera));
});

test("dragging right brings the camera to the left, dragging down brings it up", () => {
  assert.ok(orbit(kFront, 0.1, 0, kUp).eye[0] < 0);
  assert.ok(orbit(kFront, 0, 0.1, kUp).eye[1] > 0);
});

test("orbit keeps the horizon level", () => {
  let camera = kOblique;
  for (let i = 0; i < 40; i++) camera = orbit(camera, 0.2, i % 2 === 0 ? 0.05 : -0.04, kUp);
  assert.ok(Math.abs(dot(basisOf(camera).right, kUp)) < 1e-9);
});

test("orbit goes over the pole in even steps, and back the same way", () => {
  let camera = kFront;
  const kStep = Math.PI / 16;
  for (let i = 0; i < 32; i++) {
    const before = basisOf(camera);
    camera = orbit(camera, 0, kStep, kUp);
    assert.ok(isUsable(camera), `step ${i}`);
    assert.ok(Math.abs(dot(before.up, basisOf(camera).up) - Math.cos(kStep)) < 1e-9, `step ${i}`);
    assertNear(basisOf(camera).right, before.right);
  }
  assertNear(camera.eye, kFront.eye, 1e-9);
});

test("upside down a drag to the right still moves the near side to the right", () => {
  const over = orbit(kFront, 0, Math.PI * 0.75, kUp);
  assert.ok(basisOf(over).up[1] < 0);
  // a point on the near side, seen before and after
  const near = add(over.target, scale(normalize(subtract(over.eye, over.target)), 1));
  assert.ok(project(orbit(over, -0.05, 0, kUp), kViewport, near)[0] < project(over, kViewport, near)[0]);
  assert.ok(project(orbit(over, 0.05, 0, kUp), kViewport, near)[0] > project(over, kViewport, near)[0]);
});

test("pan moves the target's plane with the pointer", () => {
  const moved = pan(kOblique, 37, -12, kViewport);
  const [x, y] = project(moved, kViewport, kOblique.target);
  assert.ok(Math.abs(x - (400 + 37)) < 1e-6 && Math.abs(y - (300 - 12)) < 1e-6, `${x}, ${y}`);
  assertNear(subtract(moved.eye, moved.target), subtract(kOblique.eye, kOblique.target));
});

test("the point under a pixel projects to that pixel", () => {
  const [x, y] = project(kOblique, kViewport, pointUnder(kOblique, 123, 456, kViewport));
  assert.ok(Math.abs(x - 123) < 1e-6 && Math.abs(y - 456) < 1e-6, `${x}, ${y}`);
});

test("zoom keeps what is under the pointer there, and scales the distance", () => {
  const fixed = pointUnder(kOblique, 650, 90, kViewport);
  const closer = zoomAt(kOblique, 0.5, 650, 90, kViewport, kLimits);
  const [x, y] = project(closer, kViewport, fixed);
  assert.ok(Math.abs(x - 650) < 1e-6 && Math.abs(y - 90) < 1e-6, `${x}, ${y}`);
  assert.ok(Math.abs(basisOf(closer).distance - basisOf(kOblique).distance / 2) < 1e-9);
});

test("zoom stops at the limits but comes back from beyond them", () => {
  const limits = { nearest: 4, farthest: 6 };
  assert.equal(zoomAt(kFront, 0.5, 0, 0, kViewport, limits), kFront);
  assert.equal(zoomAt(kFront, 2, 0, 0, kViewport, limits), kFront);
  const far: Camera = { ...kFront, eye: [0, 0, 20] };
  assert.notEqual(zoomAt(far, 0.5, 0, 0, kViewport, limits), far);
  assert.equal(zoomAt(far, 1.5, 0, 0, kViewport, limits), far);
});

test("a portrait picture draws the camera back, a landscape one does not", () => {
  assert.deepEqual(refitted(kFront, [1, 1], [1440, 900]), kFront);
  assertNear(refitted(kFront, [1440, 900], [400, 800]).eye, [0, 0, 10]);
  assertNear(refitted(refitted(kOblique, [1440, 900], [400, 800]), [400, 800], [1440, 900]).eye, kOblique.eye);
});

// tests/view/resolved_view_test.cpp has the same numbers: the server frames as the page does.
test("a box is framed as the server frames it", () => {
  const box = { min: [80, 0, 96], max: [96, 16, 128] } as const;
  const from = [1, 0.8, 1.2] as const;
  assert.deepEqual(framed(box, from, kUp, 40, [800, 600]).target, [88, 8, 112]);
  assertNear(framed(box, from, kUp, 40, [800, 600]).eye, [119.540049369987, 33.2320394959896, 149.848059243984]);
  assertNear(framed(box, from, kUp, 40, [400, 800]).eye, [147.3091654216424, 55.44733233731392, 183.1709985059709]);
});

test("a camera without a direction is not usable", () => {
  assert.equal(isUsable({ eye: [1, 2, 3], target: [1, 2, 3], up: kUp }), false);
  assert.equal(isUsable({ eye: [0, 5, 0], target: [0, 0, 0], up: kUp }), false);
  assert.equal(isUsable({ eye: [0, 5, 0], target: [0, 0, 0], up: [0, 0, 0] }), false);
  assert.equal(isUsable(kOblique), true);
});

test("a point becomes the middle of the picture, seen from the same direction", () => {
  const point: Vec3 = [1, 0.5, 1.5];
  const centred = centredOn(kOblique, point);
  assert.deepEqual(centred.target, point);
  assertNear(basisOf(centred).forward, basisOf(kOblique).forward);
  assert.ok(Math.abs(dot(subtract(point, kOblique.eye), basisOf(kOblique).forward) - basisOf(centred).distance) < 1e-9, "as far away as it was");
});

test("a line of sight meets the box or passes by it, in perspective and parallel", () => {
  const box = { min: [-1, -1, -1], max: [1, 1, 1] } as const;
  for (const viewport of [kViewport, { ...kViewport, ortho: 4 }]) {
    assert.equal(seesBox(kFront, 400, 300, viewport, box), true);
    assert.equal(seesBox(kFront, 5, 5, viewport, box), false);
  }
  assert.equal(seesBox({ ...kFront, target: [0, 0, 9] }, 400, 300, kViewport, box), false, "it lies behind");
});

test("an orthographic picture of a height shows what one in perspective shows at its target", () => {
  const height = heightAt(5, 40);
  assert.ok(Math.abs(distanceFor(height, 40) - 5) < 1e-12);
  assertNear(pointUnder(kFront, 12, 34, { ...kViewport, ortho: height }), pointUnder(kFront, 12, 34, kViewport));
  assertNear(atDistance(kFront, 8).eye, [0, 0, 8]);
  assertNear(lookAlong(kFront, [-2, 0, 0], kUp).eye, [5, 0, 0]);
});
