// SPDX-License-Identifier: Apache-2.0
// What lies over the picture in 3D: the crosshair's place, the outlines of the slices, and the marks. Drawn for the view that
// a frame shows, as the scene's box is.

import type { Viewport } from "./camera";
import { byId } from "./dom";
import { drawMarksInSpace, drawPending } from "./mark_drawing";
import type { MarkTool } from "./mark_tool";
import { overlayContext } from "./overlay_canvas";
import { projectionOf } from "./projection";
import { boxCorners, facingPlane, orthogonalPlane, sectionOf, type Orientation } from "./slice_plane";
import { indexOf, voxelAt } from "./index_space";
import { stepOf } from "./slice_query";
import type { PaneScene } from "./slice_pane";
import type { Vec3 } from "./vector";
import type { ViewState } from "./view_state";

export interface SpaceScene {
  readonly scene: PaneScene;
  readonly orientations: readonly Orientation[];
  readonly crosshair: Vec3;
  readonly view: ViewState; // the newest, for what is the page's own
}

const kPlace = 7; // pixels of the crosshair's arms

export class MarksOverlay {
  private readonly canvas = byId("marks-scene", HTMLCanvasElement);
  private seen: { readonly view: ViewState; readonly viewport: Viewport } | null = null;
  private space: SpaceScene | null = null;

  constructor(private readonly tool: MarkTool) {}

  frameShown(view: ViewState, viewport: Viewport): void {
    this.seen = { view, viewport };
    this.draw();
  }

  show(space: SpaceScene | null): void {
    this.space = space;
    if (space === null) this.seen = null;
    this.draw();
  }

  draw(): void {
    const { seen, space } = this;
    const isWanted = space !== null && (space.view.slices.layout !== "3d" || space.view.marks.length > 0 || this.tool.pending !== null);
    const context = overlayContext(this.canvas, isWanted && seen !== null);
    if (context === null || seen === null || space === null) return;
    const project = projectionOf(seen.view, seen.viewport);
    if (space.view.slices.layout !== "3d") this.drawSlices(context, space, seen.view, project);
    const marks = { context, space: space.scene.space, ruler: space.scene.ruler, project };
    drawMarksInSpace(marks, space.view.marks);
    if (this.tool.pending !== null) drawPending(marks, this.tool.pending);
  }

  private drawSlices(context: CanvasRenderingContext2D, { scene, orientations, crosshair, view }: SpaceScene, seen: ViewState, project: ReturnType<typeof projectionOf>): void {
    const { space, colours } = scene;
    const corners = boxCorners(space, [0, 0, 0], space.dims);
    const voxel = voxelAt(space, indexOf(space, crosshair));
    const planes = view.slices.layout === "oblique"
      ? [{ plane: facingPlane(space, seen.camera, crosshair, stepOf(space)), colour: "#8fb8ff" }]
      : orientations.map((orientation) => ({ plane: orthogonalPlane(space, orientation, voxel[orientation.axis], 1), colour: colours[orientation.axis] ?? "" }));
    context.lineWidth = 1.25;
    for (const { plane, colour } of planes) {
      const outline = sectionOf(plane, corners).map(project);
      if (outline.length === 0 || outline.some((pixel) => pixel === null)) continue;
      context.strokeStyle = colour;
      context.globalAlpha = 0.75;
      context.beginPath();
      for (const pixel of outline) if (pixel !== null) context.lineTo(...pixel);
      context.closePath();
      context.stroke();
    }
    context.globalAlpha = 1;
    const at = project(crosshair);
    if (at === null) return;
    context.strokeStyle = "#fff";
    context.beginPath();
    for (const [dx, dy] of [[kPlace, 0], [0, kPlace]] as const) {
      context.moveTo(at[0] - dx, at[1] - dy);
      context.lineTo(at[0] + dx, at[1] + dy);
    }
    context.stroke();
  }
}
