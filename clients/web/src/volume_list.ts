// SPDX-License-Identifier: Apache-2.0
// The volumes to choose from, and the facts of the chosen one.

import { byId, element, icon } from "./dom";
import { formatBytes, formatCount, formatDims, formatShare, formatValue } from "./units";
import type { VolumeInfo, VolumeSummary } from "./volume_info";

export class VolumeList {
  private readonly list = byId("volumes", HTMLElement);
  private readonly facts = byId("facts", HTMLElement);
  private readonly title = byId("sheet-title", HTMLElement);
  private shown = ""; // what the list was built from: it is rebuilt only on change, so focus stays

  constructor(private readonly onChoose: (id: string) => void) {}

  show(volumes: readonly VolumeSummary[], chosen: string | null): void {
    const key = JSON.stringify([volumes, chosen]);
    if (key === this.shown) return;
    this.shown = key;
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset["volume"] : undefined;
    this.list.replaceChildren(...volumes.map((volume) => this.item(volume, volume.id === chosen)));
    this.title.textContent = volumes.find((volume) => volume.id === chosen)?.name ?? "Volumes";
    if (focused === undefined) return;
    this.list.querySelector<HTMLElement>(`[data-volume="${CSS.escape(focused)}"]`)?.focus();
  }

  showFacts(volume: VolumeInfo): void {
    const rows: readonly (readonly [string, string])[] = [
      ["Size", `${formatDims(volume.dims)} voxels`],
      ["Spacing", volume.spacing.map(formatValue).join(" × ")],
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
      stateMark(volume),
      element("span", { class: "volume-name" }, volume.name),
      element("span", { class: "volume-detail" }, detailOf(volume)),
    );
    if (volume.error !== null) button.title = volume.error;
    button.addEventListener("click", () => this.onChoose(volume.id));
    return element("li", {}, button);
  }
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
