// SPDX-License-Identifier: Apache-2.0
// The density range of one channel: two thumbs over the histogram, a band between them that moves both, and two number fields.

import { part } from "./dom";
import { histogramPath, positionOf, valueAt, valueScale, type ValueScale } from "./histogram_shape";
import { formatValue } from "./units";
import type { ChannelInfo, Range } from "./volume_info";

type End = 0 | 1; // lo, hi

export class RangeControl {
  private readonly track: HTMLElement;
  private readonly band: HTMLElement;
  private readonly lit: SVGSVGElement;
  private readonly thumbs: readonly [HTMLElement, HTMLElement];
  private readonly inputs: readonly [HTMLInputElement, HTMLInputElement];
  private readonly fault: HTMLElement;
  private readonly scale: ValueScale;
  private range: Range;

  // `row` is a copy of the template of index.html; `unit` the data units between stored values, 0 where they are continuous.
  constructor(row: ParentNode, channel: ChannelInfo, unit: number, private readonly onChange: (range: Range) => void) {
    this.track = part(row, ".range-track", HTMLElement);
    this.band = part(row, ".range-band", HTMLElement);
    this.lit = part(row, ".histogram.lit", SVGSVGElement);
    this.thumbs = [part(row, ".thumb.lo", HTMLElement), part(row, ".thumb.hi", HTMLElement)];
    this.inputs = [part(row, ".value-lo", HTMLInputElement), part(row, ".value-hi", HTMLInputElement)];
    this.fault = part(row, ".fault", HTMLElement);
    this.scale = valueScale(channel.densityRange, unit);
    this.range = channel.defaultRange;
    const path = histogramPath(channel.histogram, this.scale);
    for (const shape of row.querySelectorAll(".histogram path")) shape.setAttribute("d", path);
    for (const end of [0, 1] as const) {
      this.bindThumb(end);
      this.bindInput(end);
    }
    this.bindBand();
  }

  show(range: Range): void {
    this.range = range;
    const [lo, hi] = [positionOf(this.scale, range[0]), positionOf(this.scale, range[1])];
    const percent = (share: number): string => `${(share * 100).toFixed(2)}%`;
    this.band.style.left = percent(lo);
    this.band.style.right = percent(1 - hi);
    this.lit.style.clipPath = `inset(0 ${percent(1 - hi)} 0 ${percent(lo)})`;
    for (const end of [0, 1] as const) {
      const thumb = this.thumbs[end];
      thumb.style.left = percent(end === 0 ? lo : hi);
      thumb.setAttribute("aria-valuemin", String(end === 0 ? this.scale.lo : range[0]));
      thumb.setAttribute("aria-valuemax", String(end === 0 ? range[1] : this.scale.hi));
      thumb.setAttribute("aria-valuenow", String(range[end]));
      const input = this.inputs[end];
      if (document.activeElement !== input) input.value = formatValue(range[end]);
    }
  }

  private change(range: Range): void {
    this.setFault(null);
    if (range[0] === this.range[0] && range[1] === this.range[1]) return;
    this.show(range);
    this.onChange(range);
  }

  // A thumb stops at the other one.
  private moveEnd(end: End, value: number): void {
    if (end === 0) this.change([Math.min(value, this.range[1]), this.range[1]]);
    else this.change([this.range[0], Math.max(value, this.range[0])]);
  }

  private share(event: PointerEvent): number {
    const box = this.track.getBoundingClientRect();
    return (event.clientX - box.left) / box.width;
  }

  private bindThumb(end: End): void {
    const thumb = this.thumbs[end];
    let grip = 0; // pointer's distance from the thumb's middle when it was taken, so that nothing jumps
    thumb.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      thumb.setPointerCapture(event.pointerId);
      grip = this.share(event) - positionOf(this.scale, this.range[end]);
      // Where both stand on one spot the last one taken stays reachable.
      this.thumbs.forEach((other) => other.classList.toggle("front", other === thumb));
    });
    thumb.addEventListener("pointermove", (event) => {
      if (thumb.hasPointerCapture(event.pointerId)) this.moveEnd(end, valueAt(this.scale, this.share(event) - grip));
    });
    thumb.addEventListener("keydown", (event) => {
      const value = this.valueAfterKey(event.key, this.range[end]);
      if (value === null) return;
      event.preventDefault();
      this.moveEnd(end, value);
    });
  }

  private valueAfterKey(key: string, value: number): number | null {
    const { lo, hi, step } = this.scale;
    const by = (steps: number): number => Math.max(lo, Math.min(hi, Number((value + steps * step).toPrecision(12))));
    if (key === "ArrowRight" || key === "ArrowUp") return by(1);
    if (key === "ArrowLeft" || key === "ArrowDown") return by(-1);
    if (key === "PageUp") return by(10);
    if (key === "PageDown") return by(-10);
    if (key === "Home") return lo;
    return key === "End" ? hi : null;
  }

  private bindBand(): void {
    let start: { readonly share: number; readonly range: Range } | null = null;
    this.band.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.band.setPointerCapture(event.pointerId);
      start = { share: this.share(event), range: this.range };
    });
    this.band.addEventListener("pointermove", (event) => {
      if (start === null || !this.band.hasPointerCapture(event.pointerId)) return;
      const [lo, hi] = [positionOf(this.scale, start.range[0]), positionOf(this.scale, start.range[1])];
      const shift = Math.max(-lo, Math.min(1 - hi, this.share(event) - start.share));
      this.change([valueAt(this.scale, lo + shift), valueAt(this.scale, hi + shift)]);
    });
    this.band.addEventListener("dblclick", () => this.change([this.scale.lo, this.scale.hi]));
  }

  private bindInput(end: End): void {
    const input = this.inputs[end];
    input.addEventListener("change", () => {
      const value = Number(input.value.trim().replace(",", "."));
      const wanted: Range = end === 0 ? [value, this.range[1]] : [this.range[0], value];
      if (input.value.trim() === "" || !Number.isFinite(value)) this.setFault("Type a number, such as 42 or 0.5.");
      else if (wanted[0] > wanted[1]) this.setFault("The lower bound must not be above the upper one.");
      else this.change(wanted);
    });
    input.addEventListener("blur", () => {
      this.setFault(null);
      this.show(this.range);
    });
    input.addEventListener("keydown", (event) => {
      if (event.key === "Escape") {
        input.value = formatValue(this.range[end]);
        this.setFault(null);
      }
    });
  }

  private setFault(text: string | null): void {
    this.fault.textContent = text ?? "";
    this.fault.hidden = text === null;
    for (const input of this.inputs) input.setAttribute("aria-invalid", String(text !== null && input === document.activeElement));
  }
}
