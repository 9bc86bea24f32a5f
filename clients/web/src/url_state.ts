// SPDX-License-Identifier: Apache-2.0
// The view as text: the address' fragment, and the query of an image. Names and forms are the interface's:
// volume=fossil&eye=1,2,3&target=0,0,0&up=0,1,0&range=10:200&mode=blend&extinction=0.2&background=000000
// Of several channels there is a range each, range=10:200;5:90, and channels=0,2 where not all are drawn.
// What is as a new view has it may be left out: channels, iso, filter, lit and tf are.

import { isUsable } from "./camera";
import { kFilters, kModes, kPresets } from "./protocol";
import type { Vec3 } from "./vector";
import type { Range } from "./volume_info";
import type { ViewOverrides, ViewState } from "./view_state";

export interface AddressState {
  readonly volume: string | null;
  readonly overrides: ViewOverrides;
  readonly faults: readonly string[]; // what could not be understood, for people
}

export function formatFragment(volume: string, view: ViewState, isColoured: boolean): string {
  const parts = [`volume=${encodeURIComponent(volume)}`, ...viewParts(view, isColoured)];
  return `#${parts.join("&")}`;
}

// The query of GET /volumes/{id}/image that gives this picture.
export function imageQuery(view: ViewState, isColoured: boolean): string {
  const parts = [`size=${view.size[0]}x${view.size[1]}`, `fov=${compact(view.fovDegrees)}`];
  return [...parts, ...viewParts(view, isColoured), "format=png"].join("&");
}

function viewParts(view: ViewState, isColoured: boolean): string[] {
  const vector = (v: Vec3): string => v.map(compact).join(",");
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
    ...(isColoured || view.ranges.length > 1 || view.tf === "auto" ? [] : [`tf=${view.tf}`]),
    ...(isColoured ? [`extinction=${compact(view.extinction)}`] : []),
    `background=${view.background}`,
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
  const eye = read("eye", parseVec3, "three numbers x,y,z");
  const target = read("target", parseVec3, "three numbers x,y,z");
  const up = read("up", parseVec3, "three numbers x,y,z");
  const drawn = read("channels", parseChannels, "numbers of channels from 0, each once, or all");
  const ranges = read("range", parseRanges, "two numbers lo:hi, lo not above hi, of several channels separated by ;");
  const choice = <T extends string>(name: string, known: readonly T[]): T | null =>
    read(name, (text) => known.find((value) => value === text) ?? null, known.join(", "));
  const mode = choice("mode", kModes);
  const filter = choice("filter", kFilters);
  const lit = choice("lit", ["on", "off"]);
  const tf = choice("tf", kPresets);
  const iso = read("iso", parseNumber, "a number");
  const extinction = read("extinction", parsePositive, "a number above 0");
  const background = read("background", parseColour, "a colour rrggbb");
  // Half a camera says nothing: it counts only when all of it is there.
  const camera = eye && target && up ? { eye, target, up } : null;
  const usable = camera === null || isUsable(camera);
  if (!usable) faults.push("eye: must differ from target, and up must not point along the view");
  return {
    volume: parameters.get("volume"),
    overrides: {
      ...(camera && usable && { camera }),
      ...(drawn && { drawn }),
      ...(ranges && { ranges }),
      ...(mode && { mode }),
      ...(iso !== null && { iso }),
      ...(filter && { filter }),
      ...(lit && { lit: lit === "on" }),
      ...(tf && { tf }),
      ...(extinction && { extinction }),
      ...(background && { background }),
    },
    faults,
  };
}

// Seven digits: the precision of the renderer's floats, and an address people can still paste.
function compact(value: number): string {
  return String(Number(value.toPrecision(7)));
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
  return /^[0-9a-f]{6}$/i.test(text) ? text.toLowerCase() : null;
}
