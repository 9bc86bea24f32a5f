// SPDX-License-Identifier: Apache-2.0
// The view in words, for who does not see the picture: what is open, how it is drawn, what is cut, from where one looks.

import { basisOf } from "./camera";
import { sidesOf } from "./axes";
import { kMarkNames } from "./marks";
import type { Mode } from "./protocol";
import { formatDims, formatValue } from "./units";
import { dot, scale, type Vec3 } from "./vector";
import type { ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kModeWords: Readonly<Record<Mode, string>> = {
  blend: "light and matter blended", "first-hit": "the first thing in the range", iso: "a surface", mip: "the largest value along each ray",
  minip: "the least value along each ray", "attenuated-mip": "the largest value along each ray, weakened by what lies before it",
  mean: "the mean along each ray", blocks: "blocks that rays visit",
};
const kOblique = 0.38; // of the way, to be named beside the first

// `badge`: how good the picture is; `slices`: what the slices say of themselves, where they are shown.
export function summaryOf(view: ViewState, volume: VolumeInfo, badge: string, slices: readonly string[]): string {
  return [
    `${volume.name}, ${formatDims(volume.dims)} voxels${volume.steps > 1 ? `, step ${Number(view.others.time ?? 0) + 1} of ${volume.steps}` : ""}.`,
    `Drawn: ${kModeWords[view.mode] ?? view.mode}${view.mode === "iso" && view.iso !== null ? ` of ${formatValue(view.iso)}` : ""}.`,
    `${rangeWords(view, volume)}.`,
    `${cutWords(view)}.`,
    `Seen from ${directionWords(view, volume)}${view.ortho === null ? "" : ", in parallel projection"}.`,
    ...(slices.length > 0 ? [`Slices: ${slices.join("; ")}.`] : []),
    ...(view.marks.length > 0 ? [`Marks: ${markWords(view)}.`] : []),
    ...(view.beside === null ? [] : ["Another view stands beside it."]),
    `Picture: ${badge || "none yet"}.`,
  ].join(" ");
}

function rangeWords({ ranges, drawn }: ViewState, { channels }: VolumeInfo): string {
  const said = drawn.map((number) => {
    const [lo, hi] = ranges[number] ?? [0, 0];
    const { name = "", unit = null } = channels[number] ?? {};
    return `${channels.length > 1 ? `${name} ` : ""}${formatValue(lo)} to ${formatValue(hi)}${unit === null ? "" : ` ${unit}`}`;
  });
  return `Values shown: ${said.join(", ")}`;
}

function cutWords({ clip, planes }: ViewState): string {
  const box = clip === null ? [] : ["to a box"];
  const cuts = planes.length === 0 ? [] : [`by ${planes.length === 1 ? "a plane" : `${planes.length} planes`}`];
  return box.length + cuts.length === 0 ? "Nothing is cut away" : `Cut ${[...box, ...cuts].join(" and ")}`;
}

// "anterior and superior": the sides that the eye is on, the most first.
export function directionWords({ camera }: Pick<ViewState, "camera">, { space, defaultView }: Pick<VolumeInfo, "space" | "defaultView">): string {
  const towards: Vec3 = scale(basisOf(camera).forward, -1);
  const seen = sidesOf(space, defaultView.camera.up).map(({ direction, words }) => ({ words, share: dot(direction, towards) })).sort((a, b) => b.share - a.share);
  return seen.filter(({ share }, i) => i === 0 || share > kOblique).map(({ words }) => words).join(", ").replace(/, ([^,]*)$/, " and $1");
}

function markWords({ marks }: ViewState): string {
  const counts = new Map<string, number>();
  for (const { kind } of marks) counts.set(kMarkNames[kind], (counts.get(kMarkNames[kind]) ?? 0) + 1);
  return [...counts].map(([name, count]) => `${count} ${name.toLowerCase()}`).join(", ");
}
