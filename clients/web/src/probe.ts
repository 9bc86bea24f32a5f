// SPDX-License-Identifier: Apache-2.0
// What lies under the pointer: its place and its values, once the pointer rests. One question at a time, and none while
// the picture moves.

import { byId } from "./dom";
import { fetchPick, type Pick } from "./pick";
import { apart, placeOn, type Point } from "./pointers";
import { formatIn, formatValue } from "./units";
import type { VolumeInfo } from "./volume_info";

const kRestMs = 120;
const kLongPressMs = 500;
const kStillPixels = 3; // as far a pointer that rests may go; a finger is never quite still
const kTimeoutMs = 5000;

export class Probe {
  private readonly text = byId("probe", HTMLElement);
  private timer: number | undefined;
  private question: AbortController | null = null;
  private at: Point | null = null;
  private pressed: Point | null = null; // by a finger

  // `address`: of the question for a pixel; null where nothing can be asked.
  constructor(
    canvas: HTMLElement,
    private readonly address: (x: number, y: number) => string | null,
    private readonly volume: () => VolumeInfo | null,
  ) {
    canvas.addEventListener("pointermove", (event) => {
      const isPressed = event.buttons !== 0;
      const from = isPressed ? this.pressed : this.at;
      const isAway = from === null ? isPressed : apart(placeOn(canvas, event), from) > kStillPixels;
      if (isAway) this.clear();
      if (!isPressed) this.rest(canvas, event, kRestMs);
    });
    canvas.addEventListener("pointerdown", (event) => {
      this.clear();
      if (event.pointerType !== "touch") return;
      this.pressed = placeOn(canvas, event);
      this.rest(canvas, event, kLongPressMs);
    });
    canvas.addEventListener("pointerup", () => window.clearTimeout(this.timer));
    canvas.addEventListener("pointerleave", () => this.clear());
  }

  // The picture is another one: what is under the pointer is asked again once it is still.
  again(): void {
    if (this.at === null) return;
    this.ask(this.at.x, this.at.y);
  }

  // What was said holds no more.
  stale(): void {
    this.question?.abort();
    this.text.hidden = true;
  }

  clear(): void {
    window.clearTimeout(this.timer);
    this.at = null;
    this.pressed = null;
    this.stale();
  }

  private rest(canvas: HTMLElement, event: PointerEvent, afterMs: number): void {
    window.clearTimeout(this.timer);
    const { x, y } = placeOn(canvas, event);
    this.timer = window.setTimeout(() => {
      this.at = { x, y };
      this.ask(x, y);
    }, afterMs);
  }

  private ask(x: number, y: number): void {
    this.question?.abort();
    const address = this.address(x, y);
    if (address === null) return;
    const question = new AbortController();
    this.question = question;
    void fetchPick(address, AbortSignal.any([question.signal, AbortSignal.timeout(kTimeoutMs)])).then((pick) => {
      if (question.signal.aborted) return;
      const volume = this.volume();
      this.text.hidden = pick === null || volume === null;
      if (pick !== null && volume !== null) this.text.textContent = pickText(pick, volume);
    });
  }
}

// "12.5, 3, 40 µm · voxel 25, 6, 80 · 118 HU"
export function pickText({ world, voxel, values }: Pick, volume: VolumeInfo): string {
  const span = Math.max(...volume.worldBox.max.map((bound, axis) => bound - (volume.worldBox.min[axis] ?? 0)));
  const place = world.map((part) => formatIn(part, span)).join(", ");
  const unit = volume.lengthUnit === null ? "" : ` ${volume.lengthUnit.replace("um", "µm")}`;
  const said = values.map((value, number) => {
    const channel = volume.channels[number];
    const label = value === null ? undefined : channel?.labels.get(value);
    const name = values.length > 1 ? `${channel?.name ?? number} ` : "";
    const text = value === null ? "–" : `${formatValue(value)}${channel?.unit ? ` ${channel.unit}` : ""}`;
    return `${name}${text}${label ? ` ${label}` : ""}`;
  });
  return `${place}${unit} · voxel ${voxel.join(", ")} · ${said.join(", ")}`;
}
