// SPDX-License-Identifier: Apache-2.0
// What the server says of a volume: the line of the list, and the whole description. All values are in data units.

import type { Camera } from "./camera";
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
  readonly valueScale: number;
  readonly densityRange: Range;
  readonly histogram: Histogram;
  readonly nonemptyShare: number;
  readonly defaultRange: Range;
  readonly colour: string | null; // rrggbb, its own transfer function's last point; null where voxels have their colours
}

export interface VolumeInfo {
  readonly id: string;
  readonly name: string;
  readonly type: VoxelType;
  readonly dims: Vec3;
  readonly spacing: Vec3;
  readonly worldBox: { readonly min: Vec3; readonly max: Vec3 };
  readonly channels: readonly ChannelInfo[]; // at least one
  readonly levelCount: number;
  readonly blockCount: number; // level 0
  readonly storedBytes: number;
  readonly denseBytes: number;
  readonly source: string;
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
  const levels = fields.array("levels");
  const finest = new Fields(levels[0], "volume.levels[0]");
  const view = fields.object("default_view");
  return {
    id: fields.string("id"),
    name: fields.string("name"),
    type: oneOf(fields.string("type"), ["rgba8", "u8", "u16", "f32"], "volume.type"),
    dims: fields.vec3("dims"),
    spacing: fields.vec3("spacing"),
    worldBox: { min: [box[0] ?? 0, box[1] ?? 0, box[2] ?? 0], max: [box[3] ?? 0, box[4] ?? 0, box[5] ?? 0] },
    channels: parseChannels(fields.array("channels"), view),
    levelCount: levels.length,
    blockCount: finest.number("blocks"),
    storedBytes: fields.number("stored_bytes"),
    denseBytes: fields.number("dense_bytes"),
    source: fields.has("source") ? fields.string("source") : "",
    defaultView: {
      camera: { eye: view.vec3("eye"), target: view.vec3("target"), up: view.vec3("up") },
      fovDegrees: view.number("fov"),
    },
  };
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
      densityRange: fields.pair("density_range"),
      histogram: { lo: histogram.number("lo"), hi: histogram.number("hi"), counts: histogram.numbers("counts") },
      nonemptyShare: fields.number("nonempty_share"),
      defaultRange: new Fields({ range: ranges[index] }, "volume.default_view").pair("range"),
      colour: isOwn ? null : lastColour(transfer),
    };
  });
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
