// SPDX-License-Identifier: Apache-2.0
// The live figures under the picture, and the badge that says how good it is.

import { byId } from "./dom";
import type { Members } from "./members";
import type { Figures } from "./meter";
import { Fields, FormatError, parseJson } from "./json_fields";
import type { FrameHeader } from "./protocol";
import { formatBytes, formatMs } from "./units";

const kAbsent = "Parts of the volume are shown coarser: their voxels are not in memory.";

const kFull = "Full quality";
const kLateMs = 300; // without a frame, after a change of view
const kAnnounceAfterMs = 1200; // a screen reader is told of what has settled, not of every frame

// What the badge says of a picture, in a person's words. `asked`: the members of the view that are passed on as text.
export function qualityOf(header: FrameHeader, asked: Members): string {
  const samples = Number(asked.samples ?? 1);
  if (!header.complete) return header.final ? "Coarse: parts are not in memory" : "Loading detail";
  if (header.final) return Number(asked.level ?? 0) > 0 ? `Coarse: level ${header.level}, as chosen` : kFull;
  if (header.scale < 0.995) return "Moving";
  return samples > 1 ? `Refining ${Math.round((100 * header.samples) / samples)} %` : "Refining";
}

export class Readout {
  private readonly root = byId("readout", HTMLElement);
  private readonly badge = byId("badge", HTMLButtonElement);
  private readonly figures = byId("figures", HTMLElement);
  private readonly announcer = byId("announcer", HTMLElement);
  private readonly rate = byId("figure-rate", HTMLElement);
  private readonly latency = byId("figure-latency", HTMLElement);
  private readonly bytes = byId("figure-bytes", HTMLElement);
  private readonly size = byId("figure-size", HTMLElement);
  private readonly level = byId("figure-level", HTMLElement);
  private readonly gpu = byId("figure-gpu", HTMLElement);
  private readonly device = byId("figure-device", HTMLElement);
  private isFinal = true;
  private announcement: number | undefined;
  private late: number | undefined;

  constructor() {
    this.badge.addEventListener("click", () => {
      this.figures.hidden = !this.figures.hidden;
      this.badge.setAttribute("aria-expanded", String(!this.figures.hidden));
    });
  }

  // Which device draws: on a CPU the time is that of no GPU.
  async askDevice(address: string): Promise<void> {
    try {
      const response = await fetch(address);
      if (!response.ok) return;
      const device = new Fields(parseJson(await response.text(), "device"), "device");
      this.device.textContent = device.string("kind") === "software" ? "CPU" : "GPU";
      this.device.title = device.string("name");
    } catch (error) {
      if (!(error instanceof FormatError || error instanceof TypeError)) throw error;
    }
  }

  // The picture there is does not show the view any more.
  expectFrame(): void {
    window.clearTimeout(this.announcement);
    this.late ??= window.setTimeout(() => {
      this.badge.textContent = "Drawing";
      this.badge.classList.remove("final");
    }, kLateMs);
  }

  showFrame(header: FrameHeader, asked: Members): void {
    window.clearTimeout(this.late);
    this.late = undefined;
    this.root.hidden = false;
    this.isFinal = header.final;
    const quality = qualityOf(header, asked);
    if (this.badge.textContent !== quality) this.badge.textContent = quality;
    this.badge.classList.toggle("final", quality === kFull);
    this.badge.title = header.complete ? "Figures of the stream" : kAbsent;
    window.clearTimeout(this.announcement);
    if (header.final) this.announcement = window.setTimeout(() => this.announce(quality), kAnnounceAfterMs);
    const scale = header.scale < 0.995 ? ` · ${Math.round(header.scale * 100)} %` : "";
    this.size.textContent = `${header.width} × ${header.height}${scale}`;
    this.level.textContent = `level ${header.level}`;
    this.gpu.textContent = formatMs(header.gpuMs);
  }

  // A still picture has no rate: zeros would read as a fault.
  showFigures(figures: Figures): void {
    const isMoving = figures.framesPerSecond > 0 && !this.isFinal;
    this.rate.textContent = isMoving ? `${Math.round(figures.framesPerSecond)} fps` : "still";
    this.latency.textContent = figures.latencyMs === null ? "–" : formatMs(figures.latencyMs);
    this.bytes.textContent = `${formatBytes(figures.bytesPerSecond)}/s`;
  }

  private announce(text: string): void {
    if (this.announcer.textContent !== text) this.announcer.textContent = text;
  }

  clear(): void {
    for (const timer of [this.late, this.announcement]) window.clearTimeout(timer);
    this.late = undefined;
    this.root.hidden = true;
  }
}
