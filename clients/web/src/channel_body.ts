// SPDX-License-Identifier: Apache-2.0
// Over which values colour maps run: the body of a channel's data, as the server finds it (view/transfer_presets.cpp).

import type { ChannelInfo, Histogram } from "./volume_info";

// Where it begins, where it is well under way and where it ends; ascending, data units.
export type Body = readonly [first: number, middle: number, last: number];

const kFirst = 0.6; // of the way to the threshold
const kLastShare = 0.998; // of the voxels

// Null where the data has no such values: a mask.
export function bodyOf({ window, densityRange, histogram }: ChannelInfo): Body | null {
  if (window !== null && window[0] < window[1]) return [window[0], 0.5 * (window[0] + window[1]), window[1]];
  if (densityRange[0] === densityRange[1]) return null;
  const { lo, hi, counts } = histogram;
  const at = (bin: number): number => lo + ((hi - lo) / counts.length) * bin;
  const threshold = otsuBin(counts);
  const body = [at(threshold * kFirst), at(threshold + 1), at(shareBin(histogram, kLastShare) + 1)] as const;
  return body[0] < body[1] && body[1] < body[2] ? body : null;
}

// The bin that best separates background from body: the largest variance between the two (Otsu 1979).
function otsuBin(counts: readonly number[]): number {
  const total = counts.reduce((sum, count) => sum + count, 0);
  const moment = counts.reduce((sum, count, bin) => sum + bin * count, 0);
  let [below, momentBelow, best, found] = [0, 0, -1, 0];
  for (const [bin, count] of counts.slice(0, -1).entries()) {
    below += count;
    momentBelow += bin * count;
    if (below <= 0 || below >= total) continue;
    const difference = momentBelow / below - (moment - momentBelow) / (total - below);
    const variance = below * (total - below) * difference * difference;
    if (variance > best) [best, found] = [variance, bin];
  }
  return found;
}

// The first bin up to which this share of the voxels lies.
function shareBin({ counts }: Histogram, share: number): number {
  const total = counts.reduce((sum, count) => sum + count, 0);
  let below = 0;
  const found = counts.findIndex((count) => (below += count) >= share * total);
  return found < 0 ? counts.length - 1 : found;
}
