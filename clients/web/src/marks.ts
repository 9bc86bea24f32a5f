// SPDX-License-Identifier: Apache-2.0
// Marks: measures and annotations, points of the world with a colour and a text. They are part of the view; the address has
// them where they are short, a JSON file whatever they are.

import { indexOf, type IndexSpace } from "./index_space";
import { Fields, FormatError, parseJson } from "./json_fields";
import { angleOf, formatMeasure, polygonArea, polylineLength, type Ruler } from "./measure";
import { boxCorners } from "./slice_plane";
import { length, subtract, type Vec3 } from "./vector";

export const kMarkKinds = ["ruler", "angle", "line", "area", "point", "box", "text"] as const;
export type MarkKind = (typeof kMarkKinds)[number];

export interface Mark {
  readonly kind: MarkKind;
  readonly points: readonly Vec3[]; // world; of a box two corners that face each other
  readonly colour: string; // rrggbb
  readonly text: string;
}

export const kMarkNames: Readonly<Record<MarkKind, string>> = {
  ruler: "Distance", angle: "Angle", line: "Length", area: "Area", point: "Point", box: "Box", text: "Text",
};
// Least and most points of each.
export const kPointCounts: Readonly<Record<MarkKind, readonly [least: number, most: number]>> = {
  ruler: [2, 2], angle: [3, 3], line: [2, 256], area: [3, 256], point: [1, 1], box: [2, 2], text: [1, 1],
};
export const kMostMarks = 200;
export const kMostText = 120;
export const kMostMarkCharacters = 1800; // in the address
const kFile = "blockwalk-marks";
const kHalf = /\p{Surrogate}/gu; // of a pair that stands for one character: no address holds it

// Value of a measure in the ruler's unit, null of an annotation.
export function valueOf({ kind, points }: Mark, ruler: Ruler): { readonly value: number; readonly unit: string } | null {
  const measured = points.map((point) => ruler.measured(point));
  if (kind === "ruler" || kind === "line") return { value: polylineLength(measured), unit: ruler.unit };
  if (kind === "area") return { value: polygonArea(measured), unit: ruler.unit === "" ? "" : `${ruler.unit}²` };
  const angle = kind === "angle" ? angleOf(measured) : null;
  return angle === null ? null : { value: angle, unit: "°" };
}

// "12.5 mm", "12.5 mm · cyst"
export function labelOf(mark: Mark, ruler: Ruler): string {
  const value = valueOf(mark, ruler);
  return [...(value === null ? [] : [formatMeasure(value.value, value.unit)]), ...(mark.text === "" ? [] : [mark.text])].join(" · ");
}

// Of a box that lies along the volume's axes, between two corners.
export function cornersOf(mark: Mark, space: IndexSpace): readonly Vec3[] {
  const [a, b] = mark.points.map((point) => indexOf(space, point));
  if (!a || !b) return [];
  const pick = (choose: (...values: number[]) => number): Vec3 => [choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2])];
  return boxCorners(space, pick(Math.min), pick(Math.max));
}

const compact = (value: number): string => String(Number(value.toPrecision(8)));

const wellFormed = (text: string): string => text.replace(kHalf, "\ufffd");

// ruler:ff8800:x,y,z,x,y,z:text;... The text is percent-encoded, so that it holds neither ; nor :.
export function formatMarks(marks: readonly Mark[]): string {
  return marks.map(({ kind, points, colour, text }) => [kind, colour, points.flat().map(compact).join(","), encodeURIComponent(wellFormed(text))].join(":").replace(/:$/, "")).join(";");
}

export const kMarkForm = `kind:rrggbb:x,y,z,...:text;... of ${kMarkKinds.join(", ")}`;

// Null where the text has no marks, or more than there may be.
export function parseMarks(text: string): readonly Mark[] | null {
  try {
    const marks = text.split(";").map((item) => {
      const [kind = "", colour = "", numbers = "", words = "", ...rest] = item.split(":");
      if (rest.length > 0) throw new FormatError("marks", kMarkForm);
      const parts = numbers.split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
      return markOf(kind, parts, colour, decodeURIComponent(words), "marks");
    });
    return marks.length <= kMostMarks ? marks : null;
  } catch (error) {
    if (error instanceof FormatError || error instanceof URIError) return null;
    throw error;
  }
}

export function marksFile(volume: string, marks: readonly Mark[]): string {
  const entries = marks.map(({ kind, points, colour, text }) => ({ kind, color: colour, text, points }));
  return `${JSON.stringify({ type: kFile, version: 1, volume, marks: entries }, null, 1)}\n`;
}

// Throws FormatError naming the member.
export function parseMarksFile(text: string): readonly Mark[] {
  const file = new Fields(parseJson(text, "file"), "file");
  if (file.string("type") !== kFile) throw new FormatError("file.type", kFile);
  if (file.number("version") !== 1) throw new FormatError("file.version", "1");
  const entries = file.array("marks");
  if (entries.length > kMostMarks) throw new FormatError("file.marks", `at most ${kMostMarks} marks`);
  return entries.map((entry, number) => {
    const path = `file.marks[${number}]`;
    const fields = new Fields(entry, path);
    const points = fields.array("points").flatMap((_, i) => new Fields({ point: fields.array("points")[i] }, `${path}.points[${i}]`).vec3("point"));
    return markOf(fields.string("kind"), points, fields.string("color"), fields.string("text"), path);
  });
}

function markOf(name: string, parts: readonly number[], colour: string, text: string, path: string): Mark {
  const kind = kMarkKinds.find((candidate) => candidate === name);
  if (kind === undefined) throw new FormatError(`${path}.kind`, `one of ${kMarkKinds.join(", ")}`);
  const points = Array.from({ length: Math.floor(parts.length / 3) }, (_, i): Vec3 => [parts[3 * i] ?? NaN, parts[3 * i + 1] ?? NaN, parts[3 * i + 2] ?? NaN]);
  const [least, most] = kPointCounts[kind];
  const areFine = parts.length % 3 === 0 && parts.every(Number.isFinite) && points.length >= least && points.length <= most;
  if (!areFine) throw new FormatError(`${path}.points`, `${least === most ? least : `${least} to ${most}`} points of three numbers`);
  if (!/^[0-9a-f]{6}$/i.test(colour)) throw new FormatError(`${path}.color`, "rrggbb");
  if (text !== wellFormed(text)) throw new FormatError(`${path}.text`, "whole characters; it has a half of one");
  if (text.length > kMostText) throw new FormatError(`${path}.text`, `at most ${kMostText} characters`);
  return { kind, points, colour: colour.toLowerCase(), text };
}

// A line a mark, for spreadsheets.
export function csvOf(marks: readonly Mark[], ruler: Ruler): string {
  const rows = marks.map((mark, number) => {
    const value = valueOf(mark, ruler);
    const size = mark.kind === "box" ? sizeOf(mark, ruler) : null;
    return [String(number + 1), mark.kind, mark.text, value === null ? size ?? "" : String(value.value), value?.unit ?? (size === null ? "" : ruler.unit), mark.points.map((point) => point.join(" ")).join("; ")];
  });
  return [["number", "kind", "text", "value", "unit", "points"], ...rows].map((row) => `${row.map(quoted).join(",")}\n`).join("");
}

// The way from corner to corner of a box.
const sizeOf = ({ points: [a, b] }: Mark, { measured }: Ruler): string | null => (a && b ? String(length(subtract(measured(b), measured(a)))) : null);

// What begins like a formula is made text: a spreadsheet would compute it.
function quoted(text: string): string {
  const safe = /^[=+@\t]|^-(?![\d.])/.test(text) ? `'${text}` : text;
  return /[",\n\r;]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
