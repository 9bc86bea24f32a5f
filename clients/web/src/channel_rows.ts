// SPDX-License-Identifier: Apache-2.0
// A row for each channel of the volume: whether it is drawn, its colour and name, and its range. A volume of one channel
// has the range alone.

import { byId, part } from "./dom";
import { RangeControl } from "./range_control";
import { withDrawn, withRange, type ViewChange, type ViewState } from "./view_state";
import type { ChannelInfo, VolumeInfo } from "./volume_info";

interface Row {
  readonly element: HTMLElement;
  readonly check: HTMLInputElement;
  readonly range: RangeControl;
}

export class ChannelRows {
  private readonly title = byId("channels-title", HTMLElement);
  private readonly list = byId("channels", HTMLElement);
  private readonly template = byId("channel-row", HTMLTemplateElement);
  private rows: readonly Row[] = [];
  private view: ViewState | null = null; // the one that is shown

  constructor(private readonly onChange: (change: ViewChange) => void) {}

  setVolume({ channels, type }: VolumeInfo): void {
    this.view = null;
    const isSingle = channels.length === 1;
    this.title.textContent = isSingle ? "Density range" : "Channels";
    this.list.classList.toggle("single", isSingle);
    this.rows = channels.map((channel, number) => this.row(channel, number, type === "f32" ? 0 : channel.valueScale));
    this.list.replaceChildren(...this.rows.map((row) => row.element));
  }

  show(view: ViewState): void {
    this.view = view;
    this.rows.forEach(({ element, check, range }, number) => {
      const own = view.ranges[number];
      if (own !== undefined) range.show(own);
      const isDrawn = view.drawn.includes(number);
      element.classList.toggle("undrawn", !isDrawn);
      check.checked = isDrawn;
      // A picture of no channel at all is none the server draws.
      check.disabled = isDrawn && view.drawn.length === 1;
    });
  }

  private row(channel: ChannelInfo, number: number, unit: number): Row {
    const copy = this.template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template's copy is a fragment");
    const element = part(copy, ".channel", HTMLElement);
    element.dataset["channel"] = String(number);
    element.setAttribute("role", "group");
    element.setAttribute("aria-label", channel.name);
    if (channel.colour !== null) element.style.setProperty("--channel", `#${channel.colour}`);
    part(copy, ".channel-name", HTMLElement).textContent = channel.name;
    part(copy, ".channel-head", HTMLElement).title = channel.name;
    const fault = part(copy, ".fault", HTMLElement);
    fault.id = `range-fault-${number}`;
    for (const input of copy.querySelectorAll(".range-values input")) input.setAttribute("aria-describedby", fault.id);
    const check = part(copy, ".channel-head input", HTMLInputElement);
    check.addEventListener("change", () => {
      if (this.view !== null) this.onChange(withDrawn(this.view, number, check.checked));
    });
    const range = new RangeControl(copy, channel, unit, (wanted) => {
      if (this.view !== null) this.onChange(withRange(this.view, number, wanted));
    });
    return { element, check, range };
  }
}
