// SPDX-License-Identifier: Apache-2.0
// Draws a slice's pictures where their voxels lie, and the crosshair. Where a voxel is larger than a pixel it is a square of
// one colour: nothing is made up between two.

import type { IndexSpace } from "./index_space";
import { pixelOf, type SliceFrame } from "./slice_frame";
import { pictureAxes, type Orientation, type PlanePoint } from "./slice_plane";

export interface PlacedPicture {
  readonly bitmap: ImageBitmap;
  readonly place:
    | { readonly kind: "axis"; readonly space: IndexSpace; readonly orientation: Orientation; readonly level: number; readonly begin: readonly [column: number, row: number] }
    | { readonly kind: "plane"; readonly centre: PlanePoint; readonly pixel: number }; // world length of the picture's pixel
}

type Size = readonly [width: number, height: number];
type Matrix = readonly [a: number, b: number, c: number, d: number, e: number, f: number];

export function clearPane(canvas: HTMLCanvasElement, context: CanvasRenderingContext2D, ratio: number): void {
  const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillStyle = "#000";
  context.fillRect(0, 0, width, height);
}

export function drawPictures(context: CanvasRenderingContext2D, pictures: readonly PlacedPicture[], frame: SliceFrame, size: Size, ratio: number): void {
  for (const { bitmap, place } of pictures) {
    if (bitmap.width === 0) continue; // was given up meanwhile
    const [a, b, c, d, e, f] = place.kind === "axis" ? axisMatrix(place, frame, size) : planeMatrix(place, bitmap, frame, size);
    context.setTransform(a * ratio, b * ratio, c * ratio, d * ratio, e * ratio, f * ratio);
    // Smoothed only where several voxels share a pixel.
    context.imageSmoothingEnabled = ratio * Math.hypot(a, b) < 1 && ratio * Math.hypot(c, d) < 1;
    context.imageSmoothingQuality = "high";
    context.drawImage(bitmap, 0, 0);
  }
}

// From the picture's pixels to those of the pane. Columns and rows of the server's picture are two of the volume's axes; one
// of them goes across here, the other down, either way.
export function axisMatrix({ space, orientation, level, begin }: Extract<PlacedPicture["place"], { kind: "axis" }>, frame: SliceFrame, size: Size): Matrix {
  const { across, down, axis } = orientation;
  const [columns] = pictureAxes(axis);
  const isStraight = across.axis === columns;
  const voxels = 2 ** level;
  const [alongAcross, alongDown] = [(across.sign * space.spacing[across.axis]) / frame.unit, (down.sign * space.spacing[down.axis]) / frame.unit];
  const [x, y] = pixelOf(frame, [0, 0], size);
  const [startAcross, startDown] = isStraight ? begin : [begin[1], begin[0]];
  const [e, f] = [x + startAcross * alongAcross, y + startDown * alongDown];
  return isStraight ? [voxels * alongAcross, 0, 0, voxels * alongDown, e, f] : [0, voxels * alongDown, voxels * alongAcross, 0, e, f];
}

function planeMatrix({ centre, pixel }: Extract<PlacedPicture["place"], { kind: "plane" }>, { width, height }: ImageBitmap, frame: SliceFrame, size: Size): Matrix {
  const [x, y] = pixelOf(frame, centre, size);
  const side = pixel / frame.unit;
  return [side, 0, 0, side, x - (width / 2) * side, y - (height / 2) * side];
}

const kGap = 9; // pixels around the crosshair's place that stay free

// A line for each of the two other slices, in its colour; on a slice that lies anyhow a cross.
export function drawCrosshair(context: CanvasRenderingContext2D, [x, y]: readonly [number, number], orientation: Orientation | null, colours: readonly string[], [width, height]: Size): void {
  const line = (colour: string, x0: number, y0: number, x1: number, y1: number): void => {
    context.strokeStyle = colour;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
  };
  context.lineWidth = 1;
  context.globalAlpha = 0.8;
  const [vertical, horizontal] = orientation === null ? ["#fff", "#fff"] : [colours[orientation.across.axis] ?? "", colours[orientation.down.axis] ?? ""];
  const [left, right, top, bottom] = orientation === null ? [x - 3 * kGap, x + 3 * kGap, y - 3 * kGap, y + 3 * kGap] : [0, width, 0, height];
  line(vertical, x, top, x, y - kGap);
  line(vertical, x, y + kGap, x, bottom);
  line(horizontal, left, y, x - kGap, y);
  line(horizontal, x + kGap, y, right, y);
  context.globalAlpha = 1;
}
