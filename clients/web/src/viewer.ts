// SPDX-License-Identifier: Apache-2.0
// One volume on the screen: holds its view, sends what changes of it, and draws what comes back.
//
// A change of view goes one way: change() -> view -> at the next animation frame one message with the members that
// the server does not know. A frame: stream -> canvas -> acknowledgement -> onFrame.

import { AcceptedViews } from "./accepted_views";
import { atDistance, basisOf, distanceFor, heightAt, isClose, lookAlong, orbit, pan, refit, refitted, seesBox, zoomAt, type Viewport } from "./camera";
import { FrameCanvas, type FrameOutcome } from "./frame_canvas";
import type { Moves } from "./gestures";
import { ViewHistory } from "./history";
import { Meter } from "./meter";
import type { StreamState } from "./notice";
import type { FrameHeader, Problem } from "./protocol";
import { withMember } from "./members";
import { SentMembers } from "./sent_members";
import { Stream } from "./stream";
import { roomed } from "./transfer_room";
import { length, subtract, type Vec3 } from "./vector";
import { fitted, initialView, lookOf, membersOf, ownCamera, pictureSize, type Size, type ViewChange, type ViewOverrides, type ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export interface ViewerEvents {
  opened(volume: VolumeInfo, view: ViewState): void;
  viewChanged(view: ViewState, isResized: boolean): void; // isResized: by the window, and by nobody
  viewSent(): void;
  frameShown(header: FrameHeader, view: ViewState): void; // `view`: the newest that a frame has shown
  pointed(x: number, y: number): void; // a double click, CSS pixels of the canvas
  streamChanged(state: StreamState, refusal: Problem | null): void; // `refusal`: why a stream that is not live is refused
  problem(problem: Problem): void;
}

export class Viewer implements Moves {
  readonly meter = new Meter();
  private readonly picture: FrameCanvas;
  private stream: Stream | null = null;
  private volume: VolumeInfo | null = null;
  private view: ViewState | null = null;
  private readonly sent = new SentMembers();
  private readonly accepted = new AcceptedViews();
  readonly history = new ViewHistory();
  private scheduled = false;
  private state: StreamState = "none";
  private refusal: Problem | null = null;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly events: ViewerEvents,
  ) {
    this.picture = new FrameCanvas(canvas, (outcome) => this.frameDone(outcome), (reason) => this.report(reason));
    new ResizeObserver(() => this.resized()).observe(canvas);
  }

  get isColoured(): boolean {
    return this.volume?.type === "rgba8";
  }

  get info(): VolumeInfo | null {
    return this.volume;
  }

  get current(): ViewState | null {
    return this.view;
  }

  // Leaves the volume that is open, and opens the one at this WebSocket address with these members on top of its own view.
  open(address: string, overrides: ViewOverrides): void {
    this.close();
    this.setState("connecting");
    this.stream = new Stream(address, {
      hello: (volume) => this.greet(volume, overrides),
      frame: (frame) => {
        this.accepted.taken(frame.header.id);
        this.meter.frameArrived(frame.header.id, frame.bytes, performance.now());
        this.picture.push(frame);
      },
      problem: (problem, id) => this.refuse(problem, id),
      down: () => this.setState(this.volume === null ? "connecting" : "lost", this.refusal),
      refused: (problem) => this.setState(this.state, problem),
    });
  }

  close(): void {
    this.stream?.close();
    this.stream = null;
    this.volume = null;
    this.view = null;
    this.sent.forget();
    this.accepted.forget(true);
    this.picture.clear();
    this.setState("none");
  }

  // `gesture`: what the change is a part of; empty: it is all.
  change(change: ViewChange, gesture = ""): void {
    if (this.view === null || this.volume === null) return;
    const { view, problem } = roomed({ ...this.view, ...change }, this.volume, this.view.transfers);
    if (problem !== null) this.events.problem(problem);
    this.history.changed(view, performance.now(), gesture);
    this.setView(view);
  }

  // To the view before the last change, or forth again. The window keeps its size.
  step(way: "back" | "forth"): void {
    const view = this.view === null ? null : this.history.step(way);
    // The window keeps its size, and where one stands in time is no step.
    if (view !== null && this.view !== null) this.setView({ ...inSize(view, this.view.size, this.volume), others: withMember(view.others, "time", this.view.others.time) });
  }

  // What an address without a volume asks of the one that is open: the rest stays.
  ask(overrides: ViewOverrides): void {
    if (this.volume !== null) this.change(this.fit(this.volume, overrides));
  }

  // A link to the volume that is open is the whole view.
  show(overrides: ViewOverrides): void {
    if (this.volume === null || this.view === null) return;
    this.change({ ...initialView(this.volume, this.view.size, {}), ...this.fit(this.volume, overrides) });
  }

  // A view that a volume is to come back with, in the window as it is now.
  keptView(view: ViewState): ViewOverrides {
    const { size: _, ...rest } = inSize(view, this.size(), null);
    return rest;
  }

  orbit(dx: number, dy: number): void {
    const angle = Math.PI / Math.max(1, this.canvas.clientHeight); // half a turn for the height of the picture
    const axis = this.volume?.defaultView.camera.up;
    if (this.view === null || axis === undefined) return;
    this.change({ camera: orbit(this.view.camera, dx * angle, dy * angle, axis) });
  }

  pan(dx: number, dy: number): void {
    if (this.view !== null) this.change({ camera: pan(this.view.camera, dx, dy, this.viewport(this.view)) });
  }

  zoom(factor: number, x: number, y: number): void {
    if (this.view === null || this.volume === null) return;
    const { worldBox: { min, max }, contentBox } = this.volume;
    const diagonal = length(subtract(max, min));
    const limits = { nearest: diagonal * 1e-4, farthest: diagonal * 50 };
    const viewport = this.viewport(this.view);
    // Where there is nothing to come closer to, what is turned about must not go there.
    const [cx, cy] = seesBox(this.view.camera, x, y, viewport, contentBox) ? [x, y] : [viewport.width / 2, viewport.height / 2];
    this.change(zoomed(this.view, factor, cx, cy, viewport, limits));
  }

  point(x: number, y: number): void {
    if (this.view !== null) this.events.pointed(x, y);
  }

  // From a standard side, with this up.
  lookAlong(forward: Vec3, up: Vec3): void {
    if (this.view !== null) this.change({ camera: lookAlong(this.view.camera, forward, up) });
  }

  // The same picture in the target's plane, in parallel projection or in perspective. Parallel rays begin outside of the volume.
  setOrtho(isOrtho: boolean): void {
    if (this.view === null || this.volume === null || isOrtho === (this.view.ortho !== null)) return;
    const { camera, fovDegrees, ortho, others } = this.view;
    const { min, max } = this.volume.worldBox;
    const distance = basisOf(camera).distance;
    if (ortho !== null) return this.change({ ortho: null, camera: atDistance(camera, distanceFor(ortho, fovDegrees)) });
    // A parallel view has no lens.
    const change = { ortho: heightAt(distance, fovDegrees), camera: atDistance(camera, Math.max(distance, length(subtract(max, min)))) };
    this.change({ ...change, ...(others.aperture !== undefined && { others: withMember(others, "aperture", undefined) }) });
  }

  // Back to the volume's own camera; range and looks stay.
  reset(): void {
    if (this.volume === null || this.view === null) return;
    const { camera, fovDegrees } = initialView(this.volume, this.view.size, {});
    this.change({ camera, fovDegrees, ortho: this.view.ortho === null ? null : heightAt(basisOf(camera).distance, fovDegrees) });
  }

  private greet(volume: VolumeInfo, overrides: ViewOverrides): void {
    // A file that was replaced is another volume: of the view the look alone goes along.
    const isOther = this.volume !== null && JSON.stringify(this.volume) !== JSON.stringify(volume);
    const isFirst = this.volume === null || isOther;
    const asked = isOther && this.view !== null ? lookOf(this.view) : overrides;
    this.volume = volume;
    this.picture.abandon();
    this.meter.reset();
    this.sent.forget();
    this.accepted.forget(isFirst);
    this.setState("live");
    const { view, problem } = isFirst || this.view === null ? this.first(volume, asked) : { view: this.view, problem: null };
    if (problem !== null) this.events.problem(problem);
    if (isFirst) {
      this.history.begin(view);
      this.events.opened(volume, view);
    }
    this.setView(view);
  }

  private first(volume: VolumeInfo, asked: ViewOverrides): ReturnType<typeof roomed> {
    const own = initialView(volume, this.size(), {});
    return roomed({ ...own, ...this.fit(volume, asked) }, volume, own.transfers);
  }

  private fit(volume: VolumeInfo, overrides: ViewOverrides): ViewChange {
    const { change, faults } = fitted(volume, overrides, ownCamera(volume, this.size()));
    if (faults.length > 0) this.events.problem({ title: "Of the address this does not fit this volume", detail: faults.join("\n"), field: null });
    return change;
  }

  private setView(view: ViewState, isResized = false): void {
    this.view = view;
    this.picture.setBackground(view.background);
    this.picture.resize(view.size);
    this.events.viewChanged(view, isResized);
    this.schedule();
  }

  private schedule(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => this.send());
  }

  // The server keeps its earlier view, and so must the page.
  private refuse(problem: Problem, id: number | null): void {
    this.events.problem(problem);
    if (id === null || this.view === null || this.volume === null) return;
    const refused = this.accepted.sentAs(id);
    const back = this.accepted.refused(id, problem.field, this.view, initialView(this.volume, this.view.size, {}));
    this.sent.doubt();
    if (back === null) return;
    this.history.refused(refused, back);
    this.setView(back);
  }

  private send(): void {
    this.scheduled = false;
    if (this.view === null || this.stream === null || !this.stream.isOpen) return;
    const members = this.sent.missing(membersOf(this.view, this.isColoured));
    if (Object.keys(members).length === 0) return;
    const id = this.stream.sendView(members);
    this.meter.viewSent(id, performance.now());
    this.sent.sent(members);
    this.accepted.sent(id, this.view);
    this.events.viewSent();
  }

  private frameDone(outcome: FrameOutcome): void {
    this.stream?.acknowledge(outcome.header.id);
    const view = this.accepted.current ?? this.view;
    if (outcome.shown && view !== null) this.events.frameShown(outcome.header, view);
  }

  private resized(): void {
    if (this.view === null) return;
    this.setView(inSize(this.view, this.size(), this.volume), true);
  }

  private size(): readonly [number, number] {
    return pictureSize(this.canvas.clientWidth, this.canvas.clientHeight, window.devicePixelRatio);
  }

  viewport(view: ViewState): Viewport {
    return { width: this.canvas.clientWidth, height: this.canvas.clientHeight, fovDegrees: view.fovDegrees, ortho: view.ortho };
  }

  // A refusal stands while attempts follow each other, until the stream opens or another answer comes.
  private setState(state: StreamState, refusal: Problem | null = null): void {
    if (state === this.state && refusal === this.refusal) return;
    this.state = state;
    this.refusal = refusal;
    this.events.streamChanged(state, refusal);
  }

  private report(reason: string): void {
    this.events.problem({ title: "A picture could not be decoded", detail: reason, field: null });
  }
}

// What the volume itself frames is framed anew; any other camera comes along.
function inSize(view: ViewState, size: Size, volume: VolumeInfo | null): ViewState {
  if (volume !== null && view.ortho === null && isClose(view.camera, ownCamera(volume, view.size))) return { ...view, size, camera: ownCamera(volume, size) };
  const ortho = view.ortho === null ? null : view.ortho * refit(view.size, size);
  return { ...view, size, ortho, camera: view.ortho === null ? refitted(view.camera, view.size, size) : view.camera };
}

// An orthographic picture comes closer by its height, and its eye stays as far away as it is.
function zoomed(view: ViewState, factor: number, x: number, y: number, viewport: Viewport, limits: { readonly nearest: number; readonly farthest: number }): ViewChange {
  if (view.ortho === null) return { camera: zoomAt(view.camera, factor, x, y, viewport, limits) };
  const away = distanceFor(view.ortho, view.fovDegrees);
  const closer = zoomAt(atDistance(view.camera, away), factor, x, y, viewport, limits);
  const ortho = heightAt(basisOf(closer).distance, view.fovDegrees);
  return { ortho, camera: atDistance(closer, basisOf(view.camera).distance) };
}
