// SPDX-License-Identifier: Apache-2.0
// The editor of a channel's transfer function: plot, exact fields, presets as pictures, files. The points are those of the
// view's text and nowhere else; each change is another text. Only which point is chosen is the editor's own.

import { contrastOf, transferOf, withPreset } from "./contrast";
import { byId, element } from "./dom";
import { DrawnThumbs } from "./drawn_thumbs";
import { valueScale, type ValueScale } from "./histogram_shape";
import { bindFileButton, safeName, saveText } from "./local_files";
import { fittedMap, kMostFileBytes, parseMapFile, writeMapJson } from "./map_files";
import { withMember } from "./members";
import { kPresets, type Preset } from "./protocol";
import { fitsPreset, formatPoints, isPreset, kMostPoints, pointsOf } from "./transfer";
import { besides, inserted, leastGap, moved, recoloured, without, type Edited, type Points } from "./transfer_edit";
import { TransferPlot } from "./transfer_plot";
import type { Toasts } from "./toasts";
import { formatIn } from "./units";
import { imageQuery } from "./url_state";
import { withTransfer, type ViewChange, type ViewState } from "./view_state";
import type { ChannelInfo, VolumeInfo } from "./volume_info";

const kThumbSize = [88, 66] as const;
const kNames: Readonly<Record<Preset, string>> = {
  auto: "Automatic", grey: "Grey", viridis: "Viridis", cividis: "Cividis", inferno: "Inferno", "ct-bone": "CT bone", "ct-soft-tissue": "CT soft", angiography: "Angiography",
};

export class TransferEditor {
  private readonly root = byId("tf-editor", HTMLElement);
  private readonly title = byId("tf-title", HTMLElement);
  private readonly presets = byId("tf-presets", HTMLElement);
  private readonly which = byId("tf-which", HTMLOutputElement);
  private readonly value = byId("tf-value", HTMLInputElement);
  private readonly opacity = byId("tf-opacity", HTMLInputElement);
  private readonly colour = byId("tf-colour", HTMLInputElement);
  private readonly fault = byId("tf-fault", HTMLElement);
  private readonly note = byId("tf-note", HTMLElement);
  private readonly removeButton = byId("tf-remove", HTMLButtonElement);
  private readonly plot: TransferPlot;
  private readonly thumbs = new DrawnThumbs();
  private volume: VolumeInfo | null = null;
  private view: ViewState | null = null;
  private number = 0; // of the channel
  private selected = 0;
  private opener: HTMLElement | null = null;

  constructor(private readonly onChange: (change: ViewChange) => void, private readonly imageAddress: (id: string) => string, private readonly toasts: Toasts) {
    this.plot = new TransferPlot({
      select: (index) => this.select(index),
      move: (index, value, opacity) => this.set(moved(this.points(), index, value, opacity, this.gap())),
      add: (value, opacity) => this.add(inserted(this.points(), value, Math.max(0, Math.min(1, opacity)), this.gap())),
      addBeside: (index) => this.addBeside(index),
      remove: (index) => this.remove(index),
      released: () => this.draw(),
    });
    const on = (id: string, act: () => void): void => byId(id, HTMLButtonElement).addEventListener("click", act);
    on("tf-close", () => this.close());
    on("tf-before", () => this.select(this.selected - 1));
    on("tf-after", () => this.select(this.selected + 1));
    on("tf-add", () => this.addBeside(this.selected));
    on("tf-remove", () => this.remove(this.selected));
    on("tf-save", () => saveText(`${safeName(this.volume?.name ?? "")}-tf.json`, writeMapJson(this.points())));
    bindFileButton(byId("tf-load", HTMLButtonElement), byId("tf-file", HTMLInputElement), kMostFileBytes, (bytes, name) => this.load(bytes, name), (name, detail) =>
      this.toasts.show({ title: `${name} is not read`, detail, field: null }));
    this.value.addEventListener("change", () => this.typed());
    this.opacity.addEventListener("change", () => this.typed());
    this.colour.addEventListener("input", () => this.set(recoloured(this.points(), this.selected, this.colour.value.slice(1))));
    this.root.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.close();
    });
  }

  // Another volume: it is closed, as its channel is gone.
  setVolume(volume: VolumeInfo): void {
    this.close();
    this.volume = volume;
    this.view = null;
  }

  show(view: ViewState): void {
    this.view = view;
    if (!this.root.hidden) this.draw();
  }

  // For a channel, from a button that gets the focus back.
  open(number: number, opener: HTMLElement): void {
    this.number = number;
    this.selected = 0;
    this.opener = opener;
    this.root.hidden = false;
    this.say(null, "");
    this.showPresets();
    this.draw();
    this.plot.focus(0);
  }

  close(): void {
    if (this.root.hidden) return;
    const hadFocus = this.root.contains(document.activeElement);
    this.root.hidden = true;
    this.thumbs.close();
    if (hadFocus) this.opener?.focus();
  }

  private get channel(): ChannelInfo | null {
    return this.volume?.channels[this.number] ?? null;
  }

  private points(): Points {
    return this.channel === null ? [] : pointsOf(this.view?.transfers[this.number] ?? "auto", this.channel);
  }

  // As wide as the data, and as the points that lie beyond it.
  private scale(): ValueScale {
    const { densityRange: [lo, hi], valueScale: unit } = this.channel ?? { densityRange: [0, 1], valueScale: 0 };
    const points = this.points();
    return valueScale([Math.min(lo, points[0]?.value ?? lo), Math.max(hi, points.at(-1)?.value ?? hi)], this.volume?.type === "f32" ? 0 : unit);
  }

  private gap(): number {
    const { lo, hi } = this.scale();
    return leastGap([lo, hi]);
  }

  private draw(): void {
    const { channel } = this;
    if (channel === null || this.view === null) return;
    const [points, scale] = [this.points(), this.scale()];
    this.selected = Math.max(0, Math.min(points.length - 1, this.selected));
    this.title.textContent = this.volume?.channels.length === 1 ? "Transfer function" : `Transfer function of ${channel.name}`;
    this.plot.show(points, this.selected, scale, channel.histogram);
    const own = points[this.selected];
    this.which.textContent = `${this.selected + 1} of ${points.length}`;
    byId("tf-before", HTMLButtonElement).disabled = this.selected === 0;
    byId("tf-after", HTMLButtonElement).disabled = this.selected >= points.length - 1;
    this.removeButton.disabled = points.length < 2;
    if (own === undefined) return;
    if (document.activeElement !== this.value) this.value.value = String(Number(own.value.toPrecision(10)));
    if (document.activeElement !== this.opacity) this.opacity.value = String(Number(own.opacity.toPrecision(4)));
    this.colour.value = `#${own.colour}`;
    const transfer = this.view.transfers[this.number] ?? "auto";
    const name = contrastOf(channel, transfer)?.name ?? transfer;
    for (const button of this.presets.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset["preset"] === name));
  }

  private select(index: number): void {
    const { length } = this.points();
    if (index < 0 || index >= length || index === this.selected) return;
    this.selected = index;
    this.say(null, "");
    this.draw();
  }

  private set(points: Points): void {
    if (this.view === null) return;
    const text = formatPoints(points);
    if (text !== formatPoints(this.points())) this.onChange(withTransfer(this.view, this.number, text));
  }

  private add(edited: Edited | null): void {
    if (edited === null) {
      const isFull = this.points().length >= kMostPoints;
      return this.say(isFull ? `There are ${kMostPoints} points: no more may be.` : "Another point stands there already.", "");
    }
    this.selected = edited.index;
    this.say(null, "");
    this.set(edited.points);
    this.plot.focus(edited.index);
  }

  private addBeside(index: number): void {
    const points = this.points();
    const [{ lo, hi }, only] = [this.scale(), points[0]?.value ?? 0];
    const value = points.length > 1 ? besides(points, index) : hi - only > only - lo ? (only + hi) / 2 : (only + lo) / 2;
    this.add(inserted(points, Number(value.toPrecision(10)), null, this.gap()));
  }

  private remove(index: number): void {
    const points = this.points();
    if (points.length < 2) return this.say("One point has to stay.", "");
    this.selected = Math.min(index, points.length - 2);
    this.set(without(points, index));
    this.plot.focus(this.selected);
  }

  private typed(): void {
    // As many digits as the text keeps.
    const [value, opacity] = [this.value, this.opacity].map((input) => (input.value.trim() === "" ? NaN : Number(Number(input.value.trim().replace(",", ".")).toPrecision(10))));
    const points = this.points();
    const [before, after] = [points[this.selected - 1]?.value ?? -Infinity, points[this.selected + 1]?.value ?? Infinity];
    if (value === undefined || !Number.isFinite(value)) return this.say("Type a value, such as 42 or 0.5.", "value");
    if (value <= before || value >= after) return this.say(`A point stays between its neighbours: ${placeOf(before, after, this.scale())}.`, "value");
    if (opacity === undefined || !(opacity >= 0 && opacity <= 1)) return this.say("Type an opacity from 0 to 1.", "opacity");
    this.say(null, "");
    this.set(moved(points, this.selected, value, opacity, 0));
  }

  // `field`: whose fault it is.
  private say(fault: string | null, field: "value" | "opacity" | "", note = ""): void {
    this.fault.textContent = fault ?? "";
    this.fault.hidden = fault === null;
    this.value.setAttribute("aria-invalid", String(field === "value"));
    this.opacity.setAttribute("aria-invalid", String(field === "opacity"));
    this.note.textContent = note;
    this.note.hidden = note === "";
  }

  private load(bytes: Uint8Array, name: string): void {
    const { channel } = this;
    if (channel === null) return;
    const now = this.points();
    const contrast = contrastOf(channel, this.view?.transfers[this.number] ?? "auto");
    const { points, notes } = fittedMap(parseMapFile(bytes), now, contrast?.window ?? channel.densityRange);
    const [lo, hi] = channel.densityRange;
    const isBeside = (points[0]?.value ?? lo) > hi || (points.at(-1)?.value ?? hi) < lo;
    const beside = isBeside ? [`Its values are none of this data, which has ${formatIn(lo, hi - lo)} to ${formatIn(hi, hi - lo)}.`] : [];
    this.selected = 0;
    this.set(points);
    this.say(null, "", [`${name}: ${points.length} points.`, ...notes, ...beside].join(" "));
  }

  // Each as it would look now, drawn by the server.
  private showPresets(): void {
    const { channel, view, volume, number } = this;
    if (channel === null || view === null || volume === null) return;
    const contrast = contrastOf(channel, view.transfers[number] ?? "auto");
    const offered = kPresets.filter((name) => fitsPreset(name, channel.densityRange, channel.unit));
    const made = offered.map((name) => {
      const canvas = element("canvas", { width: String(kThumbSize[0]), height: String(kThumbSize[1]), "aria-hidden": "true" });
      const button = element("button", { type: "button", "data-preset": name, "aria-pressed": "false", title: `tf=${name}` }, canvas, element("span", {}, kNames[name]));
      button.addEventListener("click", () => this.choose(name));
      const tf = contrast === null ? name : transferOf(withPreset(contrast, channel, name), channel);
      // This channel alone, so that the picture is of its colours and the address is short.
      const small: ViewState = { ...view, size: kThumbSize, drawn: [number], transfers: view.transfers.map((_, i) => (i === number ? tf : "auto")), others: withMember({}, "time", view.others.time) };
      const query = imageQuery(small, false).replace(/&format=png$/, "&format=jpeg");
      return { button, thumb: { canvas, address: `${this.imageAddress(volume.id)}?${query}` } };
    });
    this.presets.replaceChildren(...made.map(({ button }) => button));
    this.thumbs.want(made.map(({ thumb }) => thumb));
  }

  private choose(name: Preset): void {
    if (this.view === null || this.channel === null) return;
    const contrast = contrastOf(this.channel, this.view.transfers[this.number] ?? "auto");
    const text = contrast === null || !isPreset(name) ? name : transferOf(withPreset(contrast, this.channel, name), this.channel);
    this.selected = 0;
    this.say(null, "");
    this.onChange(withTransfer(this.view, this.number, text));
  }
}

function placeOf(before: number, after: number, { lo, hi }: ValueScale): string {
  if (before === -Infinity) return `below ${formatIn(after, hi - lo)}`;
  return after === Infinity ? `above ${formatIn(before, hi - lo)}` : `${formatIn(before, hi - lo)} to ${formatIn(after, hi - lo)}`;
}
