// SPDX-License-Identifier: Apache-2.0
// Handles on the faces of the cut box, over the picture: a drag moves the face along its axis. For pointers alone; keys have
// the sliders. They stand where the faces are in the picture that is shown.

import type { Viewport } from "./camera";
import type { Axis, End } from "./cut_control";
import { byId, element } from "./dom";
import { projectionOf, type Pixel, type Projection } from "./projection";
import type { Vec3 } from "./vector";
import type { Box, ViewState } from "./view_state";

const kLeastPixels = 24; // of the box' length along an axis in the picture: a face seen end on cannot be dragged

interface Handle {
  readonly axis: Axis;
  readonly end: End;
  readonly element: HTMLElement;
}

export class FaceHandles {
  private readonly holder = byId("faces", HTMLElement);
  private readonly wanted = byId("cut-handles", HTMLInputElement);
  private readonly handles: readonly Handle[];
  private shown: { readonly box: Box; readonly project: Projection; readonly viewport: Viewport } | null = null;
  private drag: { readonly handle: Handle; value: number; x: number; y: number } | null = null;

  constructor(private readonly onMove: (axis: Axis, end: End, value: number) => void) {
    this.handles = ([0, 1, 2] as const).flatMap((axis) => (["min", "max"] as const).map((end) => ({ axis, end, element: element("div", { class: `face-handle axis-${"xyz"[axis]}` }) })));
    for (const handle of this.handles) this.bind(handle);
    this.holder.append(...this.handles.map((handle) => handle.element));
    this.wanted.addEventListener("change", () => this.draw());
  }

  show(box: Box | null, view: ViewState, viewport: Viewport): void {
    this.shown = box === null ? null : { box, project: projectionOf(view, viewport), viewport };
    this.draw();
  }

  private draw(): void {
    const { shown } = this;
    this.holder.hidden = !this.wanted.checked || shown === null;
    if (this.holder.hidden || shown === null) return;
    for (const handle of this.handles) {
      const at = shown.project(middleOf(shown.box, handle.axis, shown.box[handle.end][handle.axis]));
      const isIn = at !== null && at[0] > 0 && at[1] > 0 && at[0] < shown.viewport.width && at[1] < shown.viewport.height;
      const way = wayOf(shown.box, handle.axis, shown.project);
      handle.element.hidden = !(isIn && way !== null) && this.drag?.handle !== handle;
      if (at !== null) handle.element.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px)`;
      if (way !== null) handle.element.style.setProperty("--turn", `${Math.atan2(way[1], way[0]).toFixed(3)}rad`);
    }
  }

  private bind(handle: Handle): void {
    const { element: own, axis, end } = handle;
    own.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || this.shown === null) return;
      own.setPointerCapture(event.pointerId);
      this.drag = { handle, value: this.shown.box[end][axis], x: event.clientX, y: event.clientY };
    });
    own.addEventListener("pointermove", (event) => {
      const { drag, shown } = this;
      if (drag === null || shown === null || !own.hasPointerCapture(event.pointerId)) return;
      // How far a world unit at this face goes in the picture: of a pointer that went elsewhere its part along that counts.
      const extent = shown.box.max[axis] - shown.box.min[axis];
      const unit = Math.max(extent * 1e-3, Number.MIN_VALUE);
      const [a, b] = [shown.project(middleOf(shown.box, axis, drag.value)), shown.project(middleOf(shown.box, axis, drag.value + unit))];
      if (a === null || b === null) return;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const squared = dx * dx + dy * dy;
      if (!(squared > 0)) return;
      drag.value += (((event.clientX - drag.x) * dx + (event.clientY - drag.y) * dy) / squared) * unit;
      [drag.x, drag.y] = [event.clientX, event.clientY];
      this.onMove(axis, end, drag.value);
    });
    const release = (): void => {
      this.drag = null;
    };
    own.addEventListener("pointerup", release);
    own.addEventListener("pointercancel", release);
  }
}

// In the middle of the box but for one axis.
function middleOf({ min, max }: Box, axis: Axis, value: number): Vec3 {
  const at = (other: Axis): number => (other === axis ? value : 0.5 * (min[other] + max[other]));
  return [at(0), at(1), at(2)];
}

// Where an axis goes in the picture, pixels; null where it comes towards who looks.
function wayOf(box: Box, axis: Axis, project: Projection): Pixel | null {
  const [a, b] = [project(middleOf(box, axis, box.min[axis])), project(middleOf(box, axis, box.max[axis]))];
  if (a === null || b === null || Math.hypot(b[0] - a[0], b[1] - a[1]) < kLeastPixels) return null;
  return [b[0] - a[0], b[1] - a[1]];
}
