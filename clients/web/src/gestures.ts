// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and keyboard on the canvas, as moves of the camera. Knows nothing of cameras.

export interface Moves {
  orbit(dx: number, dy: number): void; // pixels
  pan(dx: number, dy: number): void; // pixels
  zoom(factor: number, x: number, y: number): void; // of the distance; keeps what is under (x, y)
  reset(): void;
}

const kPixelsPerLine = 16;
const kPixelsPerPage = 400;
const kZoomPerPixel = 0.0016;
const kZoomPerPinchPixel = 0.012; // a trackpad's pinch arrives as a wheel with ctrl and small steps
const kLongestWheelPixels = 240;
const kKeyOrbitPixels = 24;
const kKeyPanPixels = 40;
const kKeyZoom = 0.85;
const kDoubleTapMs = 300;
const kDoubleTapPixels = 24;

interface Point {
  readonly x: number;
  readonly y: number;
}

export function bindPointer(canvas: HTMLElement, moves: Moves): void {
  const pointers = new Map<number, Point>();
  const taps = new Taps(() => moves.reset());
  let pans = false;

  const at = (event: MouseEvent): Point => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };

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
  canvas.addEventListener("dblclick", () => moves.reset());

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

// One of two fingers moved: their middle pans, their distance zooms about the middle.
function pinch(before: Point, now: Point, other: Point, moves: Moves): void {
  const middle = (p: Point): Point => ({ x: (p.x + other.x) / 2, y: (p.y + other.y) / 2 });
  const apart = (p: Point): number => Math.max(1, Math.hypot(p.x - other.x, p.y - other.y));
  const [from, to] = [middle(before), middle(now)];
  moves.pan(to.x - from.x, to.y - from.y);
  moves.zoom(apart(before) / apart(now), to.x, to.y);
}

// Two short taps of one finger on one spot. Where touch-action is none, not every browser makes a double click of them.
class Taps {
  private pressed: Point & { readonly time: number } = { x: 0, y: 0, time: -Infinity };
  private last: Point & { readonly time: number } = { x: 0, y: 0, time: -Infinity };

  constructor(private readonly onDouble: () => void) {}

  press(event: PointerEvent, fingers: number): void {
    const isTap = event.pointerType === "touch" && fingers === 1;
    this.pressed = { x: event.clientX, y: event.clientY, time: isTap ? event.timeStamp : -Infinity };
  }

  release(event: PointerEvent): void {
    if (!follows(this.pressed, event)) return;
    const isSecond = follows(this.last, event);
    this.last = { x: event.clientX, y: event.clientY, time: isSecond ? -Infinity : event.timeStamp };
    if (isSecond) this.onDouble();
  }
}

function follows(first: Point & { readonly time: number }, event: PointerEvent): boolean {
  const distance = Math.hypot(event.clientX - first.x, event.clientY - first.y);
  return event.timeStamp - first.time < kDoubleTapMs && distance < kDoubleTapPixels;
}

// Keys work anywhere on the page except where a control has its own use for them.
export function bindKeys(canvas: HTMLElement, moves: Moves, commands: ReadonlyMap<string, () => void>): void {
  window.addEventListener("keydown", (event) => {
    const target = event.target;
    const within = (selector: string): boolean => target instanceof Element && target.closest(selector) !== null;
    // A dialog just closed may hold the focus until the next picture of the page: only an open one counts.
    const isTyping = within("input[type=text], input[type=color], dialog[open]");
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
    const usesArrows = within("[role=slider], input");
    if (event.key.startsWith("Arrow") ? !usesArrows && moveByArrow(event, moves) : pressKey(event, canvas, moves, commands)) {
      event.preventDefault();
    }
  });
}

function moveByArrow(event: KeyboardEvent, moves: Moves): boolean {
  const dx = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
  const dy = event.key === "ArrowUp" ? -1 : event.key === "ArrowDown" ? 1 : 0;
  if (event.shiftKey) moves.pan(dx * kKeyPanPixels, dy * kKeyPanPixels);
  else moves.orbit(dx * kKeyOrbitPixels, dy * kKeyOrbitPixels);
  return true;
}

function pressKey(
  event: KeyboardEvent,
  canvas: HTMLElement,
  moves: Moves,
  commands: ReadonlyMap<string, () => void>,
): boolean {
  const [x, y] = [canvas.clientWidth / 2, canvas.clientHeight / 2];
  if (event.key === "+" || event.key === "=") moves.zoom(kKeyZoom, x, y);
  else if (event.key === "-" || event.key === "_") moves.zoom(1 / kKeyZoom, x, y);
  else if (event.key === "r" || event.key === "R") moves.reset();
  else {
    const command = commands.get(event.key.toLowerCase());
    if (command === undefined || event.repeat) return false;
    command();
  }
  return true;
}
