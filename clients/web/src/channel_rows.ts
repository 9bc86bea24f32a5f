// SPDX-License-Identifier: Apache-2.0
// A row for each channel of the volume: whether it is drawn, its colour and name, its range and contrast. A volume of one
// channel has range and contrast alone.

import { contrastOf } from "./contrast";
import { ContrastControl } from "./contrast_control";
import { byId, part } from "./dom";
import { valueScale, type ValueScale } from "./histogram_shape";
import { RangeControl } from "./range_control";
import { withDrawn, withRange, withTransfer, type ViewChange, type ViewState } from "./view_state";
import type { ChannelInfo, Range, VolumeInfo } from "./volume_info";

interface Row {
  readonly element: HTMLElement;
  readonly check: HTMLInputElement;
  readonly range: RangeControl;
  readonly contrast: ContrastControl;
}

export class ChannelRows {
  private readonly title = byId("channels-title", HTMLElement);
  private readonly list = byId("channels", HTMLElement);
  private readonly template = byId("channel-row", HTMLTemplateElement);
  private readonly stretchLine = byId("stretch-line", HTMLElement);
  private readonly stretch = byId("stretch", HTMLInputElement); // colours follow the range, or the range only hides
  private readonly log = byId("histogram-log", HTMLInputElement);
  private channels: readonly ChannelInfo[] = [];
  private rows: readonly Row[] = [];
  private view: ViewState | null = null; // the one that is shown

  // `onEdit`: the transfer function of a channel, from this button.
  constructor(private readonly onChange: (change: ViewChange) => void, private readonly onEdit: (number: number, opener: HTMLElement) => void) {
    this.stretch.addEventListener("change", () => {
      if (this.view === null) return;
      if (this.stretch.checked) this.onChange({ transfers: this.view.transfers.map((own, number) => this.stretched(own, number, this.view?.ranges[number])) });
      else this.show(this.view);
    });
    this.log.addEventListener("change", () => this.rows.forEach(({ range }) => range.setHistogram(this.log.checked)));
  }

  // `view` is the first that is shown of it.
  setVolume({ channels, type }: VolumeInfo, view: ViewState): void {
    this.view = null;
    this.stretchLine.hidden = channels.every((channel) => contrastOf(channel, "auto") === null);
    this.channels = channels;
    this.stretch.checked = this.areStretched(view);
    const isSingle = channels.length === 1;
    this.title.textContent = isSingle ? "Density range" : "Channels";
    this.list.classList.toggle("single", isSingle);
    this.rows = channels.map((channel, number) => this.row(channel, number, valueScale(channel.densityRange, type === "f32" ? 0 : channel.valueScale)));
    this.list.replaceChildren(...this.rows.map((row) => row.element));
    for (const { range, element } of this.rows) {
      range.setHistogram(this.log.checked);
      part(element, ".contrast", HTMLDetailsElement).open = isSingle;
    }
  }

  show(view: ViewState): void {
    this.view = view;
    // Colours that were given other ends, by hand or by undoing, follow the range no more.
    if (this.stretch.checked && !this.areStretched(view)) this.stretch.checked = false;
    this.rows.forEach(({ element, check, range, contrast }, number) => {
      const own = view.ranges[number];
      if (own !== undefined) range.show(own);
      contrast.show(view.transfers[number] ?? "auto", this.stretch.checked);
      const isDrawn = view.drawn.includes(number);
      element.classList.toggle("undrawn", !isDrawn);
      check.checked = isDrawn;
      // A picture of no channel at all is none the server draws.
      check.disabled = isDrawn && view.drawn.length === 1;
    });
  }

  private row(channel: ChannelInfo, number: number, scale: ValueScale): Row {
    const copy = this.template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template's copy is a fragment");
    const element = part(copy, ".channel", HTMLElement);
    element.dataset["channel"] = String(number);
    element.setAttribute("role", "group");
    element.setAttribute("aria-label", channel.name);
    if (channel.colour !== null) element.style.setProperty("--channel", `#${channel.colour}`);
    part(copy, ".channel-colour", HTMLInputElement).setAttribute("aria-label", `Colour of ${channel.name}`);
    part(copy, ".channel-name", HTMLElement).textContent = channel.name;
    part(copy, ".channel-head", HTMLElement).title = channel.name;
    for (const slider of copy.querySelectorAll(".range-track [role=slider]")) {
      if (!this.list.classList.contains("single")) slider.setAttribute("aria-label", `${slider.getAttribute("aria-label") ?? ""}, ${channel.name}`);
    }
    const fault = part(copy, ".fault", HTMLElement);
    fault.id = `range-fault-${number}`;
    for (const input of copy.querySelectorAll(".range-values input")) input.setAttribute("aria-describedby", fault.id);
    const check = part(copy, ".channel-head input", HTMLInputElement);
    check.addEventListener("change", () => {
      if (this.view !== null) this.onChange(withDrawn(this.view, number, check.checked));
    });
    const edit = part(copy, ".edit-transfer", HTMLButtonElement);
    edit.hidden = contrastOf(channel, "auto") === null;
    if (!this.list.classList.contains("single")) edit.setAttribute("aria-label", `Transfer function of ${channel.name}`);
    edit.addEventListener("click", () => this.onEdit(number, edit));
    const range = new RangeControl(copy, channel, scale, (wanted) => {
      if (this.view === null) return;
      const ranged = withRange(this.view, number, wanted);
      if (!this.stretch.checked) return this.onChange(ranged);
      this.onChange({ ...ranged, ...withTransfer(this.view, number, this.stretched(this.view.transfers[number] ?? "auto", number, wanted)) });
    });
    const contrast = new ContrastControl(copy, channel, scale, (transfer) => {
      if (this.view === null) return;
      const held = this.stretch.checked ? this.stretched(transfer, number, this.view.ranges[number]) : transfer;
      this.onChange(withTransfer(this.view, number, held));
    });
    return { element, check, range, contrast };
  }

  // Of those that have a contrast, all.
  private areStretched(view: ViewState): boolean {
    return this.channels.every((channel, number) => contrastOf(channel, view.transfers[number] ?? "auto") === null || follows(channel, view, number));
  }

  private stretched(transfer: string, number: number, range: Range | undefined): string {
    return range === undefined ? transfer : (this.rows[number]?.contrast.stretched(transfer, range) ?? transfer);
  }
}

// Whether a view's colours go from one bound of the range to the other.
function follows(channel: ChannelInfo, view: ViewState, number: number): boolean {
  const window = contrastOf(channel, view.transfers[number] ?? "auto")?.window;
  const range = view.ranges[number];
  return window !== undefined && range !== undefined && window.every((bound, end) => Number(bound.toPrecision(7)) === Number(range[end]?.toPrecision(7)));
}
