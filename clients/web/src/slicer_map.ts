// SPDX-License-Identifier: Apache-2.0
// Volume properties of 3D Slicer (.vp): lines of text. Six numbers about shading, then three functions, each the count of
// its numbers and the numbers: opacity (value, opacity), opacity by gradient, colour (value, r, g, b), 0 to 1.

import { FormatError } from "./json_fields";
import { hexOf, nodesOf, sampled, type MapFile, type MapPoint, type Node } from "./map_points";

const kShading = ["interpolation", "shade", "diffuse", "ambient", "specular", "specular power"];

export function parseSlicerProperty(text: string): MapFile {
  const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line !== "");
  if (!/^[-+.\de]+$/i.test(lines[0] ?? "")) throw new FormatError("line 1", `a number: it is ${said(lines[0])}, and the file no .vp, .lut or .json`);
  kShading.forEach((name, i) => oneNumber(lines[i], name));
  const [opacityLine, gradientLine, colourLine] = lines.slice(kShading.length);
  const opacities = nodesOfLine(opacityLine, "scalar opacity", 2);
  const gradient = nodesOfLine(gradientLine, "gradient opacity", 2);
  const colours = nodesOfLine(colourLine, "colour", 4);
  const values = [...new Set([...opacities, ...colours].map(([value = 0]) => value))].sort((a, b) => a - b);
  const points = values.flatMap((value) => sides(opacities, colours, value));
  const isByGradient = gradient.some(([, opacity]) => opacity !== gradient[0]?.[1]);
  return { points, areData: true, notes: isByGradient ? ["Opacity by gradient is left out: it is not drawn here."] : [] };
}

function oneNumber(line: string | undefined, name: string): void {
  if (line === undefined || !Number.isFinite(Number(line))) throw new FormatError(name, `a number, the file has ${said(line)}`);
}

function nodesOfLine(line: string | undefined, name: string, size: number): readonly Node[] {
  const [count = NaN, ...numbers] = (line ?? "").split(/\s+/).map((item) => (item === "" ? NaN : Number(item)));
  if (!Number.isInteger(count) || count < size) throw new FormatError(name, `how many numbers follow, ${size} a point; the file has ${said(line)}`);
  if (numbers.length !== count) throw new FormatError(name, `${count} numbers; the line has ${numbers.length}`);
  return nodesOf(numbers, name, size);
}

// One point, or two where one of the functions has a step at this value.
function sides(opacities: readonly Node[], colours: readonly Node[], value: number): readonly MapPoint[] {
  const point = (isAfter: boolean): MapPoint => ({ value, colour: hexOf(sampled(colours, value, isAfter)), opacity: sampled(opacities, value, isAfter)[0] ?? 0 });
  const [before, after] = [point(false), point(true)];
  return before.colour === after.colour && before.opacity === after.opacity ? [before] : [before, after];
}

const said = (line: string | undefined): string => (line === undefined ? "no such line" : `"${line.slice(0, 40)}"`);
