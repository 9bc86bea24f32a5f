// SPDX-License-Identifier: Apache-2.0
// The view as text: the address' fragment, and the query of an image. Names and forms are the interface's:
// volume=fossil&eye=1,2,3&target=0,0,0&up=0,1,0&range=10:200&mode=blend&extinction=0.2&background=000000
// Of several channels there is a range each, range=10:200;5:90, and channels=0,2 where not all are drawn.
// What is as a new view has it may be left out.

import { isOtherMember, otherMembers, textOfMembers, type OtherMember } from "./members";
import { formatMarks, kMarkForm, kMostMarkCharacters, parseMarks } from "./marks";
import { kFilters, kModes, kPresets } from "./protocol";
import { kLayouts, kSlabForm, parseSlab, sliceParts } from "./slice_state";
import { isPreset, parsePoints } from "./transfer";
import type { Vec3 } from "./vector";
import type { Range } from "./volume_info";
import type { Box, Plane, ViewOverrides, ViewState } from "./view_state";

export interface AddressState {
  readonly volume: string | null;
  readonly overrides: ViewOverrides;
  readonly faults: readonly string[]; // what could not be understood, for people
}

// What a query may say that a page cannot draw otherwise.
const kPageOwn: Readonly<Record<string, string>> = {
  size: "the page draws at the size of its window",
  format: "the page chooses it",
  output: "the page shows colours; other outputs are pictures of their own",
};
const kKnown = ["volume", "eye", "target", "up", "fov", "ortho", "channels", "range", "mode", "iso", "filter", "lit", "tf", "extinction", "clip", "planes", "background"];
const kPageMembers = ["slices", "crosshair", "slab", "slice-colors", "marks", "beside"]; // which no interface but the page has
export const kMostPlanes = 6;

export function formatFragment(volume: string, view: ViewState, isColoured: boolean): string {
  const isUsual = view.ortho === null && view.fovDegrees === kFov;
  const parts = [`volume=${encodeURIComponent(volume)}`, ...(isUsual ? [] : [lens(view)]), ...viewParts(view, isColoured), ...pageParts(view)];
  return `#${joined(parts)}`;
}

// Whether an address has room for the marks.
export function fitMarks(view: ViewState): boolean {
  return formatMarks(view.marks).length <= kMostMarkCharacters;
}

// Marks that are too long are left out; the page says so beside its list of them.
function pageParts(view: ViewState): string[] {
  return [
    ...sliceParts(view.slices, vector),
    ...(view.marks.length > 0 && fitMarks(view) ? [`marks=${formatMarks(view.marks).replaceAll("%", "%25")}`] : []),
    ...(view.beside === null ? [] : [`beside=${encodeURIComponent(view.beside)}`]),
  ];
}

// The query of GET /volumes/{id}/image that gives this picture.
export function imageQuery(view: ViewState, isColoured: boolean): string {
  return joined([`size=${view.size[0]}x${view.size[1]}`, lens(view), ...viewParts({ ...view, transfers: drawnTransfers(view) }, isColoured), "format=png"]);
}

// Nobody asks what is not drawn looks like, and a request has room for so much.
const drawnTransfers = ({ transfers, drawn }: ViewState): readonly string[] => transfers.map((text, number) => (drawn.includes(number) ? text : "auto"));

const vector = (v: readonly number[]): string => v.map(compact).join(",");
const kFov = 40; // the interface's default

function lens(view: ViewState): string {
  return view.ortho === null ? `fov=${compact(view.fovDegrees)}` : `ortho=${compact(view.ortho)}`;
}

function viewParts(view: ViewState, isColoured: boolean): string[] {
  const { clip } = view;
  const others = textOfMembers(view.others);
  return [
    `eye=${vector(view.camera.eye)}`,
    `target=${vector(view.camera.target)}`,
    `up=${vector(view.camera.up)}`,
    ...(view.drawn.length === view.ranges.length ? [] : [`channels=${view.drawn.join(",")}`]),
    // Every digit: a rounded bound could leave out the very voxels it names.
    `range=${view.ranges.map(([lo, hi]) => `${lo}:${hi}`).join(";")}`,
    `mode=${view.mode}`,
    ...(view.iso === null ? [] : [`iso=${view.iso}`]),
    ...(view.filter === "nearest" ? [] : [`filter=${view.filter}`]),
    ...(view.lit ? ["lit=on"] : []),
    ...(isColoured || view.transfers.every((text) => text === "auto") ? [] : [`tf=${view.transfers.join(";")}`]),
    ...(isColoured ? [`extinction=${compact(view.extinction)}`] : []),
    ...(clip === null ? [] : [`clip=${vector([...clip.min, ...clip.max])}`]),
    ...(view.planes.length === 0 ? [] : [`planes=${view.planes.map(vector).join(";")}`]),
    `background=${view.background}`,
    ...otherMembers.flatMap((name) => (others[name] === undefined ? [] : [`${name}=${encodeURIComponent(others[name])}`])),
  ];
}

export function parseFragment(fragment: string): AddressState {
  const parameters = new URLSearchParams(fragment.replace(/^#/, ""));
  const faults: string[] = [];
  const read = <T>(name: string, parse: (text: string) => T | null, expected: string): T | null => {
    const text = parameters.get(name);
    if (text === null) return null;
    const value = parse(text);
    if (value === null) faults.push(`${name}: expected ${expected}, the address has "${text}"`);
    return value;
  };
  const choice = <T extends string>(name: string, known: readonly T[]): T | null =>
    read(name, (text) => known.find((value) => value === text) ?? null, known.join(", "));
  const point = (name: string): Vec3 | "auto" | null => read(name, (text) => (text === "auto" ? "auto" : parseVec3(text)), "three numbers x,y,z");
  const camera = Object.fromEntries((["eye", "target", "up"] as const).flatMap((name) => {
    const value = point(name);
    return value === null || value === "auto" ? [] : [[name, value]];
  }));
  const drawn = read("channels", parseChannels, "numbers of channels from 0, each once, or all");
  const ranges = read("range", parseRanges, "two numbers lo:hi, lo not above hi, of several channels separated by ;");
  const mode = choice("mode", kModes);
  const filter = choice("filter", kFilters);
  const lit = choice("lit", ["on", "off", "true", "false"]);
  const transfers = read("tf", parseTransfers, `points value:rrggbb:opacity,... with ascending values, or ${kPresets.join(", ")}`);
  const iso = read("iso", (text) => (text === "auto" ? "auto" : parseNumber(text)), "a number");
  const extinction = read("extinction", parsePositive, "a number above 0");
  const fovDegrees = read("fov", parsePositive, "degrees below 180");
  const ortho = read("ortho", parsePositive, "a height above 0");
  const clip = read("clip", (text) => (text === "none" ? "none" : parseBox(text)), "a box x0,y0,z0,x1,y1,z1, or none");
  const planes = read("planes", parsePlanes, `1 to ${kMostPlanes} planes nx,ny,nz,d;..., or none`);
  const background = read("background", parseColour, "a colour rrggbb or rrggbbaa");
  const layout = choice("slices", kLayouts);
  const crosshair = read("crosshair", parseVec3, "three numbers x,y,z");
  const slab = read("slab", parseSlab, kSlabForm);
  const sliceColours = choice("slice-colors", ["view", "grey"]);
  const marks = read("marks", parseMarks, kMarkForm);
  const beside = parameters.get("beside");
  const slices = { ...(layout && { layout }), ...(crosshair && { crosshair }), ...slab, ...(sliceColours && { isGrey: sliceColours === "grey" }) };
  const others: { [name in OtherMember]?: string } = {};
  for (const name of new Set(parameters.keys())) {
    if (parameters.getAll(name).length > 1) faults.push(`${name}: is given twice`);
    if (isOtherMember(name)) others[name] = parameters.get(name) ?? "";
    else if (kPageOwn[name] !== undefined && !(name === "output" && parameters.get(name) === "color")) faults.push(`${name}: ${kPageOwn[name]}`);
    else if (!kKnown.includes(name) && !kPageMembers.includes(name)) faults.push(`${name}: is no member of a view`);
  }
  return {
    volume: parameters.get("volume"),
    overrides: {
      ...(Object.keys(camera).length > 0 && { camera }),
      ...(fovDegrees && { fovDegrees, ortho: null }),
      ...(ortho && { ortho }),
      ...(drawn && { drawn }),
      ...(ranges && { ranges }),
      ...(mode && { mode }),
      ...(iso !== null && { iso: iso === "auto" ? null : iso }),
      ...(filter && { filter }),
      ...(lit && { lit: lit === "on" || lit === "true" }),
      ...(transfers && { transfers }),
      ...(extinction && { extinction }),
      ...(clip && { clip: clip === "none" ? null : clip }),
      ...(planes && { planes }),
      ...(background && { background }),
      ...(Object.keys(slices).length > 0 && { slices }),
      ...(marks && { marks }),
      ...(beside !== null && { beside: beside === "" ? null : beside }),
      ...(Object.keys(others).length > 0 && { others }),
    },
    faults,
  };
}

// Ten digits: places far from the origin stay apart, and people can still paste the address.
function compact(value: number): string {
  return String(Number(value.toPrecision(10)));
}

// In a query + is a space: of 1e+21.
function joined(parts: readonly string[]): string {
  return parts.join("&").replaceAll("+", "%2B");
}

function parseNumbers(text: string, separator: string, count: number): readonly number[] | null {
  const parts = text.split(separator);
  const values = parts.map(Number);
  const valid = parts.length === count && parts.every((part) => part.trim() !== "") && values.every(Number.isFinite);
  return valid ? values : null;
}

function parseVec3(text: string): Vec3 | null {
  const [x, y, z] = parseNumbers(text, ",", 3) ?? [];
  return x === undefined || y === undefined || z === undefined ? null : [x, y, z];
}

// An item that is empty among several, or auto, is the channel's own range.
function parseRanges(text: string): readonly (Range | null)[] | null {
  const items = text.split(";").map((item) => item.trim());
  const ranges = items.map((item) => (item === "auto" || (item === "" && items.length > 1) ? null : parseRange(item) ?? undefined));
  return ranges.every((range) => range !== undefined) ? ranges : null;
}

function parseChannels(text: string): readonly number[] | "all" | null {
  if (text === "all") return "all";
  const items = text.split(",").map((item) => item.trim());
  const numbers = [...new Set(items.map(Number))].sort((a, b) => a - b);
  return items.every((item) => /^\d{1,2}$/.test(item)) && numbers.length === items.length ? numbers : null;
}

// An item that is empty is auto, as in a range.
function parseTransfers(text: string): readonly string[] | null {
  const items = text.split(";").map((item) => item.trim() || "auto");
  return text !== "" && items.every((item) => isPreset(item) || parsePoints(item) !== null) ? items : null;
}

function parseBox(text: string): Box | null {
  const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = parseNumbers(text, ",", 6) ?? [NaN];
  return x0 <= x1 && y0 <= y1 && z0 <= z1 ? { min: [x0, y0, z0], max: [x1, y1, z1] } : null;
}

function parsePlanes(text: string): readonly Plane[] | null {
  if (text === "none") return [];
  const items = text.split(";").map((item) => parseNumbers(item, ",", 4));
  if (items.length > kMostPlanes || items.some((item) => item === null || !(Math.hypot(item[0] ?? 0, item[1] ?? 0, item[2] ?? 0) > 0))) return null;
  return items.map((item) => [item?.[0] ?? 0, item?.[1] ?? 0, item?.[2] ?? 0, item?.[3] ?? 0]);
}

function parseRange(text: string): Range | null {
  const [lo, hi] = parseNumbers(text, ":", 2) ?? [];
  return lo === undefined || hi === undefined || lo > hi ? null : [lo, hi];
}

function parseNumber(text: string): number | null {
  return parseNumbers(text, ",", 1)?.[0] ?? null;
}

function parsePositive(text: string): number | null {
  const value = parseNumber(text);
  return value !== null && value > 0 ? value : null;
}

function parseColour(text: string): string | null {
  return /^[0-9a-f]{6}([0-9a-f]{2})?$/i.test(text) ? text.toLowerCase() : null;
}
