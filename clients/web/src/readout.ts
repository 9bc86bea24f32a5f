// SPDX-License-Identifier: Apache-2.0
// The live figures under the picture, and the badge that says how good it is.

import { byId } from "./dom";
import type { Figures } from "./meter";
import type { FrameHeader } from "./protocol";
import { formatBytes, formatMs } from "./units";

const kAbsent = "Parts of the volume are shown coarser: their voxels are not in memory.";

function quality(header: FrameHeader): string {
  if (!header.complete) return header.final ? "Coarse" : "Loading detail";
  if (!header.final) return "Refining";
  return header.format === "png" ? "Lossless" : "Final";
}

export class Readout {
  private readonly root = byId("readout", HTMLElement);
  private readonly badge = byId("badge", HTMLElement);
  private readonly rate = byId("figure-rate", HTMLElement);
  private readonly latency = byId("figure-latency", HTMLElement);
  private readonly bytes = byId("figure-bytes", HTMLElement);
  private readonly size = byId("figure-size", HTMLElement);
  private readonly level = byId("figure-level", HTMLElement);
  private readonly gpu = byId("figure-gpu", HTMLElement);

  showFrame(header: FrameHeader): void {
    this.root.hidden = false;
    this.badge.textContent = quality(header);
    this.badge.classList.toggle("final", header.final && header.complete);
    this.badge.title = header.complete ? "" : kAbsent;
    const scale = header.scale < 0.995 ? ` · ${Math.round(header.scale * 100)} %` : "";
    this.size.textContent = `${header.width} × ${header.height}${scale}`;
    this.level.textContent = `level ${header.level}`;
    this.gpu.textContent = formatMs(header.gpuMs);
  }

  // A still picture has no rate: zeros would read as a fault.
  showFigures(figures: Figures): void {
    const isMoving = figures.framesPerSecond > 0;
    this.rate.textContent = isMoving ? `${Math.round(figures.framesPerSecond)} fps` : "still";
    this.latency.textContent = figures.latencyMs === null ? "–" : formatMs(figures.latencyMs);
    this.bytes.textContent = `${formatBytes(figures.bytesPerSecond)}/s`;
  }

  clear(): void {
    this.root.hidden = true;
  }
}
