// SPDX-License-Identifier: Apache-2.0
// The points of a transfer function over the histogram: value across, opacity up. They are dragged, and moved by keys; a
// double click adds one. Shows what it is told, and reports what a person does.

import { byId, element, part } from "./dom";
import { histogramPath, type ValueScale } from "./histogram_shape";
import { percent } from "./thumb";
import { gradientOf } from "./transfer";
import type { Points } from "./transfer_edit";
import { formatIn, formatValue } from "./units";
import type { Histogram } from "./volume_info";

const kOpacityStep = 0.01;
const kPage = 10; // steps

export interface PlotOwner {
  select(index: number): void;
  move(index: number, value: number, opacity: number): void;
  add(value: number, opacity: number): void;
  addBeside(index: number): void;
  remove(index: number): void;
  released(): void; // a drag is over
}

export class TransferPlot {
  private readonly plot = byId("tf-plot", HTMLElement);
  private readonly area = part(this.plot, ".tf-area", HTMLElement);
  private readonly curve = part(this.plot, ".tf-curve path", SVGPathElement);
  private readonly shape = part(this.plot, ".histogram path", SVGPathElement);
  private readonly bar = byId("tf-bar", HTMLElement);
  private readonly ticks = byId("tf-ticks", HTMLElement);
  private readonly holder = byId("tf-points", HTMLElement);
  private handles: HTMLElement[] = [];
  private points: Points = [];
  private scale: ValueScale = { lo: 0, hi: 1, step: 0.01 };
  private held: HTMLElement | null = null; // the point that is dragged: what is under the pointer must not move away

  constructor(private readonly owner: PlotOwner) {
    this.plot.addEventListener("dblclick", (event) => {
      if (event.target instanceof Element && event.target.closest(".tf-point") !== null) return;
      const { value, opacity } = this.at(event);
      owner.add(value, opacity);
    });
  }

  show(points: Points, selected: number, scale: ValueScale, histogram: Histogram): void {
    this.points = points;
    while (this.handles.length > points.length) this.drop(this.handles.pop());
    if (this.held === null) this.scale = scale;
    while (this.handles.length < points.length) this.addHandle(this.handles.length);
    const { lo, hi } = this.scale;
    const across = (value: number): number => (value - lo) / (hi - lo);
    points.forEach(({ value, colour, opacity }, index) => {
      const handle = this.handles[index];
      if (handle === undefined) return;
      handle.style.left = percent(across(value));
      handle.style.top = percent(1 - opacity);
      handle.style.setProperty("--point", `#${colour}`);
      handle.tabIndex = index === selected ? 0 : -1;
      handle.classList.toggle("selected", index === selected);
      handle.setAttribute("aria-label", `Point ${index + 1} of ${points.length}`);
      handle.setAttribute("aria-valuemin", String(points[index - 1]?.value ?? lo));
      handle.setAttribute("aria-valuemax", String(points[index + 1]?.value ?? hi));
      handle.setAttribute("aria-valuenow", String(value));
      handle.setAttribute("aria-valuetext", `value ${formatIn(value, hi - lo)}, opacity ${formatValue(opacity)}, colour #${colour}`);
    });
    const [first, last] = [points[0], points.at(-1)];
    const stops = points.map(({ value, opacity }) => [across(value), 1 - opacity] as const);
    const line = [[0, 1 - (first?.opacity ?? 0)] as const, ...stops, [1, 1 - (last?.opacity ?? 0)] as const];
    this.curve.setAttribute("d", line.map(([x, y], i) => `${i === 0 ? "M" : "L"}${x.toFixed(4)} ${y.toFixed(4)}`).join(""));
    this.area.style.clipPath = `polygon(0 100%, ${line.map(([x, y]) => `${percent(x)} ${percent(y)}`).join(", ")}, 100% 100%)`;
    this.area.style.background = this.bar.style.background = gradientOf(points, [lo, hi]);
    this.shape.setAttribute("d", histogramPath(histogram, this.scale, true));
    this.ticks.replaceChildren(...[lo, (lo + hi) / 2, hi].map((value) => element("span", {}, formatIn(value, hi - lo))));
  }

  focus(index: number): void {
    this.handles[index]?.focus();
  }

  private at(event: MouseEvent): { readonly value: number; readonly opacity: number } {
    const box = this.holder.getBoundingClientRect();
    const share = (event.clientX - box.left) / box.width;
    const { lo, hi, step } = this.scale;
    const value = lo + Math.round((share * (hi - lo)) / step) * step;
    return { value: Number(value.toPrecision(10)), opacity: Math.round((1 - (event.clientY - box.top) / box.height) * 1000) / 1000 };
  }

  // One that is no more on the page never hears that it lost the pointer.
  private drop(handle: HTMLElement | undefined): void {
    if (handle === this.held) this.held = null;
    handle?.remove();
  }

  private addHandle(index: number): void {
    const handle = element("div", { class: "tf-point", role: "slider", "aria-roledescription": "point of the transfer function", title: "Drag; arrows move, Delete removes" });
    let grip: { readonly value: number; readonly opacity: number } | null = null; // from the pointer to the point, so that nothing jumps
    handle.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      handle.setPointerCapture(event.pointerId);
      const [at, own] = [this.at(event), this.points[index]];
      grip = own === undefined ? null : { value: own.value - at.value, opacity: own.opacity - at.opacity };
      this.held = grip === null ? null : handle;
      this.owner.select(index);
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (grip === null || !handle.hasPointerCapture(event.pointerId)) return;
      const [at, { lo, hi }] = [this.at(event), this.scale];
      this.owner.move(index, Math.max(lo, Math.min(hi, at.value + grip.value)), at.opacity + grip.opacity);
    });
    handle.addEventListener("lostpointercapture", () => {
      grip = null;
      this.held = null;
      this.owner.released();
    });
    handle.addEventListener("focus", () => this.owner.select(index));
    handle.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.pressed(index, event)) return;
      event.preventDefault();
      event.stopPropagation();
    });
    this.handles.push(handle);
    this.holder.append(handle);
  }

  // Whether the key is one of a point's.
  private pressed(index: number, { key, shiftKey }: KeyboardEvent): boolean {
    const own = this.points[index];
    if (own === undefined) return false;
    const step = this.scale.step * (shiftKey ? kPage : 1);
    const by = (value: number, opacity: number): void => this.owner.move(index, Number((own.value + value).toPrecision(10)), Math.round((own.opacity + opacity) * 1000) / 1000);
    if (key === "ArrowRight") by(step, 0);
    else if (key === "ArrowLeft") by(-step, 0);
    else if (key === "ArrowUp") by(0, kOpacityStep);
    else if (key === "ArrowDown") by(0, -kOpacityStep);
    else if (key === "PageUp") by(0, kPage * kOpacityStep);
    else if (key === "PageDown") by(0, -kPage * kOpacityStep);
    else if (key === "Home") this.focus(0);
    else if (key === "End") this.focus(this.points.length - 1);
    else if (key === "Insert") this.owner.addBeside(index);
    else if (key === "Delete" || key === "Backspace") this.owner.remove(index);
    else return false;
    return true;
  }
}
