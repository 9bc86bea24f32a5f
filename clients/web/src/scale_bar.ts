// SPDX-License-Identifier: Apache-2.0
// How long a scale bar is, and one in a picture that is saved.

import { worldPerPixel, type Viewport } from "./camera";
import { formatLength, roundLength } from "./projection";
import type { ViewState } from "./view_state";

export const kBarPixels = 140; // at most, on the screen
const kBarShare = 0.2; // of the width of a picture that is saved, at most

export interface ScaleBar {
  readonly pixels: number;
  readonly text: string;
}

// At the target's depth, which is where things are turned about.
export function scaleBarOf({ camera }: ViewState, viewport: Viewport, lengthUnit: string | null, mostPixels: number): ScaleBar {
  const unit = worldPerPixel(camera, viewport);
  const length = roundLength(mostPixels * unit);
  return { pixels: length / unit, text: formatLength(length, lengthUnit) };
}

// Green is most of what is seen as light.
export const isLightColour = (rrggbb: string): boolean => parseInt(rrggbb.slice(2, 4), 16) > 140;

// The picture of the view with a bar in its corner, in proportion to its size, as a PNG.
export async function withScaleBar(picture: Blob, view: ViewState, lengthUnit: string | null): Promise<Blob> {
  const [width, height] = view.size;
  const bitmap = await createImageBitmap(picture);
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser has no room for a picture of that size");
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const bar = scaleBarOf(view, { width, height, fovDegrees: view.fovDegrees, ortho: view.ortho }, lengthUnit, kBarShare * width);
  const part = Math.min(width, height) / 100; // of the picture
  const [left, bottom, thick] = [3 * part, height - 3 * part, Math.max(1, 0.6 * part)];
  const isLight = isLightColour(view.background);
  context.fillStyle = isLight ? "#000" : "#fff";
  context.shadowColor = isLight ? "#fff" : "#000";
  context.shadowBlur = part;
  context.fillRect(left, bottom - thick, bar.pixels, thick);
  context.font = `${Math.max(8, 3 * part)}px system-ui, sans-serif`;
  context.textBaseline = "bottom";
  context.fillText(bar.text, left, bottom - thick - 0.5 * part);
  return canvas.convertToBlob({ type: "image/png" });
}
