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
  readonly ortho?: number | null; // world height of an orthographic picture
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

// But for digits that an address leaves out.
export function isClose(a: Camera, b: Camera): boolean {
  const least = 1e-6 * basisOf(a).distance;
  return length(subtract(a.eye, b.eye)) < least && length(subtract(a.target, b.target)) < least && length(subtract(a.up, b.up)) < 1e-6;
}

// World length of one pixel in the plane through the target.
export function worldPerPixel(camera: Camera, viewport: Viewport): number {
  return (viewport.ortho ?? heightAt(basisOf(camera).distance, viewport.fovDegrees)) / viewport.height;
}

// World height of what a picture in perspective shows at this distance, and the distance at which it shows that.
export function heightAt(distance: number, fovDegrees: number): number {
  return 2 * distance * Math.tan((fovDegrees * Math.PI) / 360);
}

export function distanceFor(height: number, fovDegrees: number): number {
  return height / (2 * Math.tan((fovDegrees * Math.PI) / 360));
}

// The same direction and target from this distance.
export function atDistance(camera: Camera, distance: number): Camera {
  return { ...camera, eye: subtract(camera.target, scale(basisOf(camera).forward, distance)) };
}

// Looks along `forward` at the same target from the same distance.
export function lookAlong(camera: Camera, forward: Vec3, up: Vec3): Camera {
  return { eye: subtract(camera.target, scale(normalize(forward), basisOf(camera).distance)), target: camera.target, up };
}

// Moves the camera sideways until this point is in the middle, and turns about it from then on.
export function centredOn(camera: Camera, point: Vec3): Camera {
  const { forward, distance } = basisOf(camera);
  const depth = dot(subtract(point, camera.eye), forward);
  const away = depth > 1e-6 * distance ? depth : distance;
  return { eye: subtract(point, scale(forward, away)), target: point, up: camera.up };
}

// Whether the line of sight through a pixel meets a box (Kay and Kajiya 1986).
export function seesBox(camera: Camera, x: number, y: number, viewport: Viewport, box: { readonly min: Vec3; readonly max: Vec3 }): boolean {
  const { forward } = basisOf(camera);
  const through = pointUnder(camera, x, y, viewport);
  const isOrtho = (viewport.ortho ?? null) !== null;
  const way = isOrtho ? forward : subtract(through, camera.eye);
  const origin = isOrtho ? through : camera.eye;
  let [near, far] = [isOrtho ? -Infinity : 0, Infinity];
  for (const axis of [0, 1, 2] as const) {
    if (way[axis] === 0) {
      if (origin[axis] < box.min[axis] || origin[axis] > box.max[axis]) return false;
      continue;
    }
    const [a, b] = [(box.min[axis] - origin[axis]) / way[axis], (box.max[axis] - origin[axis]) / way[axis]];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far;
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

// As near along `from` as the box still fits a picture of this shape, with a small margin: what the server frames where no
// eye is given (view/resolved_view.cpp).
export function framed(box: { readonly min: Vec3; readonly max: Vec3 }, from: Vec3, up: Vec3, fovDegrees: number, [width, height]: Extent): Camera {
  const target = scale(add(box.min, box.max), 0.5);
  const forward = scale(normalize(from), -1);
  const right = normalize(cross(forward, up));
  const imageUp = cross(right, forward);
  const slopeY = Math.tan((fovDegrees * Math.PI) / 360);
  const slopeX = (slopeY * width) / height;
  let distance = 0;
  for (let corner = 0; corner < 8; ++corner) {
    const side = (axis: 0 | 1 | 2): number => ((corner >> axis) & 1 ? box.max[axis] : box.min[axis]);
    const offset = subtract([side(0), side(1), side(2)], target);
    const depth = dot(offset, forward);
    distance = Math.max(distance, Math.abs(dot(offset, right)) / slopeX - depth, Math.abs(dot(offset, imageUp)) / slopeY - depth);
  }
  return { eye: subtract(target, scale(forward, 1.04 * distance)), target, up };
}

type Extent = readonly [width: number, height: number];

// How much farther away, or higher where it is orthographic.
export function refit(from: Extent, to: Extent): number {
  const distance = ([width, height]: Extent): number => Math.max(1, height / width);
  return distance(to) / distance(from);
}

// A camera as good for a picture of shape `to` as this one was for `from`. The field of view is vertical, so a portrait
// picture needs a camera further back, or it would cut off at the sides what a landscape one shows.
export function refitted(camera: Camera, from: Extent, to: Extent): Camera {
  const ratio = refit(from, to);
  if (ratio === 1) return camera;
  return { ...camera, eye: add(camera.target, scale(subtract(camera.eye, camera.target), ratio)) };
}
