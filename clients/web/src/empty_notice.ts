// SPDX-License-Identifier: Apache-2.0
// Why a picture shows nothing, as the server says it, and the changes that would help.

import { byId, element } from "./dom";
import type { FrameHeader, Reason } from "./protocol";

const kTitles: Readonly<Record<string, string>> = {
  camera: "The volume is out of view",
  range: "Nothing lies in this range",
  tf: "The colours are transparent here",
  extinction: "The opacity is 0",
  iso: "No surface has this value",
  clip: "Everything is cut away",
  channels: "The channels drawn are empty",
  loading: "Still loading",
};
const kRemedies: Readonly<Record<string, string>> = {
  eye: "Reset the camera",
  range: "Reset the range",
  tf: "Reset the colours",
  extinction: "Reset the opacity",
  iso: "Reset the surface value",
  clip: "Remove the cut",
  planes: "Remove the plane",
  channels: "Draw all channels",
};

export class EmptyNotice {
  private readonly root = byId("empty", HTMLElement);
  private readonly title = byId("empty-title", HTMLElement);
  private readonly detail = byId("empty-detail", HTMLElement);
  private readonly remedies = byId("empty-remedies", HTMLElement);
  private shown = "";

  constructor(private readonly onRemedy: (change: Reason["change"]) => void) {}

  // A moving picture may be empty for an instant: what is said is of one that rests.
  show({ reasons, final }: FrameHeader): void {
    const [first, ...others] = reasons;
    if (first === undefined) return this.clear();
    const text = JSON.stringify(reasons);
    if (!final || text === this.shown) return;
    this.shown = text;
    this.title.textContent = kTitles[first.reason] ?? "Nothing to see";
    this.detail.textContent = [first, ...others].map((reason) => reason.detail).join("; ");
    this.remedies.replaceChildren(...reasons.flatMap((reason) => this.button(reason)));
    this.root.hidden = false;
  }

  clear(): void {
    this.root.hidden = true;
    this.shown = "";
  }

  private button({ change }: Reason): HTMLButtonElement[] {
    const names = Object.keys(change);
    const name = names.find((known) => kRemedies[known] !== undefined) ?? names[0];
    if (name === undefined) return [];
    const button = element("button", { type: "button", title: names.map((member) => `${member}=${change[member]}`).join(" ") }, kRemedies[name] ?? `Reset ${name}`);
    button.addEventListener("click", () => this.onRemedy(change));
    return [button];
  }
}
