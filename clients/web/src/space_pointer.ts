// SPDX-License-Identifier: Apache-2.0
// Points of marks in the picture in 3D: a click, not a drag, is what the pixel shows there.

import type { MarkTool } from "./mark_tool";
import type { Vec3 } from "./vector";

const kClickPixels = 5;
const kWhere = "3d"; // all points of a mark are of one picture

export class SpacePointer {
  private begun: { readonly x: number; readonly y: number } | null = null;
  private asking: Promise<void> = Promise.resolve();

  constructor(canvas: HTMLElement, private readonly tool: MarkTool, private readonly pick: (x: number, y: number) => Promise<Vec3 | null>) {
    canvas.addEventListener("pointerdown", (event) => {
      this.begun = event.isPrimary && event.button === 0 && !event.shiftKey ? { x: event.clientX, y: event.clientY } : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      const { begun } = this;
      this.begun = null;
      if (tool.kind === null || begun === null || Math.hypot(event.clientX - begun.x, event.clientY - begun.y) > kClickPixels) return;
      const box = canvas.getBoundingClientRect();
      this.set(event.clientX - box.left, event.clientY - box.top);
    });
    canvas.addEventListener("dblclick", () => {
      if (tool.kind !== null) void this.asking.then(() => tool.finish(true));
    });
    canvas.addEventListener("keydown", (event) => {
      const isUsed = event.key === "Escape" ? tool.cancel() : event.key === "Enter" && tool.finish();
      if (isUsed) event.preventDefault();
    });
  }

  // In the order of the clicks, however long the answers take.
  private set(x: number, y: number): void {
    const { kind } = this.tool;
    const answer = this.pick(x, y);
    this.asking = this.asking.then(async () => {
      const point = await answer;
      if (point !== null && this.tool.kind === kind) this.tool.set(point, kWhere);
    });
  }
}
