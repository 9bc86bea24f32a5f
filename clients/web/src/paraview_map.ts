// SPDX-License-Identifier: Apache-2.0
// Colour maps of ParaView (.json): an array of maps; RGBPoints is value, r, g, b, ... and Points, where there are some,
// value, opacity, midpoint, sharpness, ... Values are of any range: ParaView stretches them over the data, and so do we.

import { FormatError, Fields } from "./json_fields";
import { hexOf, nodesOf, sampled, type MapFile, type MapPoint } from "./map_points";

export function parseParaViewMap(maps: readonly unknown[]): MapFile {
  if (maps.length === 0) throw new FormatError("file", "a map; the array is empty");
  const fields = new Fields(maps[0], "[0]");
  if (!fields.has("RGBPoints")) throw new FormatError("[0].RGBPoints", "value, r, g, b, ...; maps of categories have no values");
  const colours = nodesOf(fields.numbers("RGBPoints"), "[0].RGBPoints", 4);
  const opacities = fields.has("Points") ? nodesOf(fields.numbers("Points"), "[0].Points", 4, 1) : [];
  const space = fields.has("ColorSpace") ? fields.string("ColorSpace") : "RGB";
  const notes = [
    ...(maps.length > 1 ? [`Of its ${maps.length} maps this is the first${fields.has("Name") ? `, ${fields.string("Name").slice(0, 60)}` : ""}.`] : []),
    ...(space !== "RGB" && space !== "Step" ? [`Between its points colours are mixed in RGB, not in ${space.slice(0, 20)}.`] : []),
  ];
  const [first = 0, last = 0] = [colours[0]?.[0], colours.at(-1)?.[0]];
  const points = colours.map(([value = 0, ...rgb]): MapPoint => ({ value, colour: hexOf(rgb), opacity: sampled(opacities, value, false)[0] ?? null }));
  const between = opacities.flatMap(([value = 0, opacity = 0]): MapPoint[] =>
    value < first || value > last || colours.some(([at]) => at === value) ? [] : [{ value, colour: hexOf(sampled(colours, value, false)), opacity }]);
  return { points: [...points, ...between].sort((a, b) => a.value - b.value), areData: false, notes };
}
