// SPDX-License-Identifier: Apache-2.0
// One slice on the page: which it is, what of it is in sight, its pictures and what is drawn over them.
//
// A pane holds its place and size in the plane alone. Which slice it shows follows from the crosshair, which is part of the view.

import { icon, part } from "./dom";
import { indexOf, kAxes, voxelAt, withPart, worldOf, type Axis, type IndexSpace } from "./index_space";
import { drawMarksOnPlane, drawPending } from "./mark_drawing";
import type { MarkTool } from "./mark_tool";
import type { Ruler } from "./measure";
import { formatLength, roundLength } from "./projection";
import type { Problem } from "./protocol";
import { fittedFrame, panned, pixelOf, pointAt, zoomedAt, type SliceFrame } from "./slice_frame";
import { bindSliceKeys, bindSlicePointer, type SliceMoves } from "./slice_gestures";
import { clearPane, drawCrosshair, drawPictures, type PlacedPicture } from "./slice_picture";
import { facingPlane, orthogonalPlane, type Orientation, type SliceKind, type SlicePlane } from "./slice_plane";
import { axisPictures, ownWindows, planePicture, scrolled, stepOf } from "./slice_query";
import { SliceSource } from "./slice_source";
import { edgeNames, slabText, sliceText } from "./slice_text";
import { add, scale, type Vec3 } from "./vector";
import type { ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export interface PaneScene {
  readonly volume: VolumeInfo;
  readonly space: IndexSpace;
  readonly ruler: Ruler;
  readonly orientation: Orientation | null; // null: a slice that faces the camera
  readonly colours: readonly string[]; // CSS, of the slices across x, y and z
}

export interface PaneEvents {
  moved(crosshair: Vec3, gesture: string): void; // gesture: what the move is a part of, or empty
  maximised(): void;
  hovered(world: Vec3 | null): void;
  problem(problem: Problem): void;
}

const kBarPixels = 90;
const kCornerShare = 0.998; // of the slab: a box ends within it
const kAhead = 2; // slices that are fetched before they are wanted

export class SlicePane implements SliceMoves {
  readonly root: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  private readonly source: SliceSource;
  private readonly context: CanvasRenderingContext2D;
  private readonly slider: HTMLInputElement;
  private scene: PaneScene | null = null;
  private view: ViewState | null = null;
  private crosshair: Vec3 = [0, 0, 0];
  private plane: SlicePlane | null = null;
  private index = 0;
  private sense: 1 | -1 = 1; // which way was scrolled last
  private frame: SliceFrame | null = null; // null: as it fits
  private shown: readonly PlacedPicture[] = []; // drawn last
  private before: { readonly x: number; readonly y: number } | null = null; // where a mark's drag began
  private isScheduled = false;

  constructor(template: HTMLTemplateElement, readonly kind: SliceKind, private readonly tool: MarkTool, private readonly address: (query: string) => string, private readonly events: PaneEvents) {
    const copy = template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template has no content");
    this.root = part(copy, ".slice", HTMLElement);
    this.canvas = part(copy, "canvas", HTMLCanvasElement);
    this.slider = part(copy, ".slice-index", HTMLInputElement);
    this.root.dataset["slice"] = kind;
    const context = this.canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.source = new SliceSource(() => this.schedule(), (problem) => events.problem(problem));
    bindSlicePointer(this.canvas, this);
    bindSliceKeys(this.canvas, this);
    this.slider.addEventListener("input", () => this.toIndex(Number(this.slider.value), this.scrolling));
    part(this.root, ".slice-head", HTMLElement).addEventListener("dblclick", () => events.maximised());
    part(this.root, ".slice-maximise", HTMLButtonElement).append(icon("fullscreen"));
    part(this.root, ".slice-maximise", HTMLButtonElement).addEventListener("click", () => events.maximised());
    new ResizeObserver(() => this.schedule()).observe(this.canvas);
  }

  setScene(scene: PaneScene): void {
    this.source.clear();
    this.scene = scene;
    [this.frame, this.shown, this.view] = [null, [], null];
    const { orientation, colours } = scene;
    const title = orientation?.title ?? "As seen";
    part(this.root, ".slice-title", HTMLElement).textContent = title;
    this.root.setAttribute("aria-label", `${title} slice`);
    this.root.style.setProperty("--slice", orientation === null ? "#8fb8ff" : (colours[orientation.axis] ?? ""));
    this.slider.hidden = orientation === null;
    if (orientation !== null) {
      this.slider.max = String(scene.volume.dims[orientation.axis] - 1);
      this.slider.setAttribute("aria-label", `${title} slice`);
    }
  }

  close(): void {
    this.scene = this.view = this.plane = null;
    this.source.clear();
  }

  show(view: ViewState, crosshair: Vec3): void {
    if (this.scene === null) return;
    this.view = view;
    this.crosshair = crosshair;
    const { space, orientation } = this.scene;
    const { thickness } = view.slices;
    const before = this.index;
    if (orientation === null) {
      this.plane = facingPlane(space, view.camera, crosshair, thickness * stepOf(space));
    } else {
      this.index = voxelAt(space, indexOf(space, crosshair))[orientation.axis];
      if (this.index !== before) this.sense = this.index > before ? 1 : -1;
      this.plane = orthogonalPlane(space, orientation, this.index, thickness);
    }
    this.schedule();
  }

  // The point of the plane under a pixel of the canvas.
  at(x: number, y: number): Vec3 | null {
    return this.plane === null ? null : this.plane.place(pointAt(this.frameNow(this.plane), x, y, this.size));
  }

  press(x: number, y: number): void {
    const point = this.at(x, y);
    this.canvas.focus({ preventScroll: true });
    this.before = { x, y };
    if (this.tool.tool === "crosshair" && point !== null) this.move(point);
  }

  drag(x: number, y: number, dx: number, dy: number): void {
    const point = this.at(x, y);
    if (point === null) return;
    if (this.tool.tool === "move") return this.pan(dx, dy);
    if (this.tool.tool === "crosshair") return this.move(point);
    const { before } = this;
    const begin = before === null ? null : this.at(before.x, before.y);
    // A distance and a box are drawn at one go too.
    if (this.tool.isEmpty && begin !== null && (this.tool.kind === "ruler" || this.tool.kind === "box")) this.tool.set(this.cornerAt(begin), this.kind);
    this.tool.hover(point, this.kind);
  }

  release(x: number, y: number): void {
    const point = this.at(x, y);
    if (this.tool.kind !== null && point !== null) this.tool.set(this.cornerAt(point), this.kind);
  }

  double(): void {
    this.tool.finish(true);
  }

  pan(dx: number, dy: number): void {
    if (this.plane !== null) this.reframe(panned(this.frameNow(this.plane), dx, dy));
  }

  zoom(factor: number, x: number, y: number): void {
    if (this.plane === null || this.scene === null) return;
    const fit = fittedFrame(this.plane, this.size).unit;
    this.reframe(zoomedAt(this.frameNow(this.plane), factor, x, y, this.size, fit, stepOf(this.scene.space)));
  }

  fit(): void {
    this.reframe(null);
  }

  scroll(slices: number): void {
    if (this.scene === null || this.plane === null) return;
    const { space, orientation } = this.scene;
    if (orientation !== null) return this.toIndex(this.index + slices, this.scrolling);
    this.move(scrolled(this.plane, this.crosshair, slices, space), this.scrolling);
  }

  toEnd(end: "first" | "last"): void {
    const { orientation, volume } = this.scene ?? {};
    if (orientation && volume) this.toIndex(end === "first" ? 0 : volume.dims[orientation.axis] - 1);
  }

  step(dx: number, dy: number): void {
    if (this.scene === null || this.plane === null) return;
    const { space, orientation } = this.scene;
    if (orientation === null) {
      return this.move(add(this.crosshair, add(scale(this.plane.right, dx * stepOf(space)), scale(this.plane.down, dy * stepOf(space)))));
    }
    const at = indexOf(space, this.crosshair);
    const { across, down } = orientation;
    this.move(worldOf(space, withPart(withPart(at, across.axis, at[across.axis] + across.sign * dx), down.axis, at[down.axis] + down.sign * dy)));
  }

  hover(x: number, y: number): void {
    const point = this.at(x, y);
    this.tool.hover(point, this.kind);
    this.events.hovered(point);
  }

  leave(): void {
    this.events.hovered(null);
  }

  enter(): boolean {
    if (this.tool.kind === null) return false;
    this.tool.set(this.cornerAt(this.crosshair), this.kind);
    return true;
  }

  finish(): boolean {
    return this.tool.finish();
  }

  cancel(): boolean {
    return this.tool.cancel();
  }

  schedule(): void {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => {
      this.isScheduled = false;
      this.draw();
    });
  }

  private get scrolling(): string {
    return `scroll ${this.kind}`;
  }

  private get size(): readonly [number, number] {
    return [Math.max(1, this.canvas.clientWidth), Math.max(1, this.canvas.clientHeight)];
  }

  private frameNow(plane: SlicePlane): SliceFrame {
    return this.frame ?? fittedFrame(plane, this.size);
  }

  private reframe(frame: SliceFrame | null): void {
    this.frame = frame;
    this.schedule();
  }

  private toIndex(index: number, gesture = ""): void {
    const { space, orientation } = this.scene ?? {};
    if (!space || !orientation) return;
    const bounded = Math.min(space.dims[orientation.axis] - 1, Math.max(0, index));
    this.move(worldOf(space, withPart(indexOf(space, this.crosshair), orientation.axis, bounded + 0.5)), gesture);
  }

  // The crosshair stays in the volume.
  private move(point: Vec3, gesture = ""): void {
    if (this.scene === null) return;
    const { space } = this.scene;
    const at = indexOf(space, point);
    const bounded = kAxes.map((axis) => Math.min(space.dims[axis] - 1e-3, Math.max(1e-3, at[axis])));
    this.events.moved(worldOf(space, [bounded[0] ?? 0, bounded[1] ?? 0, bounded[2] ?? 0]), gesture);
  }

  // The second corner of a box lies on the other side of the slab.
  private cornerAt(point: Vec3): Vec3 {
    if (this.tool.kind !== "box" || this.plane === null) return point;
    return this.plane.lift(point, (this.tool.isEmpty ? -1 : 1) * kCornerShare * this.plane.reach);
  }

  private draw(): void {
    const { scene, view, plane, context, canvas } = this;
    if (scene === null || view === null || plane === null || this.root.hidden || canvas.clientWidth === 0) return this.source.wish([]);
    const frame = this.frameNow(plane);
    const ratio = window.devicePixelRatio;
    clearPane(canvas, context, ratio);
    const ready = this.pictures(scene, view, plane, frame, ratio);
    if (ready.length > 0) this.shown = ready;
    drawPictures(context, this.shown, frame, this.size, ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const project = (point: Vec3): readonly [number, number] => pixelOf(frame, plane.locate(point), this.size);
    drawCrosshair(context, project(this.crosshair), scene.orientation, scene.colours, this.size);
    const marks = { context, space: scene.space, ruler: scene.ruler, project };
    drawMarksOnPlane(marks, plane, view.marks);
    if (this.tool.pending !== null) drawPending(marks, this.tool.pending);
    this.write(scene, view, plane, frame);
  }

  // Asks for what is missing, and gives what is there, the coarsest first.
  private pictures(scene: PaneScene, view: ViewState, plane: SlicePlane, frame: SliceFrame, ratio: number): readonly PlacedPicture[] {
    const { volume, space, orientation } = scene;
    const [width, height] = this.size;
    if (orientation === null) {
      const asked = planePicture(volume, view, plane, frame.centre, frame.unit / ratio, width * ratio, height * ratio);
      const address = this.address(asked.query);
      this.source.wish([address]);
      const bitmap = this.source.get(address);
      this.root.dataset["settled"] = String(bitmap !== null);
      return bitmap === null ? [] : [{ bitmap, place: { kind: "plane", centre: frame.centre, pixel: asked.pixel } }];
    }
    const corners = [pointAt(frame, 0, 0, this.size), pointAt(frame, width, height, this.size)].map((point) => indexOf(space, plane.place(point)));
    const bound = (pick: (...values: number[]) => number): Vec3 => {
      const of = (axis: Axis): number => pick(...corners.map((corner) => corner[axis]));
      return [of(0), of(1), of(2)];
    };
    const sight = { min: bound(Math.min), max: bound(Math.max) };
    const of = (index: number): ReturnType<typeof axisPictures> => axisPictures(volume, space, view, orientation.axis, index, frame.unit / ratio, sight);
    const wanted = of(this.index);
    const ahead = Array.from({ length: kAhead }, (_, i) => this.index + this.sense * (i + 1)).filter((index) => index >= 0 && index < space.dims[orientation.axis]);
    const addresses = (pictures: ReturnType<typeof axisPictures>): readonly string[] => pictures.map(({ query }) => this.address(query));
    this.source.wish(addresses(wanted), addresses(ahead.flatMap((index) => of(index).slice(0, 1))));
    const ready = wanted.flatMap(({ query, level, begin }): readonly PlacedPicture[] => {
      const bitmap = this.source.get(this.address(query));
      return bitmap === null ? [] : [{ bitmap, place: { kind: "axis", space, orientation, level, begin } }];
    });
    this.root.dataset["settled"] = String(ready.length === wanted.length);
    // Without the whole, tiles alone would stand on the slice before.
    const [whole] = wanted;
    return whole !== undefined && this.source.get(this.address(whole.query)) !== null ? ready : [];
  }

  private write(scene: PaneScene, view: ViewState, plane: SlicePlane, frame: SliceFrame): void {
    const say = (selector: string, text: string): void => {
      const node = part(this.root, selector, HTMLElement);
      if (node.textContent !== text) node.textContent = text;
    };
    const text = sliceText(scene, this.index, this.crosshair);
    say(".slice-text", [sliceText(scene, this.index, this.crosshair, true), ...slabText(scene, view.slices, plane), ...ownWindows(view, scene.volume)].join("\n"));
    this.slider.value = String(this.index);
    this.slider.setAttribute("aria-valuetext", text);
    this.canvas.setAttribute("aria-label", `${scene.orientation?.title ?? "As seen"} slice, ${text}. Page keys scroll, arrows move the crosshair, plus and minus zoom.`);
    const names = edgeNames(scene, plane);
    for (const edge of ["left", "right", "top", "bottom"] as const) say(`.edge.${edge}`, names[edge]);
    const length = roundLength(kBarPixels * frame.unit);
    part(this.root, ".slice-bar", HTMLElement).style.width = `${(length / frame.unit).toFixed(1)}px`;
    say(".slice-length", scene.ruler.unit === "voxels" ? `${length} voxels` : formatLength(length, scene.volume.lengthUnit));
  }
}

