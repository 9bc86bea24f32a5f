// SPDX-License-Identifier: Apache-2.0
// What gestures on the picture and on slices share: places of pointers, and two fingers.

export interface Point {
  readonly x: number; // pixels
  readonly y: number;
}

export const kZoomPerPinchPixel = 0.012; // a trackpad's pinch arrives as a wheel with ctrl and small steps

export function apart(a: Point, b: Point): number {
  return Math.hypot(a.x - b.x, a.y - b.y);
}

export function placeOn(canvas: HTMLElement, event: MouseEvent): Point {
  const box = canvas.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
}

// One of two fingers moved: their middle pans, their distance zooms about the middle.
export function pinch(before: Point, now: Point, other: Point, moves: { pan(dx: number, dy: number): void; zoom(factor: number, x: number, y: number): void }): void {
  moves.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
  moves.zoom(Math.max(1, apart(before, other)) / Math.max(1, apart(now, other)), (now.x + other.x) / 2, (now.y + other.y) / 2);
}
