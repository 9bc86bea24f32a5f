// SPDX-License-Identifier: Apache-2.0
// Marks as lines and texts over a picture, in 3D and on slices.

import { cornersOf, labelOf, valueOf, type Mark } from "./marks";
import { formatMeasure, type Ruler } from "./measure";
import type { IndexSpace } from "./index_space";
import type { Pixel } from "./projection";
import { boxEdges, sectionOf, type SlicePlane } from "./slice_plane";
import type { Vec3 } from "./vector";

export interface MarkCanvas {
  readonly context: CanvasRenderingContext2D; // in CSS pixels
  readonly space: IndexSpace;
  readonly ruler: Ruler;
  project(point: Vec3): Pixel | null; // null: it cannot be shown
}

const kHandle = 3.5; // half of a point's side

// Those that lie in the slab; a box that the plane cuts, as the cut.
export function drawMarksOnPlane(canvas: MarkCanvas, plane: SlicePlane, marks: readonly Mark[]): void {
  for (const mark of marks) {
    if (mark.kind === "box") {
      const section = sectionOf(plane, cornersOf(mark, canvas.space));
      if (section.length > 0) drawBoxLines(canvas, mark, section.map((point, i) => [point, section[(i + 1) % section.length] ?? point] as const), section[0]);
    } else if (mark.points.every((point) => Math.abs(plane.locate(point)[2]) <= plane.reach + 1e-9)) {
      drawMark(canvas, mark);
    }
  }
}

export function drawMarksInSpace(canvas: MarkCanvas, marks: readonly Mark[]): void {
  for (const mark of marks) {
    if (mark.kind !== "box") {
      drawMark(canvas, mark);
      continue;
    }
    const corners = cornersOf(mark, canvas.space);
    const lines = boxEdges.flatMap(([a, b]) => {
      const [from, to] = [corners[a], corners[b]];
      return from && to ? [[from, to] as const] : [];
    });
    drawBoxLines(canvas, mark, lines, corners[7]);
  }
}

// What is being made; a box yet without its depth.
export function drawPending(canvas: MarkCanvas, { kind, points }: Pick<Mark, "kind" | "points">): void {
  const mark = { kind: kind === "box" ? ("line" as const) : kind, points, colour: "ffffff", text: "" };
  drawLines(canvas, mark);
  const value = kind === "box" || (kind === "angle" && points.length < 3) ? null : valueOf(mark, canvas.ruler);
  const last = points.at(-1);
  if (value !== null && last && points.length > 1) drawText(canvas, last, formatMeasure(value.value, value.unit), mark.colour);
}

function drawMark(canvas: MarkCanvas, mark: Mark): void {
  drawLines(canvas, mark);
  const at = mark.kind === "angle" ? mark.points[1] : mark.points.at(-1);
  if (at) drawText(canvas, at, labelOf(mark, canvas.ruler), mark.colour);
}

function drawLines({ context, project }: MarkCanvas, { kind, points, colour }: Mark): void {
  const pixels = points.map(project);
  context.beginPath();
  const closed = kind === "area" && points.length > 2 ? [...pixels, pixels[0] ?? null] : pixels;
  closed.forEach((pixel, i) => {
    if (pixel === null) return;
    if (i === 0 || closed[i - 1] === null) context.moveTo(...pixel);
    else context.lineTo(...pixel);
  });
  strokeCased(context, colour);
  context.fillStyle = `#${colour}`;
  if (kind === "text") return;
  for (const pixel of pixels) {
    if (pixel !== null) context.fillRect(pixel[0] - kHandle, pixel[1] - kHandle, 2 * kHandle, 2 * kHandle);
  }
}

// On a dark line, so that it shows on every ground.
function strokeCased(context: CanvasRenderingContext2D, colour: string): void {
  for (const [width, style] of [[3.5, "rgb(0 0 0 / 60%)"], [1.5, `#${colour}`]] as const) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke();
  }
}

function drawBoxLines(canvas: MarkCanvas, mark: Mark, lines: readonly (readonly [Vec3, Vec3])[], at: Vec3 | undefined): void {
  const { context, project } = canvas;
  context.beginPath();
  for (const [from, to] of lines) {
    const [a, b] = [project(from), project(to)];
    if (a === null || b === null) continue;
    context.moveTo(...a);
    context.lineTo(...b);
  }
  strokeCased(context, mark.colour);
  if (at) drawText(canvas, at, mark.text, mark.colour);
}

function drawText({ context, project }: MarkCanvas, point: Vec3, text: string, colour: string): void {
  const at = project(point);
  if (at === null || text === "") return;
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "bottom";
  context.lineJoin = "round";
  context.lineWidth = 3;
  context.strokeStyle = "rgb(0 0 0 / 75%)";
  context.strokeText(text, at[0] + 7, at[1] - 5);
  context.fillStyle = `#${colour}`;
  context.fillText(text, at[0] + 7, at[1] - 5);
}
