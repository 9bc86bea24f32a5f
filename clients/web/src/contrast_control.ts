// SPDX-License-Identifier: Apache-2.0
// The contrast of one channel: black and white point over its histogram and as numbers, brightness, opacity, and the
// colours under the histogram.

import { autoWindow, contrastOf, fineBase, transferOf, withColour, type Contrast } from "./contrast";
import { part } from "./dom";
import { positionOf, type ValueScale } from "./histogram_shape";
import { bindThumb, factorAt, percent, positionOfFactor } from "./thumb";
import { gradientOf } from "./transfer";
import { formatIn, formatValue } from "./units";
import type { ChannelInfo, Range } from "./volume_info";

type End = 0 | 1; // black, white
const kGammas = [0.2, 5] as const;
const kOpacities = [0.01, 1] as const;

export class ContrastControl {
  private readonly bar: HTMLElement;
  private readonly fold: HTMLElement;
  private readonly points: readonly [HTMLElement, HTMLElement];
  private readonly inputs: readonly [HTMLInputElement, HTMLInputElement];
  private readonly gamma: HTMLInputElement;
  private readonly gammaValue: HTMLOutputElement;
  private readonly gammaLine: HTMLElement;
  private readonly opacity: HTMLInputElement;
  private readonly opacityValue: HTMLOutputElement;
  private readonly colour: HTMLInputElement;
  private readonly auto: HTMLButtonElement;
  private contrast: Contrast | null = null;

  // `row` is a copy of the template of index.html.
  constructor(row: ParentNode, private readonly channel: ChannelInfo, private readonly scale: ValueScale, private readonly onChange: (transfer: string) => void) {
    this.bar = part(row, ".colour-bar", HTMLElement);
    this.fold = part(row, ".contrast", HTMLElement);
    this.points = [part(row, ".black-point", HTMLElement), part(row, ".white-point", HTMLElement)];
    this.inputs = [part(row, ".black-value", HTMLInputElement), part(row, ".white-value", HTMLInputElement)];
    this.gamma = part(row, ".gamma", HTMLInputElement);
    this.gammaValue = part(row, ".gamma-value", HTMLOutputElement);
    this.gammaLine = part(row, ".gamma-line", HTMLElement);
    this.opacity = part(row, ".opacity", HTMLInputElement);
    this.opacityValue = part(row, ".opacity-value", HTMLOutputElement);
    this.colour = part(row, ".channel-colour", HTMLInputElement);
    const track = part(row, ".range-track", HTMLElement);
    for (const end of [0, 1] as const) {
      bindThumb(this.points[end], track, scale, { value: () => this.contrast?.window[end] ?? 0, move: (value) => this.moveEnd(end, value) });
      this.bindInput(end);
    }
    this.gamma.addEventListener("input", () => this.change({ gamma: factorAt(kGammas, Number(this.gamma.value)) }));
    this.opacity.addEventListener("input", () => this.change({ opacity: factorAt(kOpacities, Number(this.opacity.value)) }));
    this.colour.addEventListener("input", () => this.setColour(this.colour.value.slice(1)));
    this.auto = part(row, ".auto-contrast", HTMLButtonElement);
    this.auto.addEventListener("click", () => this.change({ window: autoWindow(channel.histogram) }));
    part(row, ".reset-contrast", HTMLButtonElement).addEventListener("click", () => this.onChange("auto"));
  }

  // `isHeld`: black and white follow the range, so they have no handles of their own.
  show(transfer: string, isHeld: boolean): void {
    const contrast = contrastOf(this.channel, transfer);
    this.contrast = contrast;
    for (const part of [this.bar, this.fold, ...this.points]) part.hidden = contrast === null;
    this.colour.disabled = contrast === null;
    if (contrast === null) return;
    const { window, gamma, opacity, base, name } = contrast;
    this.bar.style.background = gradientOf(shown(contrast), [this.scale.lo, this.scale.hi]);
    const span = this.scale.hi - this.scale.lo;
    for (const end of [0, 1] as const) {
      const point = this.points[end];
      point.hidden = isHeld;
      this.inputs[end].disabled = isHeld;
      point.style.left = percent(positionOf(this.scale, window[end]));
      point.setAttribute("aria-valuemin", String(end === 0 ? Math.min(this.scale.lo, window[0]) : window[0]));
      point.setAttribute("aria-valuemax", String(end === 0 ? window[1] : Math.max(this.scale.hi, window[1])));
      point.setAttribute("aria-valuenow", String(window[end]));
      if (document.activeElement !== this.inputs[end]) this.inputs[end].value = formatIn(window[end], span);
    }
    this.auto.disabled = isHeld;
    this.gammaLine.hidden = name === "own";
    this.gamma.value = String(positionOfFactor(kGammas, gamma));
    this.gammaValue.textContent = formatValue(gamma);
    this.opacity.value = String(positionOfFactor(kOpacities, Math.max(kOpacities[0], opacity)));
    this.opacityValue.textContent = formatValue(opacity);
    for (const slider of [this.gamma, this.opacity]) slider.setAttribute("aria-valuetext", formatValue(slider === this.gamma ? gamma : opacity));
    this.colour.closest<HTMLElement>(".channel")?.style.setProperty("--channel", `#${base.at(-1)?.colour ?? "ffffff"}`);
    this.colour.value = `#${base.at(-1)?.colour ?? "ffffff"}`;
  }

  // The transfer function whose black and white are a range's bounds; as it is where there is nothing to stretch.
  stretched(transfer: string, range: Range): string {
    const contrast = contrastOf(this.channel, transfer);
    return contrast === null || !(range[1] > range[0]) ? transfer : transferOf({ ...contrast, window: range }, this.channel);
  }

  private setColour(colour: string): void {
    if (this.contrast !== null) this.onChange(transferOf(withColour(this.contrast, this.channel, colour), this.channel));
  }

  private change(change: Partial<Contrast>): void {
    if (this.contrast !== null) this.onChange(transferOf({ ...this.contrast, ...change }, this.channel));
  }

  // A window has a width: at least a step of the slider.
  private moveEnd(end: End, value: number): void {
    const { window: [black, white] } = this.contrast ?? { window: [0, 1] as const };
    const { step } = this.scale;
    this.change({ window: end === 0 ? [Math.min(value, white - step), white] : [black, Math.max(value, black + step)] });
  }

  private bindInput(end: End): void {
    const input = this.inputs[end];
    input.addEventListener("change", () => {
      const value = Number(input.value.trim().replace(",", "."));
      if (this.contrast === null || input.value.trim() === "" || !Number.isFinite(value)) return;
      const [black, white] = this.contrast.window;
      const width = white - black;
      // One typed beyond the other takes it along.
      if (end === 0) this.change({ window: [value, value < white ? white : value + width] });
      else this.change({ window: [black < value ? black : value - width, value] });
    });
    input.addEventListener("blur", () => {
      if (this.contrast !== null) input.value = formatIn(this.contrast.window[end], this.scale.hi - this.scale.lo);
    });
  }
}

function shown({ base: own, window: [black, white], gamma }: Contrast): Contrast["base"] {
  const base = fineBase(own);
  const [lo, hi] = [base[0]?.value ?? 0, base.at(-1)?.value ?? 1];
  return base.map((point) => ({ ...point, value: black + (white - black) * ((point.value - lo) / (hi - lo)) ** (1 / gamma) }));
}
