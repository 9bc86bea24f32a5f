// SPDX-License-Identifier: Apache-2.0
// The plain controls of the panel: mode, looks, colours, extinction, background. They show a view and report what a person changes.

import { byId } from "./dom";
import { kModes, kPresets } from "./protocol";
import { formatValue } from "./units";
import type { Range, VolumeInfo } from "./volume_info";
import type { ViewChange, ViewState } from "./view_state";

const kLeastExtinction = 0.001;
const kMostExtinction = 10;

export class Controls {
  private readonly modes = byId("modes", HTMLElement);
  private readonly smooth = byId("smooth", HTMLInputElement);
  private readonly lit = byId("lit", HTMLInputElement);
  private readonly isoBlock = byId("iso-block", HTMLElement);
  private readonly isoTitle = byId("iso-title", HTMLElement);
  private readonly iso = byId("iso", HTMLInputElement);
  private readonly isoValue = byId("iso-value", HTMLOutputElement);
  private readonly presetBlock = byId("preset-block", HTMLElement);
  private readonly preset = byId("preset", HTMLSelectElement);
  private isoRange: Range = [0, 1];
  private readonly extinctionBlock = byId("extinction-block", HTMLElement);
  private readonly extinction = byId("extinction", HTMLInputElement);
  private readonly extinctionValue = byId("extinction-value", HTMLOutputElement);
  private readonly backgrounds = byId("backgrounds", HTMLElement);
  private readonly ownBackground = byId("own-background", HTMLInputElement);

  constructor(onChange: (change: ViewChange) => void) {
    this.modes.addEventListener("change", (event) => {
      const wanted = event.target instanceof HTMLInputElement ? event.target.value : "";
      const mode = kModes.find((known) => known === wanted);
      if (mode !== undefined) onChange({ mode });
    });
    this.smooth.addEventListener("change", () => onChange({ filter: this.smooth.checked ? "linear" : "nearest" }));
    this.lit.addEventListener("change", () => onChange({ lit: this.lit.checked }));
    this.iso.addEventListener("input", () => onChange({ iso: this.isoAt(Number(this.iso.value)) }));
    this.iso.addEventListener("dblclick", () => onChange({ iso: null }));
    this.preset.addEventListener("change", () => {
      const tf = kPresets.find((known) => known === this.preset.value);
      if (tf !== undefined) onChange({ tf });
    });
    this.extinction.addEventListener("input", () => onChange({ extinction: extinctionAt(Number(this.extinction.value)) }));
    this.extinction.addEventListener("dblclick", () => onChange({ extinction: 0.2 }));
    this.backgrounds.addEventListener("change", (event) => {
      if (event.target instanceof HTMLInputElement && event.target.type === "radio") onChange({ background: event.target.value });
    });
    this.ownBackground.addEventListener("input", () => onChange({ background: this.ownBackground.value.slice(1) }));
  }

  // Only rgba8 volumes have an extinction, and only blending uses it; only scalars of one channel have colours to choose.
  show(view: ViewState, { type, channels }: VolumeInfo): void {
    const isColoured = type === "rgba8";
    const surfaceOf = view.drawn[0] ?? 0; // the others are not drawn in mode iso
    for (const input of this.modes.querySelectorAll("input")) input.checked = input.value === view.mode;
    this.smooth.checked = view.filter === "linear";
    this.lit.checked = view.lit;
    this.isoRange = view.ranges[surfaceOf] ?? this.isoRange;
    const iso = view.iso ?? (this.isoRange[0] + this.isoRange[1]) / 2;
    this.isoTitle.textContent = channels.length > 1 ? `Surface value of ${channels[surfaceOf]?.name ?? surfaceOf}` : "Surface value";
    this.isoBlock.hidden = view.mode !== "iso";
    this.iso.value = String(positionIn(this.isoRange, iso));
    this.isoValue.textContent = formatValue(iso);
    this.iso.setAttribute("aria-valuetext", formatValue(iso));
    this.presetBlock.hidden = isColoured || channels.length > 1 || view.mode === "blocks";
    this.preset.value = view.tf;
    this.extinctionBlock.hidden = !isColoured || view.mode !== "blend";
    this.extinction.value = String(positionOfExtinction(view.extinction));
    this.extinctionValue.textContent = formatValue(view.extinction);
    this.extinction.setAttribute("aria-valuetext", formatValue(view.extinction));
    let isPreset = false;
    for (const input of this.backgrounds.querySelectorAll<HTMLInputElement>("input[type=radio]")) {
      input.checked = input.value === view.background;
      isPreset ||= input.checked;
    }
    this.ownBackground.value = `#${view.background}`;
    this.ownBackground.classList.toggle("chosen", !isPreset);
  }

  // Four digits are enough to come back to a value.
  private isoAt(position: number): number {
    const [lo, hi] = this.isoRange;
    return Number((lo + ((hi - lo) * position) / 1000).toPrecision(4));
  }
}

function positionIn([lo, hi]: Range, value: number): number {
  return hi > lo ? Math.round((1000 * (value - lo)) / (hi - lo)) : 500;
}

// Slider positions 0..1000, logarithmic: extinction is felt in factors. Two digits are enough to come back to a value.
function extinctionAt(position: number): number {
  const value = kLeastExtinction * (kMostExtinction / kLeastExtinction) ** (position / 1000);
  return Number(value.toPrecision(2));
}

function positionOfExtinction(extinction: number): number {
  const share = Math.log(extinction / kLeastExtinction) / Math.log(kMostExtinction / kLeastExtinction);
  return Math.round(1000 * share);
}
