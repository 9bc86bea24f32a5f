// SPDX-License-Identifier: Apache-2.0
// Decodes frames and draws the newest. One frame is decoded at a time; of those that arrive meanwhile only the newest
// waits, so the picture never goes back and no queue grows. Every frame is given back through `onDone` exactly once, unless
// it was abandoned: then nobody is left to tell.

import type { Frame, FrameHeader } from "./protocol";
import type { Size } from "./view_state";

export interface FrameOutcome {
  readonly header: FrameHeader;
  readonly shown: boolean; // false: a newer one took its place
}

export class FrameCanvas {
  private readonly context: CanvasRenderingContext2D;
  private decoding = false;
  private waiting: Frame | null = null;
  private last: ImageBitmap | null = null;
  private background = "#000000";
  private generation = 0; // grows with every connection, so a frame of an earlier one is not drawn

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onDone: (outcome: FrameOutcome) => void,
    private readonly onBroken: (reason: string) => void,
  ) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
  }

  push(frame: Frame): void {
    if (this.decoding) {
      if (this.waiting !== null) this.onDone({ header: this.waiting.header, shown: false });
      this.waiting = frame;
      return;
    }
    void this.show(frame);
  }

  resize(size: Size): void {
    if (this.canvas.width === size[0] && this.canvas.height === size[1]) return;
    this.canvas.width = size[0];
    this.canvas.height = size[1];
    this.draw();
  }

  setBackground(colour: string): void {
    this.background = `#${colour}`;
  }

  // Forgets the frames under way but keeps the picture: a new connection begins.
  abandon(): void {
    this.generation++;
    this.waiting = null;
  }

  // Forgets the picture too: the next volume does not begin with the last one's.
  clear(): void {
    this.abandon();
    this.last?.close();
    this.last = null;
    this.draw();
  }

  private async show(frame: Frame): Promise<void> {
    this.decoding = true;
    const generation = this.generation;
    const shown = await this.decode(frame, generation);
    this.decoding = false;
    if (generation === this.generation) this.onDone({ header: frame.header, shown });
    const next = this.waiting;
    this.waiting = null;
    if (next !== null) void this.show(next);
  }

  private async decode(frame: Frame, generation: number): Promise<boolean> {
    try {
      const blob = new Blob([frame.payload], { type: `image/${frame.header.format}` });
      const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
      if (generation !== this.generation) {
        bitmap.close();
        return false;
      }
      this.last?.close();
      this.last = bitmap;
      this.draw();
      return true;
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      this.onBroken(`frame ${frame.header.seq} (${frame.header.format}, ${frame.bytes} bytes): ${reason}`);
      return false;
    }
  }

  // A picture of the canvas' shape fills it. One of another shape, while the window is being resized, keeps its height:
  // the field of view is vertical, so that is where the next picture will have things.
  private draw(): void {
    const { width, height } = this.canvas;
    this.context.fillStyle = this.background;
    this.context.fillRect(0, 0, width, height);
    if (this.last === null) return;
    const naturalWidth = (this.last.width / this.last.height) * height;
    const sameShape = Math.abs(naturalWidth - width) <= 0.02 * width;
    const drawnWidth = sameShape ? width : naturalWidth;
    this.context.imageSmoothingEnabled = true;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(this.last, (width - drawnWidth) / 2, 0, drawnWidth, height);
  }
}
