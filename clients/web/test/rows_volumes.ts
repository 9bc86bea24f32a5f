// SPDX-License-Identifier: Apache-2.0
// The volumes that rows_test.ts looks at: small ones of which every value is known, demos, one of 2292 slices, real ones
// where they are.

import { closeSync, existsSync, ftruncateSync, openSync, writeFileSync, writeSync } from "node:fs";
import { join } from "node:path";
import { blockwalk } from "./daemon";
import type { Vec3 } from "../src/vector";

declare const SOURCE_FOLDER: string; // clients/web
export const kPythonFolder = join(SOURCE_FOLDER, "../python");
const kData = process.env["BLOCKWALK_DATA"] ?? join(SOURCE_FOLDER, "../../../shared/data");

// A head in patients' axes (x to the left, y to the back, z to the top, mm), with a nose, two ears, a hat and a core.
export const kHeadDims = [64, 64, 48] as const;
export const kHeadSpacing = [1, 1, 1.5] as const;
export const kHeadValues = { head: 80, rightEar: 100, leftEar: 120, nose: 160, core: 200, hat: 240 } as const;
const kBalls = [[0, 0, 0, 22, 80], [-25, 0, 0, 3, 100], [25, 0, 0, 5, 120], [0, -25, 0, 5, 160], [0, 0, 0, 10, 200], [0, 0, 28, 5, 240]] as const;

export function headAt(point: Vec3): number {
  const [x, y, z] = point;
  return kBalls.reduce((value: number, [bx, by, bz, radius, own]) => (Math.hypot(x - bx, y - by, z - bz) < radius ? own : value), 0);
}

// The middle of a voxel in the world.
export function headPlace(voxel: Vec3): Vec3 {
  const along = (axis: 0 | 1 | 2): number => (voxel[axis] + 0.5 - kHeadDims[axis] / 2) * kHeadSpacing[axis];
  return [along(0), along(1), along(2)];
}

function voxelsOf([width, height, depth]: Vec3, valueAt: (voxel: Vec3) => number): Buffer {
  const voxels = Buffer.alloc(width * height * depth);
  for (let i = 0; i < voxels.length; ++i) voxels[i] = valueAt([i % width, Math.floor(i / width) % height, Math.floor(i / (width * height))]);
  return voxels;
}

function makeHead(folder: string): string {
  const [dx, dy, dz] = kHeadSpacing;
  const header = [
    "NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior", `sizes: ${kHeadDims.join(" ")}`, 'space units: "mm" "mm" "mm"',
    `space directions: (${dx},0,0) (0,${dy},0) (0,0,${dz})`, `space origin: (${headPlace([0, 0, 0]).join(",")})`, "encoding: raw", "endian: little", "", "",
  ].join("\n");
  const [source, volume] = [join(folder, "head.nrrd"), join(folder, "head.bwv")];
  writeFileSync(source, Buffer.concat([Buffer.from(header), voxelsOf(kHeadDims, (voxel) => headAt(headPlace(voxel)))]));
  blockwalk("import", source, "-o", volume, "--values", "intensity");
  return volume;
}

// Twelve bars of labels 1 to 12 side by side along x, which are of one size.
export const kLabels = 12;
function makeLabels(folder: string): string {
  const [source, volume] = [join(folder, "labels.raw"), join(folder, "labels.bwv")];
  writeFileSync(source, voxelsOf([96, 32, 32], ([x, y, z]) => (Math.min(y, z) >= 4 && Math.max(y, z) < 28 && x % 8 < 6 ? 1 + Math.floor(x / 8) : 0)));
  blockwalk("import", source, "-o", volume, "--dims", "96x32x32", "--type", "u8", "--values", "labels");
  return volume;
}

// A ball that goes along x, from step to step.
export const kFilmSteps = 4;
function makeFilm(folder: string): string {
  const steps = Array.from({ length: kFilmSteps }, (_, step) => join(folder, `step${step}.raw`));
  steps.forEach((path, step) => writeFileSync(path, voxelsOf([48, 32, 32], ([x, y, z]) => (Math.hypot(x - 8 - 10 * step, y - 16, z - 16) < 7 ? 200 : x + y + z === 0 || x + y + z === 109 ? 1 : 0))));
  const volume = join(folder, "film.bwv");
  blockwalk("import", ...steps, "-o", volume, "--dims", "48x32x32", "--type", "u8", "--time", "all", "--values", "intensity");
  return volume;
}

// A spring of 2292 slices in a file that is holes but for it.
export const kLongDims = [880, 836, 2292] as const;
function makeLong(folder: string): string {
  const [width, height, depth] = kLongDims;
  const [source, volume] = [join(folder, "long.raw"), join(folder, "long.bwv")];
  const file = openSync(source, "w");
  ftruncateSync(file, width * height * depth);
  for (let z = 0; z < depth; ++z) {
    const [x, y] = [width / 2 + 300 * Math.cos(z / 90), height / 2 + 300 * Math.sin(z / 90)].map(Math.round) as [number, number];
    const row = Buffer.alloc(40, 60 + Math.floor((180 * z) / depth));
    for (let down = -20; down < 20; down += 1) writeSync(file, row, 0, row.length, (z * height + y + down) * width + x - 20);
  }
  closeSync(file);
  blockwalk("import", source, "-o", volume, "--dims", kLongDims.join("x"), "--type", "u8", "--values", "intensity");
  return volume;
}

// Of the real ones null where they are not there.
function makeAbdomen(folder: string): string | null {
  const source = join(kData, "ct_abdomen_dicom");
  if (!existsSync(source)) return null;
  blockwalk("import", source, "-o", join(folder, "abdomen.bwv"));
  return join(folder, "abdomen.bwv");
}

export interface RowVolumes {
  readonly files: readonly string[];
  readonly hasAbdomen: boolean;
}

export function makeVolumes(folder: string): RowVolumes {
  const demos = ["fossil", "tissue"].map((name) => join(folder, `${name}.bwv`));
  for (const path of demos) blockwalk("demo", path.includes("fossil") ? "fossil" : "tissue", "-o", path, "--size", "96");
  const abdomen = makeAbdomen(folder);
  return { files: [makeHead(folder), ...demos, makeLabels(folder), makeFilm(folder), makeLong(folder), ...(abdomen === null ? [] : [abdomen])], hasAbdomen: abdomen !== null };
}
