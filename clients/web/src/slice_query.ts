// SPDX-License-Identifier: Apache-2.0
// What a slice view asks the server for: pictures of a slice as a whole, and where one looks closely tiles of what is in sight.

import { contrastOf, type Contrast } from "./contrast";
import { kAxes, withPart, type Axis, type IndexSpace } from "./index_space";
import { pictureAxes, type PlanePoint, type SlicePlane } from "./slice_plane";
import type { SliceState } from "./slice_state";
import { length, scale, subtract, type Vec3 } from "./vector";
import type { ViewState } from "./view_state";
import { formatPoints, isByTissue, isHounsfield, isPreset, kMostPoints, ownPoints, parsePoints, presetPoints } from "./transfer";
import { leastGap, resampled } from "./transfer_edit";
import type { ChannelInfo, Range, VolumeInfo } from "./volume_info";

const kTile = 1024; // pixels a side
const kMostSide = 2048; // of an oblique picture
const kMostTiles = 16;
const kEdge = 1e-4; // of the colours' width, from black to the first of them
const kSoftTissue: Range = [-160, 240]; // Hounsfield units: level 40, width 400, with which radiologists' viewers begin

// A picture with its place: of a slice along an axis from which voxel to which, else in the plane that was asked for.
export interface SlicePicture {
  readonly query: string;
  readonly level: number;
  readonly begin: readonly [column: number, row: number]; // voxels of level 0
}

// How values become colours, as the picture in 3D has it: an item a channel of the volume, of those that are not drawn an
// empty one. Voxels with colours of their own, and labels, stay what they are.
export function colourParts(view: ViewState, volume: VolumeInfo, isGrey: boolean): string[] {
  if (volume.type === "rgba8") return [];
  const drawn = view.drawn.length === volume.channels.length ? [] : [`channels=${view.drawn.join(",")}`];
  const contrasts = volume.channels.map((channel, number) => contrastOf(channel, view.transfers[number] ?? "auto"));
  const items = (text: (number: number) => string): string => volume.channels.map((_, number) => (view.drawn.includes(number) ? text(number) : "")).join(";");
  if (isGrey && view.drawn.every((number) => (contrasts[number] ?? null) !== null)) {
    const of = (text: (contrast: Contrast, number: number) => string): string => items((number) => {
      const contrast = contrasts[number] ?? null;
      return contrast === null ? "" : text(contrast, number);
    });
    const windows = of((contrast, number) => greyWindow(contrast, volume.channels[number], view.transfers[number] ?? "auto").join(":"));
    return [...drawn, `window=${windows}`, `gamma=${of(({ gamma }) => String(gamma))}`, `colors=${of(() => "ffffff")}`];
  }
  return [...drawn, `tf=${items((number) => onBlack(view.transfers[number] ?? "auto", volume.channels[number]))}`];
}

// From black to white. The colours of CT that nobody chose reach into bone, and soft tissue would be a dark fifth of them.
function greyWindow({ window }: Contrast, channel: ChannelInfo | undefined, transfer: string): Range {
  const isUnchosen = transfer === "auto" && channel !== undefined && isHounsfield(channel.unit) && isByTissue("auto", channel);
  return isUnchosen ? kSoftTissue : window;
}

// "grey −160 to 240 HU" of each channel that is drawn in another window than its contrast says.
export function ownWindows(view: ViewState, volume: VolumeInfo): readonly string[] {
  if (!view.slices.isGrey || volume.type === "rgba8") return [];
  return view.drawn.flatMap((number) => {
    const channel = volume.channels[number];
    const transfer = view.transfers[number] ?? "auto";
    const contrast = channel === undefined ? null : contrastOf(channel, transfer);
    if (channel === undefined || contrast === null) return [];
    const window = greyWindow(contrast, channel, transfer);
    return window === contrast.window ? [] : [`grey ${window.join(" to ").replace("-", "−")} ${channel.unit ?? ""}`.trimEnd()];
  });
}

// What has no opacity in 3D below the first point has no colour here: it is black.
function onBlack(transfer: string, channel: ChannelInfo | undefined): string {
  if (channel === undefined || channel.areLabels || ownPoints(channel) === null) return transfer;
  const points = isPreset(transfer) ? presetPoints(transfer, channel) : parsePoints(transfer);
  const [first, last] = [points?.[0], points?.at(-1)];
  if (points === null || first === undefined || last === undefined || !(last.value > first.value) || first.opacity > 0 || first.colour === "000000") return transfer;
  // No two points may have one value, in the text either, and there is room for so many.
  const gap = Math.max(kEdge * (last.value - first.value), leastGap([first.value, last.value]));
  return formatPoints([{ ...first, value: first.value - gap, colour: "000000" }, ...resampled(points, kMostPoints - 1)]);
}

function commonParts(view: ViewState, volume: VolumeInfo): string[] {
  const { time } = view.others;
  return [...(time === undefined ? [] : [`time=${time}`]), ...colourParts(view, volume, view.slices.isGrey), "format=png"];
}

const slabParts = ({ thickness, reduce }: SliceState): string[] => (thickness === 1 ? [] : [`thickness=${thickness}`, `reduce=${reduce}`]);

// The coarsest level whose voxels are no larger than a pixel of this side, world lengths.
export function levelFor(pixel: number, space: IndexSpace, axis: Axis, levels: number): number {
  const [columns, rows] = pictureAxes(axis);
  const fine = Math.min(space.spacing[columns], space.spacing[rows]);
  return Math.max(0, Math.min(levels - 1, Math.floor(Math.log2(pixel / fine) + 1e-6)));
}

// The finest level at which a tile holds the whole slice; the coarsest, where none does.
export function overviewLevel(space: IndexSpace, axis: Axis, levels: number): number {
  const side = Math.max(...pictureAxes(axis).map((along) => space.dims[along]));
  return Math.min(levels - 1, Math.max(0, Math.ceil(Math.log2(side / kTile) - 1e-9)));
}

// Pictures of slice `index`, the most wanted first: the whole, then what is in sight where that has more pixels than it.
export function axisPictures(
  volume: VolumeInfo, space: IndexSpace, view: ViewState, axis: Axis, index: number, pixel: number,
  sight: { readonly min: Vec3; readonly max: Vec3 }, // index space
): readonly SlicePicture[] {
  const wanted = levelFor(pixel, space, axis, volume.levelCount);
  const overview = Math.max(wanted, overviewLevel(space, axis, volume.levelCount));
  const begun = [`axis=${"xyz"[axis]}`, `index=${index}`, ...slabParts(view.slices)];
  const query = (level: number, box: string[]): string => [...begun, `level=${level}`, ...box, ...commonParts(view, volume)].join("&");
  const [columns, rows] = pictureAxes(axis);
  const whole = { query: query(overview, []), level: overview, begin: [0, 0] as const };
  if (wanted >= overview) return [whole];
  const side = kTile * 2 ** wanted;
  const tilesOf = (along: Axis): readonly number[] => {
    const [from, to] = [Math.max(0, Math.floor(sight.min[along] / side)), Math.min(Math.ceil(space.dims[along] / side), Math.ceil(sight.max[along] / side))];
    return Array.from({ length: Math.max(0, to - from) }, (_, i) => from + i);
  };
  const middle = (along: Axis, tile: number): number => Math.abs((tile + 0.5) * side - (sight.min[along] + sight.max[along]) / 2);
  const tiles = tilesOf(rows).flatMap((row) => tilesOf(columns).map((column) => ({ column, row, away: middle(columns, column) + middle(rows, row) })));
  const nearest = [...tiles].sort((a, b) => a.away - b.away).slice(0, kMostTiles);
  return [whole, ...nearest.map(({ column, row }) => {
    const begin = withPart(withPart([0, 0, 0], columns, column * side), rows, row * side);
    const end = kAxes.map((along) => (along === axis ? space.dims[along] : Math.min(space.dims[along], begin[along] + side)));
    return { query: query(wanted, [`box=${[...begin, ...end].join(",")}`]), level: wanted, begin: [column * side, row * side] as const };
  })];
}

// The picture of a plane that fills this frame of it, at most 2048 pixels a side. A slab is no deeper than the volume.
export function planePicture(
  volume: VolumeInfo, view: ViewState, plane: SlicePlane, centre: PlanePoint, unit: number, width: number, height: number,
): { readonly query: string; readonly pixel: number; readonly size: readonly [number, number] } {
  const shrink = Math.max(1, width / kMostSide, height / kMostSide);
  const size = [Math.max(1, Math.round(width / shrink)), Math.max(1, Math.round(height / shrink))] as const;
  const pixel = unit * shrink;
  const vector = (v: Vec3): string => v.map((part) => Number(part.toPrecision(9))).join(",");
  const { thickness, reduce } = view.slices;
  const { min, max } = volume.worldBox;
  const depth = atMost(2 * plane.reach, length(subtract(max, min)));
  const isLinear = view.filter === "linear" && volume.channels.every((channel) => !channel.areLabels);
  const query = [
    `centre=${vector(plane.place(centre))}`, `right=${vector(plane.right)}`, `down=${vector(plane.down)}`, `pixel=${Number(pixel.toPrecision(9))}`, `size=${size.join("x")}`,
    ...(thickness === 1 ? [] : [`thickness=${depth}`, `reduce=${reduce}`]),
    ...(isLinear ? ["filter=linear"] : []), ...commonParts(view, volume),
  ];
  return { query: query.join("&"), pixel, size };
}

// In nine digits, which do not lift it above the bound.
function atMost(value: number, bound: number): number {
  const digits = Number(Math.min(value, bound).toPrecision(9));
  return digits <= bound ? digits : Number((bound * (1 - 1e-9)).toPrecision(9));
}

// How far apart slices of a plane that lies anyhow are, in the world.
export function stepOf(space: IndexSpace): number {
  return Math.min(...space.spacing);
}

export function scrolled(plane: SlicePlane, from: Vec3, steps: number, space: IndexSpace): Vec3 {
  const way = scale(plane.normal, steps * stepOf(space));
  return [from[0] + way[0], from[1] + way[1], from[2] + way[2]];
}
