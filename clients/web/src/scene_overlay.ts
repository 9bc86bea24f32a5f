// SPDX-License-Identifier: Apache-2.0
// What is drawn over the picture and belongs to it: the volume's box with ticks, the cut box, and the scale bar. It is
// drawn for the view that a frame shows, so that it turns with the picture and not before it.

import type { Viewport } from "./camera";
import { byId } from "./dom";
import { overlayContext } from "./overlay_canvas";
import { formatLength, projectionOf, roundLength, type Projection } from "./projection";
import { isLightColour, kBarPixels, scaleBarOf } from "./scale_bar";
import { add, scale, subtract, type Vec3 } from "./vector";
import type { Box, ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kTickPixels = 5;
const kMostTicks = 12;
const kLeastEdgePixels = 50; // that has ticks

export class SceneOverlay {
  private readonly canvas = byId("scene", HTMLCanvasElement);
  private readonly bar = byId("scale-bar", HTMLElement);
  private readonly barLine = byId("scale-line", HTMLElement);
  private readonly barText = byId("scale-text", HTMLElement);
  private readonly wantsBox = byId("show-box", HTMLInputElement);
  private readonly wantsFaces = byId("cut-handles", HTMLInputElement); // the cut box has handles, so is drawn
  private shown: { readonly view: ViewState; readonly viewport: Viewport; readonly volume: VolumeInfo } | null = null;

  constructor() {
    for (const wanted of [this.wantsBox, this.wantsFaces]) wanted.addEventListener("change", () => this.draw());
  }

  show(view: ViewState, viewport: Viewport, volume: VolumeInfo): void {
    this.shown = { view, viewport, volume };
    this.draw();
  }

  clear(): void {
    this.shown = null;
    this.draw();
  }

  private draw(): void {
    this.bar.hidden = this.shown === null;
    if (this.shown !== null) this.showBar(this.shown.view, this.shown.viewport, this.shown.volume);
    const context = overlayContext(this.canvas, this.shown !== null && (this.wantsBox.checked || this.wantsFaces.checked));
    if (context === null || this.shown === null) return;
    const { view, viewport, volume } = this.shown;
    const project = projectionOf(view, viewport);
    const isLight = isLightColour(view.background);
    context.lineWidth = 1;
    context.font = "11px system-ui, sans-serif";
    context.strokeStyle = context.fillStyle = isLight ? "rgb(0 0 0 / 65%)" : "rgb(255 255 255 / 65%)";
    if (this.wantsBox.checked) {
      drawBox(context, project, volume.worldBox, view.camera.eye);
      drawTicks(context, project, volume, isLight);
    }
    context.strokeStyle = "rgb(255 180 84 / 85%)";
    if (view.clip !== null || this.wantsFaces.checked) drawBox(context, project, view.clip ?? volume.worldBox, view.camera.eye);
  }

  private showBar(view: ViewState, viewport: Viewport, volume: VolumeInfo): void {
    const bar = scaleBarOf(view, viewport, volume.lengthUnit, kBarPixels);
    this.barLine.style.width = `${bar.pixels.toFixed(1)}px`;
    this.barText.textContent = bar.text;
    this.bar.classList.toggle("on-light", isLightColour(view.background));
    this.bar.title = view.ortho === null ? "At the depth of what the picture turns about; nearer things look larger" : "";
  }
}

const cornerOf = ({ min, max }: Box, bits: number): Vec3 => [bits & 1 ? max[0] : min[0], bits & 2 ? max[1] : min[1], bits & 4 ? max[2] : min[2]];

function line(context: CanvasRenderingContext2D, project: Projection, from: Vec3, to: Vec3): void {
  const [a, b] = [project(from), project(to)];
  if (a === null || b === null) return;
  context.beginPath();
  context.moveTo(...a);
  context.lineTo(...b);
  context.stroke();
}

// Edges that meet in the farthest corner lie behind everything: they are dashed.
function drawBox(context: CanvasRenderingContext2D, project: Projection, box: Box, eye: Vec3): void {
  const hidden = [0, 1, 2].reduce((bits, axis) => ((box.min[axis] ?? 0) + (box.max[axis] ?? 0) > 2 * (eye[axis] ?? 0) ? bits | (1 << axis) : bits), 0);
  for (const axis of [1, 2, 4]) {
    for (const corner of [0, 1, 2, 3, 4, 5, 6, 7].filter((bits) => (bits & axis) === 0)) {
      context.setLineDash(corner === (hidden & ~axis) ? [2, 4] : []);
      line(context, project, cornerOf(box, corner), cornerOf(box, corner | axis));
    }
  }
  context.setLineDash([]);
}

// Along one edge of each direction, at round lengths from its beginning, with a number in the middle.
function drawTicks(context: CanvasRenderingContext2D, project: Projection, volume: VolumeInfo, isLight: boolean): void {
  const { min, max } = volume.worldBox;
  const middle = project(scale(add(min, max), 0.5));
  const longest = Math.max(...subtract(max, min));
  const step = roundLength(longest / 5);
  for (const axis of [0, 1, 2] as const) {
    const edge = outerEdge(project, volume.worldBox, axis);
    const far = [edge[0], edge[1], edge[2]] as [number, number, number];
    far[axis] = max[axis];
    const [begin, end] = [project(edge), project(far)];
    if (begin === null || end === null || Math.hypot(end[0] - begin[0], end[1] - begin[1]) < kLeastEdgePixels) continue;
    const count = Math.min(kMostTicks, Math.floor((max[axis] - min[axis]) / step + 1e-9));
    for (let tick = 1; tick <= count; tick++) {
      const point = [edge[0], edge[1], edge[2]] as [number, number, number];
      point[axis] = min[axis] + tick * step;
      const at = project(point);
      if (at === null || middle === null) continue;
      const away = Math.max(1, Math.hypot(at[0] - middle[0], at[1] - middle[1]));
      const [dx, dy] = [(at[0] - middle[0]) / away, (at[1] - middle[1]) / away];
      context.beginPath();
      context.moveTo(...at);
      context.lineTo(at[0] + dx * kTickPixels, at[1] + dy * kTickPixels);
      context.stroke();
      if (tick !== Math.ceil(count / 2)) continue;
      context.textAlign = dx < -0.3 ? "right" : dx > 0.3 ? "left" : "center";
      context.textBaseline = dy < -0.3 ? "bottom" : dy > 0.3 ? "top" : "middle";
      context.shadowColor = isLight ? "#fff" : "#000";
      context.shadowBlur = 3;
      fillWithin(context, `${"xyz"[axis]} ${formatLength(tick * step, volume.lengthUnit)}`, at[0] + dx * 3 * kTickPixels, at[1] + dy * 3 * kTickPixels);
      context.shadowBlur = 0;
    }
  }
}

// A text that would stand beyond a side of the picture is moved into it.
function fillWithin(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  const { actualBoundingBoxLeft: left, actualBoundingBoxRight: right } = context.measureText(text);
  const width = context.canvas.clientWidth - kTickPixels;
  context.fillText(text, Math.max(kTickPixels + left, Math.min(width - right, x)), y);
}

// Of the four edges along an axis the one whose middle is farthest from the picture's.
function outerEdge(project: Projection, box: Box, axis: 0 | 1 | 2): Vec3 {
  const middle = project(scale(add(box.min, box.max), 0.5)) ?? [0, 0];
  let best: { readonly corner: Vec3; readonly away: number } = { corner: box.min, away: -1 };
  for (const bits of [0, 1, 2, 3, 4, 5, 6, 7].filter((candidate) => (candidate & (1 << axis)) === 0)) {
    const corner = cornerOf(box, bits);
    const at = project(scale(add(corner, cornerOf(box, bits | (1 << axis))), 0.5));
    const away = at === null ? -1 : Math.hypot(at[0] - middle[0], at[1] - middle[1]) + 1e-3 * (at[1] - middle[1]);
    if (away > best.away) best = { corner, away };
  }
  return best.corner;
}

