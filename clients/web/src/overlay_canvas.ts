// SPDX-License-Identifier: Apache-2.0
// A canvas over the picture. One that shows nothing is not there: an empty one costs a composition of all its pixels a frame.

// Cleared, as large as what it lies in, in CSS pixels; null where there is nothing to draw on it.
export function overlayContext(canvas: HTMLCanvasElement, isWanted: boolean): CanvasRenderingContext2D | null {
  canvas.hidden = !isWanted;
  if (!isWanted) return null;
  const ratio = window.devicePixelRatio;
  const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  const context = canvas.getContext("2d");
  context?.setTransform(ratio, 0, 0, ratio, 0, 0);
  context?.clearRect(0, 0, width, height);
  return context;
}
