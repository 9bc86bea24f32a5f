// SPDX-License-Identifier: Apache-2.0
// Numbers for people.

const kByteUnits = ["B", "kB", "MB", "GB", "TB"];

export function formatBytes(bytes: number): string {
  let value = bytes;
  let unit = 0;
  while (value >= 999.5 && unit < kByteUnits.length - 1) {
    value /= 1000;
    unit++;
  }
  const digits = unit === 0 || value >= 99.5 ? 0 : value >= 9.95 ? 1 : 2;
  return `${value.toFixed(digits)} ${kByteUnits[unit] ?? ""}`;
}

export function formatMs(milliseconds: number): string {
  return milliseconds < 10 ? `${milliseconds.toFixed(1)} ms` : `${Math.round(milliseconds)} ms`;
}

// A data value, short but exact enough to type back in.
export function formatValue(value: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e7) return String(value);
  return String(Number(value.toPrecision(6)));
}

// A value among others that lie so far apart: three digits of the distance.
export function formatIn(value: number, span: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e7) return String(value);
  return String(rounded(value, span, 3));
}

// The value at a share of a range, in as many digits as tell a thousand of them apart; never beyond it.
export function valueIn([lo, hi]: readonly [number, number], share: number): number {
  return Math.min(hi, Math.max(lo, rounded(lo + (hi - lo) * share, hi - lo, 4)));
}

function rounded(value: number, span: number, digits: number): number {
  const before = Math.ceil(Math.log10(Math.abs(value) / (span > 0 ? span : Math.abs(value)))); // that all of them share
  return Number(value.toPrecision(Math.max(digits, Math.min(12, before + digits))));
}

export function formatDims(dims: readonly number[]): string {
  return dims.join(" × ");
}

export function formatCount(count: number): string {
  return count.toLocaleString("en-US");
}

export function formatShare(share: number): string {
  const percent = share * 100;
  return `${percent >= 10 ? percent.toFixed(0) : percent.toPrecision(2)} %`;
}
