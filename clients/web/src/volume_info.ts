// SPDX-License-Identifier: Apache-2.0
// What the server says of a volume: the line of the list, and the whole description. All values are in data units.

import type { Camera } from "./camera";
import { indexSpaceOf, worldBoxOf } from "./index_space";
import { FormatError, Fields } from "./json_fields";
import type { Vec3 } from "./vector";

export type VolumeState = "ready" | "loading" | "failed";
export type VoxelType = "rgba8" | "u8" | "u16" | "f32";
export type Range = readonly [lo: number, hi: number]; // inclusive

// A volume that is loading or failed may have no type and size yet.
export interface VolumeSummary {
  readonly id: string;
  readonly name: string;
  readonly state: VolumeState;
  readonly error: string | null;
  readonly type: string | null;
  readonly dims: Vec3 | null;
  readonly storedBytes: number | null;
  readonly denseBytes: number | null;
}

export interface Histogram {
  readonly lo: number;
  readonly hi: number;
  readonly counts: readonly number[];
}

// Of a volume of one channel too.
export interface ChannelInfo {
  readonly name: string; // never empty
  readonly valueScale: number; // data value = stored value * scale + offset
  readonly valueOffset: number;
  readonly densityRange: Range;
  readonly histogram: Histogram;
  readonly nonemptyShare: number;
  readonly defaultRange: Range;
  readonly colour: string | null; // rrggbb, its own transfer function's last point; null where voxels have their colours
  readonly transfer: string | null; // its own transfer function; null where voxels have their colours
  readonly unit: string | null; // of its values: HU, 1/cm
  readonly window: Range | null; // what the file says to show first
  readonly areLabels: boolean; // its values are names of things, with nothing between them
  readonly labels: ReadonlyMap<number, string>; // names of values, where the volume has them
}

type Row = readonly number[]; // four numbers, the last a shift

export interface VolumeInfo {
  readonly id: string;
  readonly name: string;
  readonly type: VoxelType;
  readonly dims: Vec3;
  readonly spacing: Vec3;
  readonly worldFromIndex: readonly [Row, Row, Row]; // of a voxel's corner
  readonly worldBox: { readonly min: Vec3; readonly max: Vec3 };
  readonly contentBox: { readonly min: Vec3; readonly max: Vec3 }; // world: of what is not empty, or of all of an empty volume
  readonly channels: readonly ChannelInfo[]; // at least one
  readonly levelCount: number;
  readonly blockCount: number; // level 0
  readonly storedBytes: number;
  readonly denseBytes: number;
  readonly source: string;
  readonly steps: number; // in time, at least 1
  readonly timeStep: string | null; // how far apart: "0.5 s"
  readonly lengthUnit: string | null; // of the world: mm, um
  readonly space: string | null; // what the world's axes are: left-posterior-superior
  readonly defaultView: { readonly camera: Camera; readonly fovDegrees: number };
}

export function parseVolumeList(value: unknown): readonly VolumeSummary[] {
  return new Fields(value, "list").array("volumes").map((item, index) => parseSummary(item, `volumes[${index}]`));
}

function parseSummary(value: unknown, path: string): VolumeSummary {
  const fields = new Fields(value, path);
  return {
    id: fields.string("id"),
    name: fields.has("name") ? fields.string("name") : fields.string("id"),
    state: oneOf(fields.string("state"), ["ready", "loading", "failed"], `${path}.state`),
    error: fields.has("error") ? describeError(fields) : null,
    type: fields.has("type") ? fields.string("type") : null,
    dims: fields.has("dims") ? fields.vec3("dims") : null,
    storedBytes: fields.has("stored_bytes") ? fields.number("stored_bytes") : null,
    denseBytes: fields.has("dense_bytes") ? fields.number("dense_bytes") : null,
  };
}

// A reason is a sentence, or a problem document with one in it.
function describeError(fields: Fields): string {
  if (typeof fields.value("error") === "string") return fields.string("error");
  const problem = fields.object("error");
  return problem.has("detail") ? problem.string("detail") : problem.string("title");
}

export function parseVolumeInfo(value: unknown): VolumeInfo {
  const fields = new Fields(value, "volume");
  const box = fields.numbers("world_box", 6);
  const [i0 = 0, j0 = 0, k0 = 0, i1 = 0, j1 = 0, k1 = 0] = fields.numbers("nonempty_box", 6);
  const space = { dims: fields.vec3("dims"), worldFromIndex: parseMatrix(fields.array("world_from_index")) };
  const levels = fields.array("levels");
  const finest = new Fields(levels[0], "volume.levels[0]");
  const view = fields.object("default_view");
  const metadata = fields.has("metadata") ? fields.object("metadata") : null;
  const said = (name: string): string | null => (metadata?.has(name) ? metadata.string(name) : null);
  return {
    id: fields.string("id"),
    name: fields.string("name"),
    type: oneOf(fields.string("type"), ["rgba8", "u8", "u16", "f32"], "volume.type"),
    ...space,
    spacing: fields.vec3("spacing"),
    worldBox: { min: [box[0] ?? 0, box[1] ?? 0, box[2] ?? 0], max: [box[3] ?? 0, box[4] ?? 0, box[5] ?? 0] },
    contentBox: worldBoxOf(indexSpaceOf(space), [i0, j0, k0], [i1, j1, k1]),
    channels: parseChannels(fields.array("channels"), view),
    levelCount: levels.length,
    blockCount: finest.number("blocks"),
    storedBytes: fields.number("stored_bytes"),
    denseBytes: fields.number("dense_bytes"),
    source: fields.has("source") ? fields.string("source") : "",
    steps: fields.has("steps") ? fields.number("steps") : 1,
    timeStep: said("time_step"),
    lengthUnit: said("length_unit"),
    space: said("space"),
    defaultView: {
      camera: { eye: view.vec3("eye"), target: view.vec3("target"), up: view.vec3("up") },
      fovDegrees: view.number("fov"),
    },
  };
}

function parseMatrix(rows: readonly unknown[]): readonly [Row, Row, Row] {
  const row = (number: number): Row => new Fields({ row: rows[number] }, `volume.world_from_index[${number}]`).numbers("row", 4);
  if (rows.length !== 3) throw new FormatError("volume.world_from_index", "3 rows of 4 numbers");
  return [row(0), row(1), row(2)];
}

// Of several channels the default view has arrays of ranges and transfer functions, of one the thing itself.
function parseChannels(entries: readonly unknown[], view: Fields): readonly ChannelInfo[] {
  if (entries.length === 0) throw new FormatError("volume.channels", "at least one channel");
  const each = (name: string): readonly unknown[] => {
    const items = entries.length > 1 ? view.array(name) : [view.value(name)];
    if (items.length !== entries.length) throw new FormatError(`volume.default_view.${name}`, `one of each of ${entries.length} channels`);
    return items;
  };
  const [ranges, transfers] = [each("range"), each("tf")];
  return entries.map((entry, index) => {
    const fields = new Fields(entry, `volume.channels[${index}]`);
    const histogram = fields.object("histogram");
    const transfer = transfers[index];
    const isOwn = entries.length === 1 && (transfer === undefined || transfer === null);
    return {
      name: fields.string("name") || `Channel ${index + 1}`,
      valueScale: fields.number("value_scale"),
      valueOffset: fields.number("value_offset"),
      densityRange: fields.pair("density_range"),
      histogram: { lo: histogram.number("lo"), hi: histogram.number("hi"), counts: histogram.numbers("counts") },
      nonemptyShare: fields.number("nonempty_share"),
      defaultRange: new Fields({ range: ranges[index] }, "volume.default_view").pair("range"),
      colour: isOwn ? null : lastColour(transfer),
      transfer: typeof transfer === "string" ? transfer : null,
      unit: fields.has("unit") ? fields.string("unit") : null,
      window: fields.has("window") ? fields.pair("window") : null,
      areLabels: fields.has("values") && fields.string("values") === "labels",
      labels: parseLabels(fields),
    };
  });
}

function parseLabels(channel: Fields): ReadonlyMap<number, string> {
  if (!channel.has("labels")) return new Map();
  return new Map(channel.array("labels").map((entry, index) => {
    const label = new Fields(entry, `labels[${index}]`);
    return [label.number("value"), label.string("name")] as const;
  }));
}

// The colour of the last point of value:rrggbb:opacity,...
function lastColour(transfer: unknown): string {
  const colour = typeof transfer === "string" ? /(?:^|,)[^:,]+:([0-9a-f]{6}):[^:,]+$/i.exec(transfer)?.[1] : undefined;
  if (colour === undefined) throw new FormatError("volume.default_view.tf", "points value:rrggbb:opacity");
  return colour.toLowerCase();
}

function oneOf<T extends string>(value: string, allowed: readonly T[], path: string): T {
  const found = allowed.find((candidate) => candidate === value);
  if (found === undefined) throw new FormatError(path, `one of ${allowed.join(", ")}`);
  return found;
}
