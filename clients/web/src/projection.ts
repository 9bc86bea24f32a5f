// SPDX-License-Identifier: Apache-2.0
// Where the world's points are in a picture, and lengths for people.

import { basisOf, worldPerPixel, type Viewport } from "./camera";
import { dot, subtract, type Vec3 } from "./vector";
import type { ViewState } from "./view_state";

export type Pixel = readonly [x: number, y: number];

// Null behind the eye.
export type Projection = (point: Vec3) => Pixel | null;

export function projectionOf({ camera }: ViewState, viewport: Viewport): Projection {
  const { right, up, forward, distance } = basisOf(camera);
  const unit = worldPerPixel(camera, viewport);
  const isOrtho = (viewport.ortho ?? null) !== null;
  return (point) => {
    const offset = subtract(point, camera.eye);
    const depth = dot(offset, forward);
    if (!isOrtho && depth <= 1e-6 * distance) return null;
    const pixels = isOrtho ? 1 / unit : distance / (depth * unit);
    return [viewport.width / 2 + dot(offset, right) * pixels, viewport.height / 2 - dot(offset, up) * pixels];
  };
}

// The longest of 1, 2, 5, 10, ... that is no longer than this.
export function roundLength(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most));
  const factor = [5, 2].find((candidate) => candidate * power <= most) ?? 1;
  return Number((factor * power).toPrecision(1));
}

const kUnits = [["nm", 1e-9], ["um", 1e-6], ["mm", 1e-3], ["m", 1]] as const;

// In the unit in which it is from 1 to 1000, where the volume's is one of length; without a unit the number alone.
export function formatLength(length: number, unit: string | null): string {
  const metres = kUnits.find(([name]) => name === unit)?.[1];
  if (unit === null || metres === undefined) return `${Number(length.toPrecision(3))}${unit === null ? "" : ` ${unit}`}`;
  const [name, size] = [...kUnits].reverse().find(([, candidate]) => length * metres >= 0.9999 * candidate) ?? kUnits[0];
  return `${Number(((length * metres) / size).toPrecision(3))} ${name.replace("um", "µm")}`;
}
