// SPDX-License-Identifier: Apache-2.0
// A thumb on a track of values: dragged by pointer, moved by keys. Its role, name and place are its owner's.

import { positionOf, valueAt, type ValueScale } from "./histogram_shape";

export interface ThumbOwner {
  value(): number;
  move(value: number): void;
  taken?(): void; // by a pointer
}

export function bindThumb(thumb: HTMLElement, track: HTMLElement, scale: ValueScale, owner: ThumbOwner): void {
  let grip = 0; // pointer's distance from the thumb's middle when it was taken, so that nothing jumps
  thumb.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    thumb.setPointerCapture(event.pointerId);
    grip = shareAt(track, event) - positionOf(scale, owner.value());
    owner.taken?.();
  });
  thumb.addEventListener("pointermove", (event) => {
    if (thumb.hasPointerCapture(event.pointerId)) owner.move(valueAt(scale, shareAt(track, event) - grip));
  });
  thumb.addEventListener("keydown", (event) => {
    const value = valueAfterKey(scale, event.key, owner.value());
    if (value === null) return;
    event.preventDefault();
    owner.move(value);
  });
}

// 0 at the left end of the track, 1 at the right.
export function shareAt(track: HTMLElement, event: PointerEvent): number {
  const box = track.getBoundingClientRect();
  return (event.clientX - box.left) / box.width;
}

export const percent = (share: number): string => `${(share * 100).toFixed(2)}%`;

function valueAfterKey({ lo, hi, step }: ValueScale, key: string, value: number): number | null {
  const by = (steps: number): number => Math.max(lo, Math.min(hi, Number((value + steps * step).toPrecision(12))));
  if (key === "ArrowRight" || key === "ArrowUp") return by(1);
  if (key === "ArrowLeft" || key === "ArrowDown") return by(-1);
  if (key === "PageUp") return by(10);
  if (key === "PageDown") return by(-10);
  if (key === "Home") return lo;
  return key === "End" ? hi : null;
}

// Slider positions 0..1000 of what is felt in factors. Two digits are enough to come back to a value.
export function factorAt([least, most]: readonly [number, number], position: number): number {
  return Number((least * (most / least) ** (position / 1000)).toPrecision(2));
}

export function positionOfFactor([least, most]: readonly [number, number], value: number): number {
  return Math.round((1000 * Math.log(value / least)) / Math.log(most / least));
}
