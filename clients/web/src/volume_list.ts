// SPDX-License-Identifier: Apache-2.0
// The volumes to choose from: the chosen one alone, or all of them with a search; and the facts of the chosen one.

import { byId, element, icon } from "./dom";
import { Thumbnails } from "./thumbnails";
import { formatBytes, formatCount, formatDims, formatShare, formatValue } from "./units";
import type { VolumeInfo, VolumeSummary } from "./volume_info";

const kSearchFrom = 6; // volumes; fewer are seen at once

export class VolumeList {
  private readonly button = byId("picker-button", HTMLButtonElement);
  private readonly current = byId("picker-current", HTMLElement);
  private readonly drawer = byId("picker-list", HTMLElement);
  private readonly search = byId("volume-search", HTMLInputElement);
  private readonly none = byId("volume-none", HTMLElement);
  private readonly list = byId("volumes", HTMLElement);
  private readonly thumbnails: Thumbnails;
  private readonly facts = byId("facts", HTMLElement);
  private readonly title = byId("sheet-title", HTMLButtonElement);
  private shown = ""; // what the list was built from: it is rebuilt only on change, so focus stays

  // `onPick`: the list opens; the panel must be open for it.
  constructor(private readonly onChoose: (id: string) => void, imageAddress: (id: string) => string, private readonly onPick: () => void) {
    this.thumbnails = new Thumbnails(imageAddress);
    for (const button of [this.button, this.title]) button.addEventListener("click", () => this.setOpen(this.drawer.hidden || !document.body.classList.contains("panel-open")));
    this.search.addEventListener("input", () => this.filter());
    this.drawer.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.setOpen(false);
      this.button.focus();
    });
  }

  private setOpen(isOpen: boolean): void {
    this.drawer.hidden = !isOpen;
    for (const button of [this.button, this.title]) button.setAttribute("aria-expanded", String(isOpen));
    if (!isOpen) return;
    this.onPick();
    this.search.value = "";
    this.filter();
    if (!this.search.hidden) this.search.focus({ preventScroll: true });
    this.list.querySelector("[aria-pressed=true]")?.scrollIntoView({ block: "nearest" });
  }

  // By every word of the search, in name or id.
  private filter(): void {
    const words = this.search.value.toLowerCase().split(/\s+/);
    let found = 0;
    for (const item of this.list.querySelectorAll<HTMLElement>(".volume")) {
      const text = `${item.textContent ?? ""} ${item.dataset["volume"] ?? ""}`.toLowerCase();
      const isFound = words.every((word) => text.includes(word));
      item.closest("li")?.toggleAttribute("hidden", !isFound);
      if (isFound) found++;
    }
    this.none.hidden = found > 0 || this.search.value === "";
  }

  show(volumes: readonly VolumeSummary[], chosen: string | null): void {
    const key = JSON.stringify([volumes, chosen]);
    if (key === this.shown) return;
    this.shown = key;
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset["volume"] : undefined;
    this.list.replaceChildren(...volumes.map((volume) => this.item(volume, volume.id === chosen)));
    this.search.hidden = volumes.length < kSearchFrom;
    const own = volumes.find((volume) => volume.id === chosen);
    this.title.textContent = own?.name ?? "Volumes";
    this.button.title = own === undefined ? "" : `${own.name}: choose another volume`;
    this.current.replaceChildren(...(own === undefined ? [element("span", { class: "volume-name" }, "Choose a volume")] : describe(own)));
    this.button.hidden = volumes.length === 0;
    if (own === undefined && volumes.length > 0) this.setOpen(true);
    this.filter();
    if (focused !== undefined) this.list.querySelector<HTMLElement>(`[data-volume="${CSS.escape(focused)}"]`)?.focus();
    else this.list.querySelector("[aria-pressed=true]")?.scrollIntoView({ block: "nearest" });
  }

  showFacts(volume: VolumeInfo): void {
    const rows: readonly (readonly [string, string])[] = [
      ["Size", `${formatDims(volume.dims)} voxels`],
      ["Spacing", `${volume.spacing.map(formatValue).join(" × ")}${volume.lengthUnit === null ? "" : ` ${volume.lengthUnit}`}`],
      ["Type", volume.type],
      ...channelFacts(volume),
      ["Levels", String(volume.levelCount)],
      ["Blocks", formatCount(volume.blockCount)],
      ["Stored", `${formatBytes(volume.storedBytes)} of ${formatBytes(volume.denseBytes)} dense`],
      ...(volume.source === "" ? [] : [["Source", volume.source] as const]),
    ];
    this.facts.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
  }

  private item(volume: VolumeSummary, isChosen: boolean): HTMLElement {
    const button = element(
      "button",
      { type: "button", class: `volume ${volume.state}`, "data-volume": volume.id, "aria-pressed": String(isChosen) },
      volume.state === "ready" ? element("span", { class: "mark-box" }, icon("volume"), this.thumbnails.of(volume.id)) : stateMark(volume),
      ...describe(volume),
    );
    button.title = volume.error ?? volume.name;
    button.addEventListener("click", () => {
      this.setOpen(false);
      this.button.focus({ preventScroll: true });
      this.onChoose(volume.id);
    });
    return element("li", {}, button);
  }
}

function describe(volume: VolumeSummary): readonly HTMLElement[] {
  return [element("span", { class: "volume-name" }, volume.name), element("span", { class: "volume-detail" }, detailOf(volume))];
}

// What is a channel's own: of several a line each, under their names.
function channelFacts({ channels }: VolumeInfo): (readonly [string, string])[] {
  return channels.flatMap(({ name, densityRange: [lo, hi], nonemptyShare }) => {
    const density = `${formatValue(lo)} to ${formatValue(hi)}`;
    if (channels.length > 1) return [[name, `${density}, ${formatShare(nonemptyShare)} non-empty`]];
    return [["Density", density], ["Non-empty", formatShare(nonemptyShare)]];
  });
}

function stateMark(volume: VolumeSummary): Element {
  if (volume.state === "failed") return icon("warning");
  return volume.state === "loading" ? element("span", { class: "spinner small" }) : icon("volume");
}

function detailOf(volume: VolumeSummary): string {
  if (volume.state === "failed") return volume.error ?? "Could not be loaded";
  const parts: string[] = [];
  if (volume.state === "loading") parts.push("loading");
  if (volume.dims !== null) parts.push(formatDims(volume.dims));
  if (volume.type !== null) parts.push(volume.type);
  if (volume.storedBytes !== null) parts.push(formatBytes(volume.storedBytes));
  return parts.join(" · ");
}
