// SPDX-License-Identifier: Apache-2.0
// The plain controls of the panel: mode, looks, colours, extinction, attenuation, background. They show a view and report what a person changes.

import { byId } from "./dom";
import { kOtherMembers, withMember, type Members } from "./members";
import { kModes } from "./protocol";
import { contrastOf, transferOf, withColour, withPreset } from "./contrast";
import { factorAt, positionOfFactor } from "./thumb";
import { fitsPreset, isPreset } from "./transfer";
import { formatIn, formatValue, valueIn } from "./units";
import type { ChannelInfo, Range, VolumeInfo } from "./volume_info";
import type { ViewChange, ViewState } from "./view_state";

const kExtinctions = [0.001, 10] as const;
const kAttenuations = [0.001, 10] as const;

export class Controls {
  private readonly modes = [...document.querySelectorAll<HTMLInputElement>("input[name=mode]")];
  private readonly smooth = byId("smooth", HTMLInputElement);
  private readonly ortho = byId("ortho", HTMLInputElement);
  private readonly lit = byId("lit", HTMLInputElement);
  private readonly isoBlock = byId("iso-block", HTMLElement);
  private readonly isoTitle = byId("iso-title", HTMLElement);
  private readonly iso = byId("iso", HTMLInputElement);
  private readonly isoValue = byId("iso-value", HTMLOutputElement);
  private readonly presetBlock = byId("preset-block", HTMLElement);
  private readonly preset = byId("preset", HTMLSelectElement);
  private readonly presetColour = byId("preset-colour", HTMLInputElement);
  private channel: ChannelInfo | null = null; // the first
  private transfer = "auto"; // its
  private isoRange: Range = [0, 1];
  private readonly extinctionBlock = byId("extinction-block", HTMLElement);
  private readonly extinction = byId("extinction", HTMLInputElement);
  private readonly extinctionValue = byId("extinction-value", HTMLOutputElement);
  private readonly attenuationBlock = byId("attenuation-block", HTMLElement);
  private readonly attenuation = byId("attenuation", HTMLInputElement);
  private readonly attenuationValue = byId("attenuation-value", HTMLOutputElement);
  private others: Members = {};
  private readonly backgrounds = byId("backgrounds", HTMLElement);
  private readonly ownBackground = byId("own-background", HTMLInputElement);

  constructor(onChange: (change: ViewChange) => void, onOrtho: (isOrtho: boolean) => void) {
    this.ortho.addEventListener("change", () => onOrtho(this.ortho.checked));
    for (const input of this.modes) {
      input.addEventListener("change", () => {
        const mode = kModes.find((known) => known === input.value);
        if (mode !== undefined) onChange({ mode });
      });
    }
    this.smooth.addEventListener("change", () => onChange({ filter: this.smooth.checked ? "linear" : "nearest" }));
    this.lit.addEventListener("change", () => onChange({ lit: this.lit.checked }));
    this.iso.addEventListener("input", () => onChange({ iso: this.isoAt(Number(this.iso.value)) }));
    this.iso.addEventListener("dblclick", () => onChange({ iso: null }));
    this.preset.addEventListener("change", () => {
      const transfer = this.chosenTransfer();
      if (transfer !== null) onChange({ transfers: [transfer] });
    });
    this.presetColour.addEventListener("input", () => {
      const transfer = this.chosenTransfer();
      if (transfer !== null) onChange({ transfers: [transfer] });
    });
    this.extinction.addEventListener("input", () => onChange({ extinction: factorAt(kExtinctions, Number(this.extinction.value)) }));
    this.extinction.addEventListener("dblclick", () => onChange({ extinction: 0.2 }));
    const attenuate = (text: string | undefined): void => onChange({ others: withMember(this.others, "attenuation", text) });
    this.attenuation.addEventListener("input", () => attenuate(String(factorAt(kAttenuations, Number(this.attenuation.value)))));
    this.attenuation.addEventListener("dblclick", () => attenuate(undefined));
    this.backgrounds.addEventListener("change", (event) => {
      if (event.target instanceof HTMLInputElement && event.target.type === "radio") onChange({ background: event.target.value });
    });
    this.ownBackground.addEventListener("input", () => onChange({ background: this.ownBackground.value.slice(1) }));
  }

  // Other colours keep the contrast.
  private chosenTransfer(): string | null {
    const name = this.preset.value;
    const contrast = this.channel === null ? null : contrastOf(this.channel, this.transfer);
    if (this.channel === null || contrast === null) return isPreset(name) ? name : null;
    if (name === "colour") return transferOf(withColour(contrast, this.channel, this.presetColour.value.slice(1)), this.channel);
    return isPreset(name) ? transferOf(withPreset(contrast, this.channel, name), this.channel) : null;
  }

  // Presets in units of other values than this volume's are not offered.
  setVolume({ channels: [channel] }: VolumeInfo): void {
    this.channel = channel ?? null;
    for (const option of this.preset.options) {
      if (option.value === "colour") continue;
      option.hidden = !isPreset(option.value) || (channel !== undefined && !fitsPreset(option.value, channel.densityRange, channel.unit));
      option.disabled = option.hidden;
    }
  }

  // Only rgba8 volumes have an extinction, and only blending uses it; only scalars of one channel have colours to choose.
  show(view: ViewState, { type, channels }: VolumeInfo): void {
    const isColoured = type === "rgba8";
    const surfaceOf = view.drawn[0] ?? 0; // the others are not drawn in mode iso
    for (const input of this.modes) input.checked = input.value === view.mode;
    this.smooth.checked = view.filter === "linear";
    const areLabels = channels.some((channel) => channel.areLabels);
    this.smooth.disabled = areLabels;
    const auto = this.preset.querySelector("option[value=auto]");
    if (auto !== null) auto.textContent = areLabels ? "A colour each label" : "Automatic";
    this.ortho.checked = view.ortho !== null;
    this.lit.checked = view.lit;
    this.isoRange = view.ranges[surfaceOf] ?? this.isoRange;
    const iso = view.iso ?? (this.isoRange[0] + this.isoRange[1]) / 2;
    this.isoTitle.textContent = channels.length > 1 ? `Surface value of ${channels[surfaceOf]?.name ?? surfaceOf}` : "Surface value";
    this.isoBlock.hidden = view.mode !== "iso";
    this.iso.value = String(positionIn(this.isoRange, iso));
    const said = formatIn(iso, this.isoRange[1] - this.isoRange[0]);
    this.isoValue.textContent = said;
    this.iso.setAttribute("aria-valuetext", said);
    this.presetBlock.hidden = isColoured || channels.length > 1 || view.mode === "blocks";
    const [transfer = "auto"] = view.transfers;
    this.transfer = transfer;
    const contrast = this.channel === null ? null : contrastOf(this.channel, transfer);
    this.preset.value = contrast?.name ?? (isPreset(transfer) ? transfer : "own");
    this.presetColour.hidden = contrast?.name !== "colour";
    if (contrast?.name === "colour") this.presetColour.value = `#${contrast.base.at(-1)?.colour ?? "ffffff"}`;
    this.extinctionBlock.hidden = !isColoured || view.mode !== "blend";
    this.extinction.value = String(positionOfFactor(kExtinctions, view.extinction));
    this.extinctionValue.textContent = formatValue(view.extinction);
    this.extinction.setAttribute("aria-valuetext", formatValue(view.extinction));
    this.others = view.others;
    const attenuation = Number(view.others.attenuation ?? kOtherMembers.attenuation);
    this.attenuationBlock.hidden = view.mode !== "attenuated-mip";
    this.attenuation.value = String(Math.max(0, positionOfFactor(kAttenuations, attenuation)));
    this.attenuationValue.textContent = formatValue(attenuation);
    this.attenuation.setAttribute("aria-valuetext", formatValue(attenuation));
    let isSwatch = false;
    for (const input of this.backgrounds.querySelectorAll<HTMLInputElement>("input[type=radio]")) {
      input.checked = input.value === view.background;
      isSwatch ||= input.checked;
    }
    this.ownBackground.value = `#${view.background.slice(0, 6)}`;
    this.ownBackground.classList.toggle("chosen", !isSwatch);
  }

  private isoAt(position: number): number {
    return valueIn(this.isoRange, position / 1000);
  }
}

function positionIn([lo, hi]: Range, value: number): number {
  return hi > lo ? Math.round((1000 * (value - lo)) / (hi - lo)) : 500;
}
