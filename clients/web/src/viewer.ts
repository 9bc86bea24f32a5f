// SPDX-License-Identifier: Apache-2.0
// One volume on the screen: holds its view, sends what changes of it, and draws what comes back.
//
// A change of view goes one way: change() -> view -> at the next animation frame one message with the members that
// the server does not know. A frame: stream -> canvas -> acknowledgement -> onFrame.

import { orbit, pan, refitted, zoomAt, type Viewport } from "./camera";
import { FrameCanvas, type FrameOutcome } from "./frame_canvas";
import type { Moves } from "./gestures";
import { Meter } from "./meter";
import type { StreamState } from "./notice";
import type { FrameHeader, Problem } from "./protocol";
import { SentMembers } from "./sent_members";
import { Stream } from "./stream";
import { length, subtract } from "./vector";
import { fitted, initialView, membersOf, pictureSize, type ViewChange, type ViewOverrides, type ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export interface ViewerEvents {
  opened(volume: VolumeInfo): void;
  viewChanged(view: ViewState): void;
  frameShown(header: FrameHeader): void;
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
        this.sent.taken(frame.header.id);
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
    this.picture.clear();
    this.setState("none");
  }

  change(change: ViewChange): void {
    if (this.view === null) return;
    this.setView({ ...this.view, ...change });
  }

  // What an address asks of the volume that is open.
  ask(overrides: ViewOverrides): void {
    if (this.volume !== null) this.change(this.fit(this.volume, overrides));
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
    const { min, max } = this.volume.worldBox;
    const diagonal = length(subtract(max, min));
    const limits = { nearest: diagonal * 1e-4, farthest: diagonal * 50 };
    this.change({ camera: zoomAt(this.view.camera, factor, x, y, this.viewport(this.view), limits) });
  }

  // Back to the volume's own camera; range and looks stay.
  reset(): void {
    if (this.volume !== null && this.view !== null) this.change({ camera: initialView(this.volume, this.view.size, {}).camera });
  }

  private greet(volume: VolumeInfo, overrides: ViewOverrides): void {
    const isFirst = this.volume === null;
    this.volume = volume;
    this.picture.abandon();
    this.meter.reset();
    this.sent.forget();
    this.setState("live");
    if (isFirst) this.events.opened(volume);
    this.setView(isFirst || this.view === null ? initialView(volume, this.size(), this.fit(volume, overrides)) : this.view);
  }

  private fit(volume: VolumeInfo, overrides: ViewOverrides): ViewChange {
    const { change, faults } = fitted(volume, overrides);
    for (const fault of faults) this.events.problem({ title: "The address does not fit this volume", detail: fault, field: null });
    return change;
  }

  private setView(view: ViewState): void {
    this.view = view;
    this.picture.setBackground(view.background);
    this.picture.resize(view.size);
    this.events.viewChanged(view);
    this.schedule();
  }

  private schedule(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => this.send());
  }

  // The server keeps its earlier view: what came with the member that it refuses is said again.
  private refuse(problem: Problem, id: number | null): void {
    this.events.problem(problem);
    if (id !== null && this.sent.refused(id, problem.field)) this.schedule();
  }

  private send(): void {
    this.scheduled = false;
    if (this.view === null || this.stream === null || !this.stream.isOpen) return;
    const members = this.sent.missing(membersOf(this.view, this.isColoured));
    if (Object.keys(members).length === 0) return;
    const id = this.stream.sendView(members);
    this.meter.viewSent(id, performance.now());
    this.sent.sent(id, members);
  }

  private frameDone(outcome: FrameOutcome): void {
    this.stream?.acknowledge(outcome.header.id);
    if (outcome.shown) this.events.frameShown(outcome.header);
  }

  private resized(): void {
    if (this.view === null) return;
    const size = this.size();
    this.setView({ ...this.view, size, camera: refitted(this.view.camera, this.view.size, size) });
  }

  private size(): readonly [number, number] {
    return pictureSize(this.canvas.clientWidth, this.canvas.clientHeight, window.devicePixelRatio);
  }

  private viewport(view: ViewState): Viewport {
    return { width: this.canvas.clientWidth, height: this.canvas.clientHeight, fovDegrees: view.fovDegrees };
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
