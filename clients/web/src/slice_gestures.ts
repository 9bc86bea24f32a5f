// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and keys on a slice. Knows nothing of volumes.

import { apart, kZoomPerPinchPixel, pinch, placeOn, type Point } from "./pointers";

export interface SliceMoves {
  press(x: number, y: number): void; // with the tool, CSS pixels of the canvas
  drag(x: number, y: number, dx: number, dy: number): void; // further with the tool
  release(x: number, y: number): void; // the tool
  double(): void; // the second click was a release
  pan(dx: number, dy: number): void;
  zoom(factor: number, x: number, y: number): void; // of what a pixel shows
  scroll(slices: number): void;
  toEnd(end: "first" | "last"): void;
  step(dx: number, dy: number): void; // the crosshair, voxels
  hover(x: number, y: number): void;
  leave(): void;
  fit(): void;
  enter(): boolean; // whether there was something to do with the tool
  finish(): boolean;
  cancel(): boolean;
}

const kWheelPixels = 60; // a slice
const kPixelsPerLine = 30;
const kZoomPerPixel = 0.0025;
const kKeyZoom = 0.8;
const kKeyPanPixels = 40;
const kPageSlices = 10;
const kClickPixels = 5;

export function bindSlicePointer(canvas: HTMLElement, moves: SliceMoves): void {
  const pointers = new Map<number, Point>();
  let begun: (Point & { readonly pans: boolean; pressed: boolean }) | null = null; // null: two fingers, or none
  const at = (event: MouseEvent): Point => placeOn(canvas, event);
  const press = (point: Point): void => {
    if (begun === null || begun.pressed || begun.pans) return;
    begun.pressed = true;
    moves.press(point.x, point.y);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    const isTouch = event.pointerType === "touch";
    begun = pointers.size > 1 ? null : { ...at(event), pans: event.button !== 0 || event.shiftKey, pressed: false };
    if (event.button === 1) event.preventDefault();
    // A finger may be the first of two.
    if (!isTouch) press(at(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    const now = at(event);
    if (before === undefined) return moves.hover(now.x, now.y);
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (other !== undefined) {
      pinch(before, now, other, moves);
    } else if (begun?.pans) {
      moves.pan(now.x - before.x, now.y - before.y);
    } else if (begun !== null && (begun.pressed || apart(now, begun) > kClickPixels)) {
      press(begun);
      moves.drag(now.x, now.y, now.x - before.x, now.y - before.y);
    }
  });
  canvas.addEventListener("pointerup", (event) => {
    pointers.delete(event.pointerId);
    const now = at(event);
    if (begun !== null && !begun.pans) {
      press(now);
      moves.release(now.x, now.y);
    }
    begun = null;
  });
  canvas.addEventListener("pointercancel", (event) => {
    pointers.delete(event.pointerId);
    begun = null;
  });
  canvas.addEventListener("pointerleave", () => moves.leave());
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => moves.double());
  bindWheel(canvas, moves, at);
}

// Down is on through the slices; what is less than a slice is kept for the next turn.
function bindWheel(canvas: HTMLElement, moves: SliceMoves, at: (event: MouseEvent) => Point): void {
  let rest = 0;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 0 ? 1 : kPixelsPerLine);
    if (event.ctrlKey || event.metaKey) {
      const { x, y } = at(event);
      return moves.zoom(Math.exp(pixels * (Math.abs(pixels) >= kWheelPixels ? kZoomPerPixel : kZoomPerPinchPixel)), x, y);
    }
    rest = Math.sign(rest) === -Math.sign(pixels) ? pixels : rest + pixels;
    const slices = Math.trunc(rest / kWheelPixels);
    rest -= slices * kWheelPixels;
    if (slices !== 0) moves.scroll(slices);
  }, { passive: false });
}

// Keys that the page uses elsewhere too stay here while a slice has the focus.
export function bindSliceKeys(canvas: HTMLElement, moves: SliceMoves): void {
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !press(event, canvas, moves)) return;
    event.preventDefault();
    event.stopPropagation();
  });
}

const kArrows: Readonly<Record<string, readonly [number, number]>> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function press(event: KeyboardEvent, canvas: HTMLElement, moves: SliceMoves): boolean {
  const [dx, dy] = kArrows[event.key] ?? [0, 0];
  const [x, y] = [canvas.clientWidth / 2, canvas.clientHeight / 2];
  if (dx !== 0 || dy !== 0) {
    if (event.shiftKey) moves.pan(-dx * kKeyPanPixels, -dy * kKeyPanPixels);
    else moves.step(dx, dy);
  } else if (event.key === "PageDown" || event.key === "PageUp") {
    moves.scroll((event.key === "PageDown" ? 1 : -1) * (event.shiftKey ? kPageSlices : 1));
  } else if (event.key === "Home" || event.key === "End") moves.toEnd(event.key === "Home" ? "first" : "last");
  else if (event.key === "+" || event.key === "=") moves.zoom(kKeyZoom, x, y);
  else if (event.key === "-" || event.key === "_") moves.zoom(1 / kKeyZoom, x, y);
  else if (event.key === "0") moves.fit();
  else if (event.key === "Enter") return event.shiftKey ? moves.finish() : moves.enter();
  else if (event.key === "Escape") return moves.cancel();
  else return false;
  return true;
}
