// SPDX-License-Identifier: Apache-2.0
// The histogram as an SVG path, and the scale between data values and positions 0..1 that it shares with the slider.

import type { Histogram, Range } from "./volume_info";

export interface ValueScale {
  readonly lo: number;
  readonly hi: number;
  readonly step: number; // of one key press, data units
}

// `unit` is the data units between neighbouring stored values, 0 where they are continuous.
export function valueScale(range: Range, unit: number): ValueScale {
  const [lo, hi] = range;
  const span = hi - lo;
  // A volume of one single value still gets a slider, with that value in its middle.
  if (!(span > 0)) return { lo: lo - 0.5, hi: lo + 0.5, step: unit > 0 ? unit : 0.01 };
  if (unit > 0) return { lo, hi, step: Math.max(unit, Math.round(span / unit / 500) * unit) };
  return { lo, hi, step: 10 ** Math.floor(Math.log10(span / 200)) };
}

export function positionOf(scale: ValueScale, value: number): number {
  return Math.max(0, Math.min(1, (value - scale.lo) / (scale.hi - scale.lo)));
}

// The value at a position, on the grid of steps but never off the ends, so that an end is always reachable.
export function valueAt(scale: ValueScale, position: number): number {
  if (position <= 0) return scale.lo;
  if (position >= 1) return scale.hi;
  const steps = Math.round((position * (scale.hi - scale.lo)) / scale.step);
  const value = scale.lo + steps * scale.step;
  return Math.min(scale.hi, Number(value.toPrecision(12)));
}

// Bars in a box of width 1 and height 1, y down. Of logarithmic heights no material hides all others, linear ones show how
// much there is of each.
export function histogramPath(histogram: Histogram, scale: ValueScale, isLog: boolean): string {
  const { counts, lo, hi } = histogram;
  const height = isLog ? Math.log1p : (count: number): number => count;
  const top = height(Math.max(1, ...counts));
  const binWidth = (hi - lo) / counts.length;
  const place = (value: number): number => (value - scale.lo) / (scale.hi - scale.lo);
  let path = "M0 1";
  counts.forEach((count, bin) => {
    const left = hi > lo ? place(lo + bin * binWidth) : 0.45;
    const right = hi > lo ? place(lo + (bin + 1) * binWidth) : 0.55;
    if (right <= 0 || left >= 1 || (hi <= lo && count === 0)) return;
    const y = fixed(1 - height(count) / top);
    path += `V${y}H${fixed(Math.max(0, left))}V${y}H${fixed(Math.min(1, right))}`;
  });
  return `${path}V1Z`;
}

const fixed = (value: number): string => String(Number(value.toFixed(4)));
