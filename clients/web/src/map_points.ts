// SPDX-License-Identifier: Apache-2.0
// What a file of colours holds, whoever wrote it.

import { FormatError } from "./json_fields";

export const kMostFilePoints = 4096; // more than any map has: reading compares points with each other

export interface MapPoint {
  readonly value: number;
  readonly colour: string | null; // rrggbb; null: the file says none
  readonly opacity: number | null; // null: the file says none
}

export interface MapFile {
  readonly points: readonly MapPoint[]; // at least one, values do not descend
  readonly areData: boolean; // values are those of the data; else they are to be stretched over a window
  readonly notes: readonly string[]; // what of the file is not as it was, for people
}

export type Node = readonly number[]; // a value, and what a function is there

// Numbers as nodes of so many each, of which `parts` after the value are from 0 to 1. `name` is theirs in errors.
export function nodesOf(numbers: readonly number[], name: string, size: number, parts: number = size - 1): readonly Node[] {
  if (numbers.length === 0 || numbers.length % size !== 0) throw new FormatError(name, `${size} numbers a point; there are ${numbers.length}`);
  if (numbers.length / size > kMostFilePoints) throw new FormatError(name, `at most ${kMostFilePoints} points; there are ${numbers.length / size}`);
  const bad = numbers.findIndex((number) => !Number.isFinite(number));
  if (bad >= 0) throw new FormatError(`${name}, number ${bad + 1}`, "a finite number");
  const nodes = Array.from({ length: numbers.length / size }, (_, i) => numbers.slice(i * size, (i + 1) * size));
  nodes.forEach((node, i) => {
    if ((node[0] ?? 0) < (nodes[i - 1]?.[0] ?? -Infinity)) throw new FormatError(`${name}, point ${i + 1}`, "a value not below the one before");
    if (node.slice(1, 1 + parts).some((part) => part < 0 || part > 1)) throw new FormatError(`${name}, point ${i + 1}`, "0 to 1 after its value");
  });
  return nodes;
}

// What comes after the value at this one: straight between nodes, as they are beyond the ends, and of several nodes on
// this very spot the last or the first.
export function sampled(nodes: readonly Node[], value: number, isAfter: boolean): readonly number[] {
  const here = nodes.filter(([at]) => at === value);
  const own = isAfter ? here.at(-1) : here[0];
  if (own !== undefined) return own.slice(1);
  const next = nodes.findIndex(([at = 0]) => at > value);
  const [a, b] = [nodes[next < 0 ? nodes.length - 1 : Math.max(0, next - 1)] ?? [], nodes[next < 0 ? nodes.length - 1 : next] ?? []];
  const [from = 0, to = 0] = [a[0], b[0]];
  const share = to > from ? Math.max(0, (value - from) / (to - from)) : 0;
  return a.slice(1).map((part, i) => part + share * ((b[i + 1] ?? part) - part));
}

// Parts from 0 to 1 as rrggbb.
export const hexOf = (rgb: readonly number[]): string => rgb.map((part) => Math.round(255 * part).toString(16).padStart(2, "0")).join("");
