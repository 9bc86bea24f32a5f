// SPDX-License-Identifier: Apache-2.0
// The density range of one channel: two thumbs over the histogram, a band between them that moves both, and two number fields.

import { element, part } from "./dom";
import { histogramPath, positionOf, valueAt, type ValueScale } from "./histogram_shape";
import { bindThumb, percent, shareAt } from "./thumb";
import { formatIn } from "./units";
import type { ChannelInfo, Range } from "./volume_info";

type End = 0 | 1; // lo, hi

export class RangeControl {
  private readonly track: HTMLElement;
  private readonly band: HTMLElement;
  private readonly lit: SVGSVGElement;
  private readonly thumbs: readonly [HTMLElement, HTMLElement];
  private readonly inputs: readonly [HTMLInputElement, HTMLInputElement];
  private readonly fault: HTMLElement;
  private readonly note: HTMLElement;
  private readonly shapes: readonly Element[];
  private range: Range;

  // `row` is a copy of the template of index.html.
  constructor(row: ParentNode, private readonly channel: ChannelInfo, private readonly scale: ValueScale, private readonly onChange: (range: Range) => void) {
    this.track = part(row, ".range-track", HTMLElement);
    this.band = part(row, ".range-band", HTMLElement);
    this.lit = part(row, ".histogram.lit", SVGSVGElement);
    this.thumbs = [part(row, ".thumb.lo", HTMLElement), part(row, ".thumb.hi", HTMLElement)];
    this.inputs = [part(row, ".value-lo", HTMLInputElement), part(row, ".value-hi", HTMLInputElement)];
    this.fault = part(row, ".fault", HTMLElement);
    this.note = part(row, ".note", HTMLElement);
    this.range = channel.defaultRange;
    this.shapes = [...row.querySelectorAll(".histogram path")];
    const { lo, hi } = scale;
    part(row, ".ticks", HTMLElement).replaceChildren(...[lo, (lo + hi) / 2, hi].map((value) => element("span", {}, formatIn(value, hi - lo))));
    part(row, ".reset-range", HTMLButtonElement).addEventListener("click", () => this.change(channel.defaultRange));
    for (const end of [0, 1] as const) {
      this.bindThumb(end);
      this.bindInput(end);
    }
    this.bindBand();
  }

  setHistogram(isLog: boolean): void {
    const path = histogramPath(this.channel.histogram, this.scale, isLog);
    for (const shape of this.shapes) shape.setAttribute("d", path);
  }

  show(range: Range): void {
    this.range = range;
    const [lo, hi] = [positionOf(this.scale, range[0]), positionOf(this.scale, range[1])];
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
      if (document.activeElement !== input && input.getAttribute("aria-invalid") !== "true") input.value = this.format(range[end]);
    }
    this.note.textContent = this.isOutside(range) ? `There are no values there: the data has ${this.format(this.scale.lo)} to ${this.format(this.scale.hi)}.` : "";
    this.note.hidden = this.note.textContent === "";
  }

  private format(value: number): string {
    return formatIn(value, this.scale.hi - this.scale.lo);
  }

  private isOutside([lo, hi]: Range): boolean {
    return lo > this.scale.hi || hi < this.scale.lo;
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

  private bindThumb(end: End): void {
    const thumb = this.thumbs[end];
    bindThumb(thumb, this.track, this.scale, {
      value: () => this.range[end],
      move: (value) => this.moveEnd(end, value),
      // Where both stand on one spot the last one taken stays reachable.
      taken: () => this.thumbs.forEach((other) => other.classList.toggle("front", other === thumb)),
    });
  }

  private bindBand(): void {
    let start: { readonly share: number; readonly range: Range } | null = null;
    this.band.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.band.setPointerCapture(event.pointerId);
      start = { share: shareAt(this.track, event), range: this.range };
    });
    this.band.addEventListener("pointermove", (event) => {
      if (start === null || !this.band.hasPointerCapture(event.pointerId)) return;
      const [lo, hi] = [positionOf(this.scale, start.range[0]), positionOf(this.scale, start.range[1])];
      const shift = Math.max(-lo, Math.min(1 - hi, shareAt(this.track, event) - start.share));
      this.change([valueAt(this.scale, lo + shift), valueAt(this.scale, hi + shift)]);
    });
    this.band.addEventListener("dblclick", () => this.change([this.scale.lo, this.scale.hi]));
  }

  private bindInput(end: End): void {
    const input = this.inputs[end];
    input.addEventListener("change", () => {
      const value = Number(input.value.trim().replace(",", "."));
      const wanted: Range = end === 0 ? [value, this.range[1]] : [this.range[0], value];
      if (input.value.trim() === "" || !Number.isFinite(value)) return this.setFault("Type a number, such as 42 or 0.5.", end);
      // A bound that is typed beyond the other one takes it along.
      this.change(wanted[0] > wanted[1] ? [value, value] : wanted);
      this.show(this.range);
    });
    input.addEventListener("blur", () => {
      if (input.getAttribute("aria-invalid") !== "true") input.value = this.format(this.range[end]);
    });
    input.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.setFault(null);
      input.value = this.format(this.range[end]);
    });
  }

  // `end`: the field that it is the fault of. It stays until something else is said of the range.
  private setFault(text: string | null, end?: End): void {
    this.fault.textContent = text ?? "";
    this.fault.hidden = text === null;
    this.inputs.forEach((input, number) => input.setAttribute("aria-invalid", String(number === end)));
  }
}
