// SPDX-License-Identifier: Apache-2.0
// The camera and its moves, all pure: a move takes a camera and returns another.
// Right-handed world; pixels are CSS pixels from the canvas' top left corner, y down.

import { add, cross, dot, length, normalize, rotate, scale, subtract, type Vec3 } from "./vector";

export interface Camera {
  readonly eye: Vec3;
  readonly target: Vec3;
  readonly up: Vec3; // need not be orthogonal to the view, must not be parallel to it
}

export interface Viewport {
  readonly width: number;
  readonly height: number;
  readonly fovDegrees: number; // vertical
}

export interface Basis {
  readonly right: Vec3;
  readonly up: Vec3;
  readonly forward: Vec3;
  readonly distance: number; // eye to target
}

// Precondition: eye differs from target and up is not parallel to the view.
export function basisOf(camera: Camera): Basis {
  const toTarget = subtract(camera.target, camera.eye);
  const forward = normalize(toTarget);
  const right = normalize(cross(forward, camera.up));
  return { right, up: cross(right, forward), forward, distance: length(toTarget) };
}

export function isUsable(camera: Camera): boolean {
  const toTarget = subtract(camera.target, camera.eye);
  const side = length(cross(toTarget, camera.up));
  return Number.isFinite(side) && side > 1e-9 * length(toTarget) * length(camera.up);
}

// Turns the camera about its target. Yaw goes about `axis` (the volume's up) so the horizon stays level; pitch goes about
// the camera's own right. Up is carried along, so passing over a pole neither stops nor flips the picture.
export function orbit(camera: Camera, yaw: number, pitch: number, axis: Vec3): Camera {
  const { right, up } = basisOf(camera);
  const pole = normalize(axis);
  // Upside down the same drag must still pull the picture the same way.
  const sense = dot(up, pole) < 0 ? -1 : 1;
  const turn = (v: Vec3): Vec3 => rotate(rotate(v, right, -pitch), pole, -yaw * sense);
  return {
    eye: add(camera.target, turn(subtract(camera.eye, camera.target))),
    target: camera.target,
    up: normalize(turn(up)),
  };
}

// World length of one pixel in the plane through the target.
export function worldPerPixel(camera: Camera, viewport: Viewport): number {
  const { distance } = basisOf(camera);
  return (2 * distance * Math.tan((viewport.fovDegrees * Math.PI) / 360)) / viewport.height;
}

// Moves the camera so that what lies in the target's plane follows the pointer by (dx, dy) pixels.
export function pan(camera: Camera, dx: number, dy: number, viewport: Viewport): Camera {
  const { right, up } = basisOf(camera);
  const unit = worldPerPixel(camera, viewport);
  const shift = add(scale(right, -dx * unit), scale(up, dy * unit));
  return { eye: add(camera.eye, shift), target: add(camera.target, shift), up };
}

// The point of the target's plane under a pixel.
export function pointUnder(camera: Camera, x: number, y: number, viewport: Viewport): Vec3 {
  const { right, up } = basisOf(camera);
  const unit = worldPerPixel(camera, viewport);
  const across = scale(right, (x - viewport.width / 2) * unit);
  return add(camera.target, add(across, scale(up, (viewport.height / 2 - y) * unit)));
}

// Scales the distance by `factor` and keeps the point of the target's plane under (x, y) where it is on the screen.
// Leaves the camera alone where the distance would leave [nearest, farthest].
export function zoomAt(
  camera: Camera,
  factor: number,
  x: number,
  y: number,
  viewport: Viewport,
  limits: { readonly nearest: number; readonly farthest: number },
): Camera {
  const { distance, up } = basisOf(camera);
  const wanted = distance * factor;
  const outside = wanted < limits.nearest || wanted > limits.farthest;
  const worse = (wanted < distance) === (wanted < limits.nearest);
  if (outside && worse) return camera;
  const fixed = pointUnder(camera, x, y, viewport);
  const towards = (p: Vec3): Vec3 => add(fixed, scale(subtract(p, fixed), factor));
  return { eye: towards(camera.eye), target: towards(camera.target), up };
}

type Extent = readonly [width: number, height: number];

// A camera as good for a picture of shape `to` as this one was for `from`. The field of view is vertical, so a portrait
// picture needs a camera further back, or it would cut off at the sides what a landscape one shows.
export function refitted(camera: Camera, from: Extent, to: Extent): Camera {
  const distanceFor = ([width, height]: Extent): number => Math.max(1, height / width);
  const ratio = distanceFor(to) / distanceFor(from);
  if (ratio === 1) return camera;
  return { ...camera, eye: add(camera.target, scale(subtract(camera.eye, camera.target), ratio)) };
}
