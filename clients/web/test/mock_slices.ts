// SPDX-License-Identifier: Apache-2.0
// Slices and voxels of the mock's volumes: a voxel's red, green and blue say where it lies, and its value is x + 100 y + 10000 z.

import type { ServerResponse } from "node:http";
import { encodePng } from "./png";

const kDims = [96, 80, 64];
const kMostPixels = 2048;

export function answerSlice(query: URLSearchParams, refusal: { readonly status: number; readonly detail: string } | null, response: ServerResponse): void {
  if (response.destroyed) return;
  if (refusal !== null) {
    const problem = { type: "about:blank", title: "Bad Request", field: "slice", ...refusal };
    return void response.writeHead(refusal.status, { "content-type": "application/problem+json" }).end(JSON.stringify(problem));
  }
  response.writeHead(200, { "content-type": "image/png" }).end(query.has("centre") ? planePicture(query) : axisPicture(query));
}

const colourOf = (at: readonly number[]): readonly [number, number, number] => [2 * (at[0] ?? 0), 3 * (at[1] ?? 0), 3 * (at[2] ?? 0)];

function axisPicture(query: URLSearchParams): Buffer {
  const axis = "xyz".indexOf(query.get("axis") ?? "");
  const side = 2 ** Number(query.get("level") ?? 0);
  const [columns = 0, rows = 1] = [0, 1, 2].filter((other) => other !== axis);
  const box = (query.get("box") ?? "").split(",").map(Number);
  const bound = (at: number, own: number): number => (box.length === 6 ? (box[at] ?? own) : own);
  const [begin, end] = [[bound(columns, 0), bound(rows, 0)], [bound(3 + columns, kDims[columns] ?? 1), bound(3 + rows, kDims[rows] ?? 1)]];
  const length = (i: number): number => Math.min(kMostPixels, Math.ceil(((end[i] ?? 1) - (begin[i] ?? 0)) / side));
  return encodePng(length(0), length(1), (x, y) => {
    const at = [0, 0, 0];
    at[axis] = Number(query.get("index"));
    at[columns] = (begin[0] ?? 0) + x * side;
    at[rows] = (begin[1] ?? 0) + y * side;
    return colourOf(at);
  });
}

// Of a volume with the sample's place in the world: two units along z are a voxel.
function planePicture(query: URLSearchParams): Buffer {
  const vector = (name: string): number[] => (query.get(name) ?? "").split(",").map(Number);
  const [centre, right, down] = [vector("centre"), vector("right"), vector("down")];
  const [width = 1, height = 1] = (query.get("size") ?? "").split("x").map(Number);
  const pixel = Number(query.get("pixel"));
  return encodePng(width, height, (x, y) => {
    const [s, t] = [(x + 0.5 - width / 2) * pixel, (y + 0.5 - height / 2) * pixel];
    const world = [0, 1, 2].map((i) => (centre[i] ?? 0) + s * (right[i] ?? 0) + t * (down[i] ?? 0));
    const index = [world[0] ?? 0, world[1] ?? 0, (world[2] ?? 0) / 2].map(Math.floor);
    return index.every((part, i) => part >= 0 && part < (kDims[i] ?? 0)) ? colourOf(index) : [0, 0, 0];
  });
}

// One voxel as a number of four bytes.
export function answerRegion(query: URLSearchParams, response: ServerResponse): void {
  const [x = 0, y = 0, z = 0] = (query.get("box") ?? "").split(",").map(Number);
  const bytes = Buffer.alloc(4);
  bytes.writeFloatLE(x + 100 * y + 10000 * z);
  response.writeHead(200, { "content-type": "application/octet-stream", "x-blockwalk-raw": JSON.stringify({ dims: [1, 1, 1], channels: 1, type: "f32" }) }).end(bytes);
}
