// SPDX-License-Identifier: Apache-2.0
// Colour maps and transfer functions as files: our own JSON, and what 3D Slicer, ParaView and Fiji write. A file tells by
// what is in it which of them it is; one that is none, or is broken, is a FormatError that names what is wrong.

import { parseFijiBytes, parseFijiText } from "./fiji_map";
import { FormatError, Fields, parseJson } from "./json_fields";
import { kMostFilePoints, type MapFile } from "./map_points";
import { parseParaViewMap } from "./paraview_map";
import { parseSlicerProperty } from "./slicer_map";
import { kMostPoints, type TransferPoint } from "./transfer";
import { ascending, resampled, sampleAt, type Points } from "./transfer_edit";
import type { Range } from "./volume_info";

export const kMostFileBytes = 1 << 20;
const kType = "blockwalk transfer function";

// What a file holds. `bytes` is all of it.
export function parseMapFile(bytes: Uint8Array): MapFile {
  if (bytes.length > kMostFileBytes) throw new FormatError("file", `at most ${kMostFileBytes} bytes, it has ${bytes.length}`);
  if (bytes.length === 0) throw new FormatError("file", "a colour map, it is empty");
  const fiji = parseFijiBytes(bytes);
  if (fiji !== null) return fiji;
  const text = textOf(bytes);
  if (text === null) throw new FormatError("file", "JSON, a .vp file or a .lut file; it is neither text nor 768 bytes of colours");
  const begin = text.trimStart()[0];
  return begin === "{" || begin === "[" ? parseMapJson(parseJson(text, "file")) : (parseFijiText(text) ?? parseSlicerProperty(text));
}

// Ours is an object that says so; ParaView's is an array of maps, or one of them.
function parseMapJson(value: unknown): MapFile {
  if (Array.isArray(value)) return parseParaViewMap(value);
  const fields = new Fields(value, "file");
  if (fields.has("RGBPoints") || fields.has("IndexedColors")) return parseParaViewMap([value]);
  if (fields.value("type") !== kType) throw new FormatError("type", `"${kType}", or a ParaView map with RGBPoints`);
  if (fields.number("version") !== 1) throw new FormatError("version", "1");
  const items = fields.array("points");
  if (items.length === 0 || items.length > kMostFilePoints) throw new FormatError("points", `1 to ${kMostFilePoints}; there are ${items.length}`);
  const points = items.map((item, i) => {
    const point = new Fields(item, `points[${i}]`);
    const [colour, opacity] = [point.string("color"), point.number("opacity")];
    if (!/^[0-9a-f]{6}$/i.test(colour)) throw new FormatError(`points[${i}].color`, "rrggbb");
    if (!(opacity >= 0 && opacity <= 1)) throw new FormatError(`points[${i}].opacity`, "0 to 1");
    return { value: point.number("value"), colour: colour.toLowerCase(), opacity };
  });
  return { points, areData: true, notes: [] };
}

export function writeMapJson(points: Points): string {
  const items = points.map(({ value, colour, opacity }) => `    ${JSON.stringify({ value, color: colour, opacity })}`);
  return `{\n  "type": "${kType}",\n  "version": 1,\n  "points": [\n${items.join(",\n")}\n  ]\n}\n`;
}

// A file's points as a transfer function that the server takes: values that are none of the data are stretched over
// `window`, and what the file does not say of colour or opacity is as it is now.
export function fittedMap(file: MapFile, now: Points, window: Range): { readonly points: Points; readonly notes: readonly string[] } {
  const [first, last] = [file.points[0]?.value ?? 0, file.points.at(-1)?.value ?? 1];
  const place = (value: number): number => {
    if (file.areData) return value;
    return last > first ? window[0] + ((value - first) / (last - first)) * (window[1] - window[0]) : window[0];
  };
  const whole = file.points.map((point): TransferPoint => {
    const value = place(point.value);
    const own = sampleAt(now, value);
    return { value, colour: point.colour ?? own.colour, opacity: point.opacity ?? own.opacity };
  });
  const apart = ascending(whole);
  if (apart === null) throw new FormatError("points", "values that ascend");
  const points = resampled(apart);
  const isFewer = points.length < apart.length;
  return { points, notes: [...file.notes, ...(isFewer ? [`Of its ${apart.length} points ${kMostPoints} are left, evenly: no more may be.`] : [])] };
}

// Null where it is no text.
function textOf(bytes: Uint8Array): string | null {
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return null;
  }
}
