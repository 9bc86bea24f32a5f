// SPDX-License-Identifier: Apache-2.0
// How slices lie: which of the volume's axes goes to the right and which down, and where a plane's points are in the world.
//
// A patient is shown as radiologists look: axial from the feet, coronal from the front, the right side on the left; sagittal
// from the left, the front on the left. Everything else lies as its file has it, row 0 on top.

import { basisOf, type Camera } from "./camera";
import { sidesOf, type Side } from "./axes";
import { indexOf, kAxes, withPart, worldOf, type Axis, type IndexSpace } from "./index_space";
import { add, cross, dot, normalize, scale, subtract, type Vec3 } from "./vector";

export type SliceKind = "x" | "y" | "z" | "oblique"; // an axis: slices are one behind the other along it
export const kAxisNames = ["x", "y", "z"] as const;

interface Way {
  readonly axis: Axis; // of the volume
  readonly sign: 1 | -1;
}

export interface Orientation {
  readonly axis: Axis; // across the slices
  readonly title: string; // Axial, or z
  readonly across: Way; // to the right
  readonly down: Way;
}

const kTitles: Readonly<Record<string, string>> = { superior: "Axial", inferior: "Axial", anterior: "Coronal", posterior: "Coronal", right: "Sagittal", left: "Sagittal" };
// What lies on the right and at the bottom of a picture.
const kRadiological: Readonly<Record<string, readonly [right: string, bottom: string]>> = {
  Axial: ["left", "posterior"], Coronal: ["left", "inferior"], Sagittal: ["posterior", "inferior"],
};
const kOrder = ["Axial", "Coronal", "Sagittal", "z", "y", "x"];

// Of the six ways along the volume's axes what lies there: + before - of each axis, no two alike.
export function waysOf(space: IndexSpace, sides: readonly Side[]): readonly Side[] {
  const orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] as const;
  const along = (axis: Axis, world: Axis): number => space.columns[axis][world] / space.spacing[axis];
  const fit = (order: readonly [Axis, Axis, Axis]): number => kAxes.reduce((sum: number, axis) => sum + Math.abs(along(axis, order[axis])), 0);
  const best = orders.reduce((so, order) => (fit(order) > fit(so) + 1e-9 ? order : so));
  return kAxes.flatMap((axis) => [1, -1].flatMap((sign) => {
    const world = best[axis];
    const side = sides[2 * world + (sign * along(axis, world) > 0 ? 0 : 1)];
    return side === undefined ? [] : [side];
  }));
}

// The three of them, in the order in which they stand on the page.
export function orientationsOf(space: IndexSpace, named: string | null, up: Vec3): readonly Orientation[] {
  const ways = waysOf(space, sidesOf(named, up));
  const towards = (word: string): Way | null => {
    const at = ways.findIndex((side) => side.words === word);
    return at < 0 ? null : { axis: Math.floor(at / 2) as Axis, sign: at % 2 === 0 ? 1 : -1 };
  };
  const orientation = (axis: Axis): Orientation => {
    const title = kTitles[ways[2 * axis]?.words ?? ""] ?? kAxisNames[axis];
    const [across, down] = (kRadiological[title] ?? []).map(towards);
    if (across && down) return { axis, title, across, down };
    const [columns, rows] = pictureAxes(axis);
    return { axis, title, across: { axis: columns, sign: 1 }, down: { axis: rows, sign: 1 } };
  };
  return kAxes.map(orientation).sort((a, b) => kOrder.indexOf(a.title) - kOrder.indexOf(b.title));
}

// Of the server's pictures across this axis: what columns and rows are.
export function pictureAxes(axis: Axis): readonly [columns: Axis, rows: Axis] {
  return axis === 0 ? [1, 2] : axis === 1 ? [0, 2] : [0, 1];
}

export type PlanePoint = readonly [across: number, down: number]; // world lengths

// A plane with a place for each of its points, in lengths of the world.
export interface SlicePlane {
  readonly right: Vec3; // unit vectors of the world
  readonly down: Vec3;
  readonly normal: Vec3; // away from who looks at it, or towards: only its line counts
  readonly reach: number; // what is no farther from the plane lies in the slab
  readonly extent: { readonly min: PlanePoint; readonly max: PlanePoint }; // of the volume
  place(point: PlanePoint): Vec3;
  locate(world: Vec3): readonly [across: number, down: number, depth: number]; // depth: from the slab's middle
  lift(world: Vec3, depth: number): Vec3; // over the same place of the plane
}

// Slice `index` of this orientation, of a slab of this many voxels: as the server has it, from index - (thickness - 1) / 2 on.
export function orthogonalPlane(space: IndexSpace, { axis, across, down }: Orientation, index: number, thickness: number): SlicePlane {
  const unit = ({ axis: along, sign }: Way): Vec3 => scale(space.columns[along], sign / space.spacing[along]);
  const end = ({ axis: along, sign }: Way): readonly [number, number] => {
    const far = sign * space.dims[along] * space.spacing[along];
    return [Math.min(0, far), Math.max(0, far)];
  };
  const [ends, rises] = [end(across), end(down)];
  const middle = index - Math.floor((thickness - 1) / 2) + thickness / 2;
  const toIndex = (length: number, { axis: along, sign }: Way): number => (sign * length) / space.spacing[along];
  return {
    right: unit(across),
    down: unit(down),
    normal: normalize(cross(space.columns[across.axis], space.columns[down.axis])),
    reach: (thickness / 2) * space.spacing[axis] * (1 + 1e-6),
    extent: { min: [ends[0], rises[0]], max: [ends[1], rises[1]] },
    place: ([s, t]) => worldOf(space, withPart(withPart([index + 0.5, index + 0.5, index + 0.5], across.axis, toIndex(s, across)), down.axis, toIndex(t, down))),
    locate: (world) => {
      const at = indexOf(space, world);
      const length = ({ axis: along, sign }: Way): number => sign * at[along] * space.spacing[along];
      return [length(across), length(down), (at[axis] - middle) * space.spacing[axis]];
    },
    lift: (world, depth) => worldOf(space, withPart(indexOf(space, world), axis, middle + depth / space.spacing[axis])),
  };
}

// Through a point, facing the camera.
export function facingPlane(space: IndexSpace, camera: Camera, through: Vec3, thickness: number): SlicePlane {
  const { right, up, forward } = basisOf(camera);
  const down = scale(up, -1);
  const locate = (world: Vec3): readonly [number, number, number] => {
    const offset = subtract(world, through);
    return [dot(offset, right), dot(offset, down), dot(offset, forward)];
  };
  const corners = boxCorners(space, [0, 0, 0], space.dims).map(locate);
  const bound = (pick: (...values: number[]) => number, part: 0 | 1): number => pick(...corners.map((corner) => corner[part]));
  return {
    right, down, normal: forward, reach: thickness / 2,
    extent: { min: [bound(Math.min, 0), bound(Math.min, 1)], max: [bound(Math.max, 0), bound(Math.max, 1)] },
    place: ([s, t]) => add(through, add(scale(right, s), scale(down, t))),
    locate,
    lift: (world, depth) => add(world, scale(forward, depth - locate(world)[2])),
  };
}

// Of a box of index space, in the world; corner n has the larger bound of axis a where bit a of n is set.
export function boxCorners(space: IndexSpace, min: Vec3, max: Vec3): readonly Vec3[] {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => worldOf(space, [bits & 1 ? max[0] : min[0], bits & 2 ? max[1] : min[1], bits & 4 ? max[2] : min[2]]));
}

const kEdges = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((corner) => [1, 2, 4].flatMap((bit) => ((corner & bit) === 0 ? [[corner, corner | bit] as const] : [])));
export const boxEdges: readonly (readonly [number, number])[] = kEdges;

// Where the middle of a plane cuts a box of these corners: a convex polygon, in order; empty where it does not.
export function sectionOf(plane: SlicePlane, corners: readonly Vec3[]): readonly Vec3[] {
  const depths = corners.map((corner) => plane.locate(corner)[2]);
  const cuts = kEdges.flatMap(([from, to]) => {
    const [a, b] = [depths[from] ?? 0, depths[to] ?? 0];
    const [begin, end] = [corners[from], corners[to]];
    if (!begin || !end || a < 0 === b < 0) return [];
    return [add(begin, scale(subtract(end, begin), a / (a - b)))];
  });
  if (cuts.length < 3) return [];
  const flat = cuts.map((cut) => plane.locate(cut));
  const [cs, ct] = [0, 1].map((part) => flat.reduce((sum, at) => sum + (at[part] ?? 0), 0) / flat.length) as [number, number];
  const angle = (at: readonly [number, number, number]): number => Math.atan2(at[1] - ct, at[0] - cs);
  return cuts.map((cut, i) => ({ cut, angle: angle(flat[i] ?? [0, 0, 0]) })).sort((a, b) => a.angle - b.angle).map(({ cut }) => cut);
}
