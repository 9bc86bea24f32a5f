// SPDX-License-Identifier: Apache-2.0
// Has the server draw a turn of the view, or the way through the bookmarks, and saves what comes.

import { animationBody, bookmarkedViews, kMostKeys, ZipCount, type AnimationOrder, type Way } from "./animation";
import type { Bookmark } from "./bookmarks";
import { byId } from "./dom";
import { safeName, saveBlob } from "./local_files";
import { problemIn } from "./protocol";
import type { Shown } from "./save_dialog";
import type { Toasts } from "./toasts";
import type { Vec3 } from "./vector";
import type { VolumeInfo } from "./volume_info";

const kAxes: Readonly<Record<string, Vec3 | null>> = { up: null, x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

export interface AnimateSource {
  address(id: string): string;
  shown(): Shown | null; // in the size and quality of the dialog
  volume(): VolumeInfo | null;
  bookmarks(): readonly Bookmark[];
}

export class AnimatePanel {
  private readonly form = byId("animate-form", HTMLFormElement);
  private readonly what = byId("animate-what", HTMLSelectElement);
  private readonly axis = byId("animate-axis", HTMLSelectElement);
  private readonly frames = byId("animate-frames", HTMLInputElement);
  private readonly seconds = byId("animate-seconds", HTMLInputElement);
  private readonly format = byId("animate-format", HTMLSelectElement);
  private readonly start = byId("animate-start", HTMLButtonElement);
  private readonly cancel = byId("animate-cancel", HTMLButtonElement);
  private readonly progress = byId("animate-progress", HTMLProgressElement);
  private readonly note = byId("animate-note", HTMLOutputElement);
  private running: AbortController | null = null;

  constructor(private readonly source: AnimateSource, private readonly toasts: Toasts) {
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (this.running === null) void this.make();
    });
    this.form.addEventListener("change", () => this.update());
    this.cancel.addEventListener("click", () => this.stop());
    this.update();
  }

  // What is under way is of a volume that is not there any more.
  stop(): void {
    this.running?.abort();
  }

  private update(): void {
    byId("animate-axis-line", HTMLElement).hidden = this.what.value !== "turn";
    const isRunning = this.running !== null;
    this.start.hidden = isRunning;
    this.cancel.hidden = this.progress.hidden = !isRunning;
  }

  private order(shown: Shown): AnimationOrder | null {
    const volume = this.source.volume();
    if (volume === null) return null;
    const views = this.what.value === "turn" ? [] : bookmarkedViews(this.source.bookmarks(), volume, shown.view.size);
    if (this.what.value !== "turn" && (views.length < 2 || views.length > kMostKeys)) {
      this.note.value = `A way goes through 2 to ${kMostKeys} bookmarks of this volume; there ${views.length === 1 ? "is 1" : `are ${views.length}`}.`;
      return null;
    }
    const way: Way = this.what.value === "turn" ? { kind: "turn", axis: kAxes[this.axis.value] ?? null } : { kind: "bookmarks", views };
    return { frames: this.frames.valueAsNumber, seconds: this.seconds.valueAsNumber, format: this.format.value === "webp" ? "webp" : "zip", way };
  }

  private async make(): Promise<void> {
    const shown = this.source.shown();
    const order = shown === null ? null : this.order(shown);
    if (shown === null || order === null) return;
    const running = (this.running = new AbortController());
    this.progress.removeAttribute("value");
    this.progress.max = order.frames;
    this.note.value = order.format === "webp" ? `Drawing ${order.frames} frames` : "";
    this.update();
    try {
      const file = await this.fetch(shown, order, running.signal);
      if (file !== null) saveBlob(`${safeName(shown.volume)}.${order.format}`, file);
      this.note.value = file === null ? "" : "Saved";
    } catch (error) {
      this.note.value = running.signal.aborted ? "Cancelled" : "";
      if (!running.signal.aborted) this.fail(error);
    } finally {
      this.running = null;
      this.update();
    }
  }

  // Null where the server refuses, which is said.
  private async fetch({ volume, view, isColoured }: Shown, order: AnimationOrder, signal: AbortSignal): Promise<Blob | null> {
    const body = JSON.stringify(animationBody(order, view, isColoured));
    const response = await fetch(this.source.address(volume), { method: "POST", headers: { "content-type": "application/json" }, body, signal });
    if (!response.ok || response.body === null) {
      this.toasts.show(problemIn(await response.text(), "The animation is refused"));
      return null;
    }
    const count = new ZipCount();
    const parts: Blob[] = []; // the browser may keep them outside of its memory
    for (const reader = response.body.getReader(); ; ) {
      const { done, value } = await reader.read();
      if (done) return new Blob(parts, { type: response.headers.get("content-type") ?? "" });
      parts.push(new Blob([value]));
      if (order.format === "webp") continue;
      count.add(value);
      this.progress.value = count.entries;
      this.note.value = `${count.entries} of ${order.frames} frames`;
    }
  }

  private fail(error: unknown): void {
    if (!(error instanceof TypeError)) throw error;
    this.toasts.show({ title: "The animation broke off", detail: "The server ended it, or the connection is lost. Nothing was saved.", field: null });
  }
}
