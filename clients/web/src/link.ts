// SPDX-License-Identifier: Apache-2.0
// The same look at two volumes: from the same side where both are a patient's; with the same camera where they lie in one place
// of the world; else with the one that has the same part of what is not empty of the other in sight.

import { sidesOf } from "./axes";
import type { Camera } from "./camera";
import { add, length, scale, subtract, type Vec3 } from "./vector";
import type { Box } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export interface Lens {
  readonly camera: Camera;
  readonly ortho: number | null;
  readonly fovDegrees: number;
}

type Placed = Pick<VolumeInfo, "worldBox" | "contentBox" | "space">;

export function linkedLens({ camera, ortho, fovDegrees }: Lens, from: Placed, to: Placed): Lens {
  const turned = turnOf(from.space, to.space);
  const turnedBox = ({ min, max }: Box): Box => boxOf(turned(min), turned(max));
  const isInPlace = overlap(turnedBox(from.worldBox), to.worldBox);
  const content = turnedBox(from.contentBox);
  const ratio = isInPlace ? 1 : diagonalOf(to.contentBox) / diagonalOf(content);
  const [begin, end] = isInPlace ? [kOrigin, kOrigin] : [middleOf(content), middleOf(to.contentBox)];
  const moved = (point: Vec3): Vec3 => add(end, scale(subtract(turned(point), begin), ratio));
  return { camera: { eye: moved(camera.eye), target: moved(camera.target), up: turned(camera.up) }, ortho: ortho === null ? null : ortho * ratio, fovDegrees };
}

const kOrigin: Vec3 = [0, 0, 0];

// From the axes of one patient's space to those of another, left-posterior-superior to right-anterior-superior; of others none.
function turnOf(from: string | null, to: string | null): (v: Vec3) => Vec3 {
  const [mine, theirs] = [from, to].map((space) => sidesOf(space, [0, 0, 1]).map(({ words }) => words));
  const ways = [0, 1, 2].map((axis) => {
    const at = mine?.indexOf(theirs?.[2 * axis] ?? "") ?? -1;
    return { axis: Math.floor(at / 2), sign: at % 2 === 0 ? 1 : -1 };
  });
  if (ways.some(({ axis }) => axis < 0)) return (v) => v;
  const part = (v: Vec3, way: (typeof ways)[number] | undefined): number => (way === undefined ? 0 : way.sign * (v[way.axis] ?? 0) + 0); // no -0
  return (v) => [part(v, ways[0]), part(v, ways[1]), part(v, ways[2])];
}

function boxOf(a: Vec3, b: Vec3): Box {
  const pick = (choose: (...values: number[]) => number): Vec3 => [choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2])];
  return { min: pick(Math.min), max: pick(Math.max) };
}

const middleOf = ({ min, max }: Box): Vec3 => scale(add(min, max), 0.5);
const diagonalOf = ({ min, max }: Box): number => length(subtract(max, min));

// Of two that only touch, or of which one is a speck in the other, nothing could be compared in place.
const kLeastShare = 0.05; // of the larger one's sides

function overlap(a: Box, b: Box): boolean {
  return [0, 1, 2].every((axis) => {
    const [low, high] = [Math.max(a.min[axis] ?? 0, b.min[axis] ?? 0), Math.min(a.max[axis] ?? 0, b.max[axis] ?? 0)];
    const longest = Math.max((a.max[axis] ?? 0) - (a.min[axis] ?? 0), (b.max[axis] ?? 0) - (b.min[axis] ?? 0));
    return high - low >= kLeastShare * longest;
  });
}
