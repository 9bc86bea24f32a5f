// SPDX-License-Identifier: Apache-2.0
// Lookup tables of Fiji and ImageJ (.lut), of 256 colours: 256 bytes each of red, green and blue, alone or behind the
// header of NIH Image, or lines of text.
//
//   NIH Image, big endian:  0  "ICOL"   4  u16 version   6  u16 colours n   8  u16 first, u16 last   12  20 bytes of nothing
//                          32  n bytes each of red, green and blue

import { FormatError } from "./json_fields";
import type { MapFile } from "./map_points";

const kColours = 256;
const kHeaderBytes = 32;
const kRawBytes = 3 * kColours;
const kRawBytesWithRest = 970; // what NIH Image wrote without its header

// Null where it is no table of bytes.
export function parseFijiBytes(bytes: Uint8Array): MapFile | null {
  if (String.fromCharCode(...bytes.slice(0, 4)) === "ICOL") {
    if (bytes.length < kHeaderBytes) throw new FormatError("header", `${kHeaderBytes} bytes; the file ends after ${bytes.length}`);
    const count = new DataView(bytes.buffer, bytes.byteOffset).getUint16(6);
    if (count < 2 || count > kColours) throw new FormatError("header, colours", `2 to ${kColours}, it says ${count}`);
    const wanted = kHeaderBytes + 3 * count;
    if (bytes.length < wanted) throw new FormatError("colours", `${3 * count} bytes after the header; the file ends after ${bytes.length - kHeaderBytes}`);
    return tableOf(count, (i, part) => bytes[kHeaderBytes + part * count + i] ?? 0);
  }
  // Text of that very length is text.
  const isText = bytes.every((byte) => byte === 9 || byte === 10 || byte === 13 || (byte >= 32 && byte < 127));
  if (isText || (bytes.length !== kRawBytes && bytes.length !== kRawBytesWithRest)) return null;
  return tableOf(kColours, (i, part) => bytes[part * kColours + i] ?? 0);
}

// Lines of red, green and blue, or of a number and these; the first may be a heading. Null where it is no such text.
export function parseFijiText(text: string): MapFile | null {
  const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line !== "");
  const rows = lines.map((line) => line.split(/[\s,]+/).map(Number));
  const hasHeading = rows[0]?.some(Number.isNaN) ?? true;
  const table = hasHeading ? rows.slice(1) : rows;
  const width = table[0]?.length ?? 0;
  if (width !== 3 && width !== 4) return null;
  if (table.length !== kColours) throw new FormatError("lines", `${kColours} of ${width} numbers; there are ${table.length}`);
  table.forEach((row, i) => {
    const isFine = row.length === width && row.slice(-3).every((part) => part >= 0 && part <= 255);
    if (!isFine) throw new FormatError(`line ${i + 1 + (hasHeading ? 1 : 0)}`, `${width} numbers, colours from 0 to 255; it is "${(lines[i + (hasHeading ? 1 : 0)] ?? "").slice(0, 40)}"`);
  });
  return tableOf(kColours, (i, part) => table[i]?.at(part - 3) ?? 0);
}

function tableOf(count: number, at: (index: number, part: number) => number): MapFile {
  const hex = (index: number): string => [0, 1, 2].map((part) => Math.round(at(index, part)).toString(16).padStart(2, "0")).join("");
  return { points: Array.from({ length: count }, (_, i) => ({ value: i, colour: hex(i), opacity: null })), areData: false, notes: [] };
}
