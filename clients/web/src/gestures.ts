// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and keyboard on the canvas, as moves of the camera. Knows nothing of cameras.

import { kZoomPerPinchPixel, pinch, placeOn, type Point } from "./pointers";

export interface Moves {
  orbit(dx: number, dy: number): void; // pixels
  pan(dx: number, dy: number): void; // pixels
  zoom(factor: number, x: number, y: number): void; // of the distance; keeps what is under (x, y)
  point(x: number, y: number): void; // at what is under (x, y)
  reset(): void;
}

const kPixelsPerLine = 16;
const kPixelsPerPage = 400;
const kZoomPerPixel = 0.0016;
const kLongestWheelPixels = 240;
const kKeyOrbitPixels = 24;
const kKeyPanPixels = 40;
const kKeyZoom = 0.85;
const kDoubleTapMs = 300;
const kDoubleTapPixels = 24;

export function bindPointer(canvas: HTMLElement, moves: Moves): void {
  const pointers = new Map<number, Point>();
  const at = (event: MouseEvent): Point => placeOn(canvas, event);
  const taps = new Taps((event) => moves.point(at(event).x, at(event).y));
  let pans = false;

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    pans = event.button !== 0 || event.shiftKey;
    canvas.classList.add("dragging");
    taps.press(event, pointers.size);
    if (event.button === 1) event.preventDefault(); // no autoscroll
  });

  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (before === undefined) return;
    const now = at(event);
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (other !== undefined) pinch(before, now, other, moves);
    else if (pans) moves.pan(now.x - before.x, now.y - before.y);
    else moves.orbit(now.x - before.x, now.y - before.y);
  });

  const release = (event: PointerEvent): void => {
    pointers.delete(event.pointerId);
    taps.release(event);
    if (pointers.size === 0) canvas.classList.remove("dragging");
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", (event) => {
    if (!taps.isTouch) moves.point(at(event).x, at(event).y);
  });

  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const unit = event.deltaMode === 1 ? kPixelsPerLine : event.deltaMode === 2 ? kPixelsPerPage : 1;
      const pixels = Math.max(-kLongestWheelPixels, Math.min(kLongestWheelPixels, event.deltaY * unit));
      const { x, y } = at(event);
      moves.zoom(Math.exp(pixels * (event.ctrlKey ? kZoomPerPinchPixel : kZoomPerPixel)), x, y);
    },
    { passive: false },
  );
}

// Two short taps of one finger on one spot. Where touch-action is none, not every browser makes a double click of them.
class Taps {
  private pressed: Point & { readonly time: number } = { x: 0, y: 0, time: -Infinity };
  private last: Point & { readonly time: number } = { x: 0, y: 0, time: -Infinity };

  isTouch = false; // a browser may make a double click of two taps that were counted here

  constructor(private readonly onDouble: (event: PointerEvent) => void) {}

  press(event: PointerEvent, fingers: number): void {
    this.isTouch = event.pointerType === "touch";
    const isTap = event.pointerType === "touch" && fingers === 1;
    this.pressed = { x: event.clientX, y: event.clientY, time: isTap ? event.timeStamp : -Infinity };
  }

  release(event: PointerEvent): void {
    if (!follows(this.pressed, event)) return;
    const isSecond = follows(this.last, event);
    this.last = { x: event.clientX, y: event.clientY, time: isSecond ? -Infinity : event.timeStamp };
    if (isSecond) this.onDouble(event);
  }
}

function follows(first: Point & { readonly time: number }, event: PointerEvent): boolean {
  const distance = Math.hypot(event.clientX - first.x, event.clientY - first.y);
  return event.timeStamp - first.time < kDoubleTapMs && distance < kDoubleTapPixels;
}

export interface KeyCommands {
  readonly single: ReadonlyMap<string, () => void>; // by the key alone
  readonly withControl: ReadonlyMap<string, () => void>; // with Ctrl or Cmd; "shift+z" with Shift too
  areOn(): boolean; // single keys that are characters; arrows are always
}

// Keys work anywhere on the page except where a control has its own use for them.
export function bindKeys(canvas: HTMLElement, moves: Moves, commands: KeyCommands): void {
  window.addEventListener("keydown", (event) => {
    const target = event.target;
    const within = (selector: string): boolean => target instanceof Element && target.closest(selector) !== null;
    // A dialog just closed may hold the focus until the next picture of the page: only an open one counts.
    if (event.altKey || within("input[type=text], input[type=search], input[type=color], textarea, dialog[open]")) return;
    const usesArrows = within("[role=slider], input, select, summary");
    const usesLetters = within("select") || (event.key === " " && within("button, input, summary, a, [role=button]"));
    let isUsed = false;
    if (event.ctrlKey || event.metaKey) isUsed = command(`${event.shiftKey ? "shift+" : ""}${event.key.toLowerCase()}`, commands.withControl);
    else if (event.key.startsWith("Arrow")) isUsed = !usesArrows && moveByArrow(event, moves);
    else if (commands.areOn() && !usesLetters) isUsed = pressKey(event, canvas, moves, commands.single);
    if (isUsed) event.preventDefault();
  });
}

function command(key: string, commands: ReadonlyMap<string, () => void>): boolean {
  const act = commands.get(key);
  act?.();
  return act !== undefined;
}

function moveByArrow(event: KeyboardEvent, moves: Moves): boolean {
  const dx = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
  const dy = event.key === "ArrowUp" ? -1 : event.key === "ArrowDown" ? 1 : 0;
  if (event.shiftKey) moves.pan(dx * kKeyPanPixels, dy * kKeyPanPixels);
  else moves.orbit(dx * kKeyOrbitPixels, dy * kKeyOrbitPixels);
  return true;
}

function pressKey(event: KeyboardEvent, canvas: HTMLElement, moves: Moves, commands: ReadonlyMap<string, () => void>): boolean {
  const [x, y] = [canvas.clientWidth / 2, canvas.clientHeight / 2];
  if (event.key === "+" || event.key === "=") moves.zoom(kKeyZoom, x, y);
  else if (event.key === "-" || event.key === "_") moves.zoom(1 / kKeyZoom, x, y);
  else if (event.key === "r" || event.key === "R") moves.reset();
  else return !event.repeat && command(event.key.toLowerCase(), commands);
  return true;
}
