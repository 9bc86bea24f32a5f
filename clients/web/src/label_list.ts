// SPDX-License-Identifier: Apache-2.0
// The labels of a channel, and which of them a transfer function hides: those whose opacity is 0. What is hidden is kept
// nowhere else, so that a link, undoing and the command line have it.
//
// Between two labels there is nothing, so a function only has to be right at each of them. Up to as many labels as a
// function has points each has its own; of more, those in a row that are hidden or shown share two.

import { formatPoints, kMostPoints, ownPoints, pointsOf, type TransferPoint } from "./transfer";
import { sampleAt, type Points } from "./transfer_edit";
import type { ChannelInfo, Histogram } from "./volume_info";

export const kMostLabels = 65536; // that are listed; of more, those that have a name or a colour of their own

export interface Label {
  readonly value: number;
  readonly name: string | null;
  readonly count: number | null; // voxels; null where the server does not say
}

export interface LabelList {
  readonly labels: readonly Label[]; // ascending, those that are in the data
  readonly isWhole: boolean; // false: there are more than are listed
  readonly channel: ChannelInfo;
  readonly own: Points; // the channel's transfer function
}

export function labelsOf(channel: ChannelInfo): LabelList {
  const own = ownPoints(channel) ?? [];
  const [first, last] = [Math.ceil(channel.densityRange[0]), Math.floor(channel.densityRange[1])];
  const isWhole = last - first < kMostLabels;
  const every = isWhole ? Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => first + i) : [];
  const values = [...new Set([...every, ...own.map(({ value }) => value), ...channel.labels.keys()])].sort((a, b) => a - b);
  const present = values.filter((value) => value >= first && value <= last && countIn(channel.histogram, value) !== 0);
  const areAlone = channel.histogram.hi - channel.histogram.lo < channel.histogram.counts.length; // the last bar has its end too
  const labels = present.map((value): Label => ({
    value,
    name: channel.labels.get(value) || null,
    count: areAlone ? countIn(channel.histogram, value) : null,
  }));
  return { labels, isWhole, channel, own };
}

// Of all values that share a bar of the histogram; a label without a voxel there is in none of the data.
function countIn({ lo, hi, counts }: Histogram, value: number): number {
  const bin = hi > lo ? Math.floor(((value - lo) / (hi - lo)) * counts.length) : 0;
  return counts[Math.max(0, Math.min(counts.length - 1, bin))] ?? 0;
}

// Which labels a transfer function shows, in the order of the list.
export function shownIn({ labels, channel }: LabelList, transfer: string): readonly boolean[] {
  return opacitiesAt(pointsOf(transfer, channel), labels.map(({ value }) => value)).map((opacity) => opacity > 0);
}

// The transfer function that shows these and no others, in the colours it has now. Null where it takes more points than
// a function may have.
export function withShown(list: LabelList, transfer: string, shown: readonly boolean[]): string | null {
  const states = list.labels.map(({ value }, i): State => ({ value, isShown: shown[i] ?? true }));
  const isEach = list.isWhole && states.length <= kMostPoints;
  const all = isEach ? states : withOthers(list, states);
  const values = all.map(({ value }) => value);
  const now = pointsOf(transfer, list.channel);
  const [own, usual] = [opacitiesAt(now, values), opacitiesAt(list.own, values)];
  const opacities = all.map(({ isShown }, i) => (!isShown ? 0 : (own[i] ?? 0) > 0 ? (own[i] ?? 0) : (usual[i] ?? 1)));
  const kept = isEach ? all.map((_, i) => i) : fewer(values, opacities, new Set(list.own.map(({ value }) => value)));
  if (kept === null) return null;
  const points = kept.map((i) => ({ ...sampleAlong(now, values[i] ?? 0), opacity: opacities[i] ?? 0 }));
  // What is as the volume has it needs no words.
  const isUsual = opacities.every((opacity, i) => opacity === usual[i]) && points.every(({ value, colour }) => sampleAlong(list.own, value).colour === colour);
  return isUsual ? "auto" : formatPoints(points);
}

interface State {
  readonly value: number;
  readonly isShown: boolean;
}

// With the values at which colours change, and, where labels are not all listed, those beside hidden ones: they are shown
// unless both their neighbours are hidden.
function withOthers({ own, isWhole }: LabelList, states: readonly State[]): readonly State[] {
  const beside = isWhole ? [] : states.flatMap(({ value, isShown }) => (isShown ? [] : [value - 1, value + 1]));
  const known = new Set(states.map(({ value }) => value));
  const others = [...new Set([...own.map(({ value }) => value), ...beside])].filter((value) => !known.has(value)).sort((a, b) => a - b);
  let next = 0;
  const added = others.map((value): State => {
    while (next < states.length && (states[next]?.value ?? 0) < value) next++;
    const [before, after] = [states[next - 1] ?? states[next], states[next] ?? states[next - 1]];
    return { value, isShown: (before?.isShown ?? true) || (after?.isShown ?? true) };
  });
  return [...states, ...added].sort((a, b) => a.value - b.value);
}

// Which of them: where hidden and shown ones meet, on both sides, and of those at which colours change as many as there is
// room for, evenly.
function fewer(values: readonly number[], opacities: readonly number[], coloured: ReadonlySet<number>): readonly number[] | null {
  const isHidden = (i: number): boolean => opacities[i] === 0;
  const isBound = (i: number): boolean => i === 0 || i === values.length - 1 || isHidden(i - 1) !== isHidden(i) || isHidden(i + 1) !== isHidden(i);
  const places = values.map((_, i) => i);
  const bounds = places.filter(isBound);
  if (bounds.length > kMostPoints) return null;
  const others = places.filter((i) => !isHidden(i) && coloured.has(values[i] ?? 0) && !isBound(i));
  const room = kMostPoints - bounds.length;
  const every = Math.ceil(others.length / Math.max(1, room));
  return [...bounds, ...(room === 0 ? [] : others.filter((_, i) => i % every === 0))].sort((a, b) => a - b);
}

// What a function's opacity is at each of these values, which ascend: one walk along both.
export function opacitiesAt(points: Points, values: readonly number[]): readonly number[] {
  let next = 0;
  return values.map((value) => {
    while (next < points.length && (points[next]?.value ?? 0) < value) next++;
    const [a, b] = [points[next - 1] ?? points[0], points[next] ?? points.at(-1)];
    if (a === undefined || b === undefined) return 0;
    return b.value > a.value ? a.opacity + Math.min(1, (value - a.value) / (b.value - a.value)) * (b.opacity - a.opacity) : b.opacity;
  });
}

// As sampleAt, of many points.
export function sampleAlong(points: Points, value: number): TransferPoint {
  let [from, to] = [0, points.length];
  while (from < to) {
    const middle = (from + to) >> 1;
    if ((points[middle]?.value ?? 0) < value) from = middle + 1;
    else to = middle;
  }
  return sampleAt(points.slice(Math.max(0, from - 1), from + 1), value);
}
