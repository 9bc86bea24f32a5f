// SPDX-License-Identifier: Apache-2.0
// What stands on a slice: its number and place, its slab, and what lies at its edges.

import { sidesOf } from "./axes";
import type { IndexSpace } from "./index_space";
import { formatMeasure, type Ruler } from "./measure";
import { waysOf, type Orientation, type SlicePlane } from "./slice_plane";
import type { SliceState } from "./slice_state";
import { formatIn } from "./units";
import { dot, length, subtract, type Vec3 } from "./vector";
import type { VolumeInfo } from "./volume_info";

interface Shown {
  readonly volume: VolumeInfo;
  readonly space: IndexSpace;
  readonly ruler: Ruler;
  readonly orientation: Orientation | null;
}

export interface EdgeNames {
  readonly left: string;
  readonly right: string;
  readonly top: string;
  readonly bottom: string;
}

// "slice 70 of 0–139 · S 4.5 mm", in short "70 / 139 · S 4.5 mm": of a plane that lies anyhow where the crosshair is.
export function sliceText({ volume, space, orientation }: Shown, index: number, crosshair: Vec3, isShort = false): string {
  const unit = volume.lengthUnit === null ? "" : ` ${volume.lengthUnit.replace("um", "µm")}`;
  const span = length(subtract(volume.worldBox.max, volume.worldBox.min));
  const sides = sidesOf(volume.space, volume.defaultView.camera.up);
  const along = (world: number): string => {
    const at = crosshair[world] ?? 0;
    const plus = sides[2 * world]?.name ?? "";
    const isAxis = /^[+−]/.test(plus);
    const name = isAxis ? plus.slice(1) : (sides[2 * world + (at < 0 ? 1 : 0)]?.name ?? "");
    return `${name} ${formatIn(isAxis ? at : Math.abs(at), span)}`;
  };
  if (orientation === null) return `${[0, 1, 2].map(along).join(", ")}${unit}`;
  const way = waysOf(space, sides)[2 * orientation.axis]?.direction ?? [0, 0, 1];
  const last = volume.dims[orientation.axis] - 1;
  return `${isShort ? `${index} / ${last}` : `slice ${index} of 0–${last}`} · ${along(way.findIndex((part) => part !== 0))}${unit}`;
}

// "slab of 5, max (5 mm)", nothing of a single slice.
export function slabText({ ruler }: Shown, { thickness, reduce }: SliceState, { reach }: SlicePlane): readonly string[] {
  if (thickness === 1) return [];
  const deep = ruler.unit === "voxels" ? "" : ` (${formatMeasure(2 * reach, ruler.unit)})`;
  return [`slab of ${thickness}, ${reduce}${deep}`];
}

// The letters of what lies there; of a plane that lies anyhow of the two or three that lie there most.
export function edgeNames({ volume, space, orientation }: Shown, plane: SlicePlane): EdgeNames {
  const sides = sidesOf(volume.space, volume.defaultView.camera.up);
  if (orientation !== null) {
    const ways = waysOf(space, sides);
    const name = (axis: number, sign: number): string => ways[2 * axis + (sign > 0 ? 0 : 1)]?.name ?? "";
    const { across, down } = orientation;
    return { right: name(across.axis, across.sign), left: name(across.axis, -across.sign), bottom: name(down.axis, down.sign), top: name(down.axis, -down.sign) };
  }
  const kLeast = 0.38; // of the way, to be named
  const towards = (way: Vec3, sign: number): string =>
    sides.map((side) => ({ name: side.name, share: sign * dot(side.direction, way) })).filter(({ share }) => share > kLeast).sort((a, b) => b.share - a.share).map(({ name }) => name).join("");
  return { right: towards(plane.right, 1), left: towards(plane.right, -1), bottom: towards(plane.down, 1), top: towards(plane.down, -1) };
}
