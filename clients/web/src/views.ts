// SPDX-License-Identifier: Apache-2.0
// Everything beside the picture in 3D that shows the same view: slices, marks, and the words for it.

import type { Viewport } from "./camera";
import { byId } from "./dom";
import { indexOf, indexSpaceOf, isInside, middleOf, voxelAt } from "./index_space";
import { MarkList } from "./mark_list";
import { kMarkColours, MarkTool, type Tool } from "./mark_tool";
import { kMostMarks, type MarkKind } from "./marks";
import { MarksOverlay } from "./marks_overlay";
import { rulerOf } from "./measure";
import { SlabControl } from "./slab_control";
import { SlicePane, type PaneScene } from "./slice_pane";
import { orientationsOf, type Orientation, type SliceKind } from "./slice_plane";
import { SliceProbe } from "./slice_probe";
import type { Layout, SliceState } from "./slice_state";
import { SpacePointer } from "./space_pointer";
import { summaryOf } from "./summary";
import type { Toasts } from "./toasts";
import { fitMarks } from "./url_state";
import type { Vec3 } from "./vector";
import { ViewBar } from "./view_bar";
import type { ViewChange, ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export interface ViewsHost {
  change(change: ViewChange, gesture?: string): void; // gesture: what it is a part of
  address(path: "slice" | "region", query: string): string; // of the volume that is open
  pick(x: number, y: number): Promise<Vec3 | null>; // what a pixel of the picture in 3D shows
}

const kColours = ["#ff6b5e", "#6fcf7a", "#ffd84d"]; // in the order in which slices stand
const kTellAfterMs = 700;
const kKinds: readonly SliceKind[] = ["x", "y", "z", "oblique"];

export class Views {
  private readonly tool = new MarkTool((kind, points) => this.made(kind, points), () => this.redraw());
  private readonly bar = new ViewBar((layout) => this.put({ layout }), (tool) => this.chooseTool(tool), () => this.arrange());
  private readonly slab = new SlabControl((change) => this.put(change));
  private readonly list: MarkList;
  private readonly overlay = new MarksOverlay(this.tool);
  private readonly probe: SliceProbe;
  private readonly panes: readonly SlicePane[];
  private readonly left = byId("slices-left", HTMLElement);
  private readonly others = byId("slices", HTMLElement);
  private readonly words = byId("summary", HTMLElement);
  private scene: PaneScene | null = null; // of no slice
  private orientations: readonly Orientation[] = [];
  private volume: VolumeInfo | null = null;
  private view: ViewState | null = null;
  private telling: number | undefined;

  constructor(private readonly host: ViewsHost, private readonly toasts: Toasts) {
    this.list = new MarkList((marks) => host.change({ marks }), () => this.volume?.id ?? "", toasts);
    this.probe = new SliceProbe((query) => host.address("region", query));
    const template = byId("slice-pane", HTMLTemplateElement);
    this.panes = kKinds.map((kind) => new SlicePane(template, kind, this.tool, (query) => host.address("slice", query), {
      moved: (crosshair, gesture) => {
        this.put({ crosshair }, gesture);
        this.tellLater();
      },
      maximised: () => this.put({ layout: this.view?.slices.layout === kind ? "all" : kind }),
      hovered: (world) => this.hovered(world),
      problem: (problem) => toasts.show(problem),
    }));
    new SpacePointer(byId("canvas", HTMLCanvasElement), this.tool, (x, y) => host.pick(x, y));
    byId("summary-button", HTMLButtonElement).addEventListener("click", () => this.say());
    byId("summary-close", HTMLButtonElement).addEventListener("click", () => this.hush());
    window.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.hush();
    });
  }

  // Single keys of the page.
  readonly keys: readonly (readonly [string, () => void])[] = [
    ["s", () => this.bar.toggleSlices()],
    ["m", () => this.bar.toggle()],
    ["d", () => this.say()],
  ];

  get isMarking(): boolean {
    return this.tool.kind !== null;
  }

  setVolume(volume: VolumeInfo): void {
    this.volume = volume;
    const space = indexSpaceOf(volume);
    this.orientations = orientationsOf(space, volume.space, volume.defaultView.camera.up);
    const colours = [0, 1, 2].map((axis) => kColours[this.orientations.findIndex((orientation) => orientation.axis === axis)] ?? "");
    const scene = { volume, space, ruler: rulerOf(volume, space), orientation: null, colours };
    this.scene = scene;
    this.tool.cancel();
    this.bar.setOrientations(this.orientations);
    this.slab.setVolume(volume);
    for (const pane of this.panes) {
      const orientation = this.orientations.find(({ axis }) => "xyz"[axis] === pane.kind) ?? null;
      pane.setScene({ ...scene, orientation });
      pane.root.dataset["place"] = orientation === null ? "" : String(this.orientations.indexOf(orientation));
    }
  }

  // No volume is open.
  clear(): void {
    this.volume = this.view = this.scene = null;
    for (const pane of this.panes) pane.close();
    this.overlay.show(null);
    this.probe.leave();
    this.hush();
  }

  show(view: ViewState): void {
    this.view = view;
    this.slab.show(view.slices);
    if (this.scene !== null) this.list.show(view.marks, this.scene.ruler, fitMarks(view));
    this.arrange();
  }

  frameShown(view: ViewState, viewport: Viewport): void {
    this.overlay.frameShown(view, viewport);
  }

  // What a double click found in 3D is where the slices go.
  pointed(world: Vec3): void {
    if (this.view === null || this.view.slices.layout === "3d" || this.scene === null) return;
    if (isInside(this.scene.space, indexOf(this.scene.space, world))) this.put({ crosshair: world });
  }

  private get crosshair(): Vec3 {
    if (this.view?.slices.crosshair) return this.view.slices.crosshair;
    return this.scene === null ? [0, 0, 0] : middleOf(this.scene.space);
  }

  private put(change: Partial<SliceState>, gesture = ""): void {
    if (this.view !== null) this.host.change({ slices: { ...this.view.slices, ...change } }, gesture);
  }

  // Where keys took the crosshair, once they rest.
  private tellLater(): void {
    window.clearTimeout(this.telling);
    this.telling = window.setTimeout(() => {
      const pane = this.panes.find(({ canvas }) => canvas === document.activeElement);
      if (pane !== undefined) byId("announcer", HTMLElement).textContent = saidOf(pane);
    }, kTellAfterMs);
  }

  private arrange(): void {
    const { view, scene } = this;
    if (view === null || scene === null) return;
    this.bar.show(view.slices.layout, this.orientations);
    const layout = this.bar.shownLayout(view.slices.layout, this.orientations);
    this.seat(layout);
    for (const pane of this.panes) {
      pane.root.hidden = !(layout === pane.kind || (layout === "all" && pane.kind !== "oblique"));
      pane.show(view, this.crosshair);
    }
    this.overlay.show({ scene, orientations: this.orientations, crosshair: this.crosshair, view });
  }

  // Tab goes as one sees: to the slice left of the picture in 3D before that, then to those below.
  private seat(layout: Layout): void {
    const isLeft = ({ kind, root }: SlicePane): boolean => (layout === "all" ? root.dataset["place"] === "0" : layout === "oblique" && kind === layout);
    const ordered = [...this.panes].sort((a, b) => (a.root.dataset["place"] ?? "").localeCompare(b.root.dataset["place"] ?? ""));
    moveInto(this.left, ordered.filter(isLeft));
    moveInto(this.others, ordered.filter((pane) => !isLeft(pane)));
  }

  private redraw(): void {
    for (const pane of this.panes) pane.schedule();
    this.overlay.draw();
  }

  private chooseTool(tool: Tool): void {
    this.tool.choose(tool);
    this.bar.showTool(tool);
    document.body.dataset["tool"] = tool;
  }

  private made(kind: MarkKind, points: readonly Vec3[]): void {
    const { view } = this;
    if (view === null) return;
    if (view.marks.length >= kMostMarks) {
      this.toasts.show({ title: "There are too many marks", detail: `A view has at most ${kMostMarks}: delete some, or save them to a file.`, field: "marks" });
      return this.redraw();
    }
    const colour = kMarkColours[view.marks.length % kMarkColours.length] ?? "ffffff";
    this.host.change({ marks: [...view.marks, { kind, points, colour, text: kind === "text" ? "Text" : "" }] });
    if (kind === "text") this.list.typeText(view.marks.length);
  }

  private hovered(world: Vec3 | null): void {
    const { scene, volume, view } = this;
    if (world === null || scene === null || volume === null || view === null) return this.probe.leave();
    const index = indexOf(scene.space, world);
    if (!isInside(scene.space, index)) return this.probe.leave();
    this.probe.rest(volume, voxelAt(scene.space, index), world, view.others.time);
  }

  private say(): void {
    if (this.view === null || this.volume === null) return;
    const badge = byId("badge", HTMLButtonElement).textContent ?? "";
    const shown = this.panes.filter(({ root }) => !root.hidden).map(saidOf);
    const text = summaryOf(this.view, this.volume, badge, shown);
    byId("summary-card", HTMLElement).hidden = false;
    // Said again, though it is the same.
    this.words.textContent = "";
    window.setTimeout(() => (this.words.textContent = text), 50);
  }

  private hush(): void {
    byId("summary-card", HTMLElement).hidden = true;
    this.words.textContent = "";
  }
}

// What is moved keeps the focus.
function moveInto(home: HTMLElement, panes: readonly SlicePane[]): void {
  const isThere = home.childElementCount === panes.length && panes.every(({ root }, i) => home.children[i] === root);
  if (isThere) return;
  const focused = document.activeElement;
  home.append(...panes.map(({ root }) => root));
  if (focused instanceof HTMLElement && home.contains(focused)) focused.focus({ preventScroll: true });
}

// "Axial slice, slice 70 of 0–139 · S 4.5 mm": of the picture's name what is no hint.
const saidOf = ({ canvas }: SlicePane): string => (canvas.getAttribute("aria-label") ?? "").split(". ")[0] ?? "";
