// SPDX-License-Identifier: Apache-2.0
// The page: joins the list of volumes, the viewer, the controls and the address.

import { Catalog, type CatalogState } from "./catalog";
import { ChannelRows } from "./channel_rows";
import { Controls } from "./controls";
import { byId } from "./dom";
import { bindKeys, bindPointer } from "./gestures";
import { noticeFor, type StreamState } from "./notice";
import type { Problem } from "./protocol";
import { Overlay } from "./overlay";
import { Readout } from "./readout";
import { Shell } from "./shell";
import { Toasts } from "./toasts";
import { formatFragment, imageQuery, parseFragment } from "./url_state";
import { Viewer } from "./viewer";
import type { ViewOverrides, ViewState } from "./view_state";
import { VolumeList } from "./volume_list";

const kApi = "api/v1/volumes";
const kAddressPauseMs = 250; // browsers refuse histories that change too often
const kFiguresPauseMs = 250;

class Page {
  private readonly stage = byId("stage", HTMLElement);
  private readonly saveLink = byId("save-link", HTMLAnchorElement);
  private readonly toasts = new Toasts();
  private readonly shell = new Shell(this.toasts);
  private readonly overlay = new Overlay();
  private readonly readout = new Readout();
  private readonly canvas = byId("canvas", HTMLCanvasElement);
  private readonly list = new VolumeList((id) => this.choose(id));
  private readonly controls = new Controls((change) => this.viewer.change(change));
  private readonly channelRows = new ChannelRows((change) => this.viewer.change(change));
  private readonly catalog = new Catalog(kApi, (state) => this.catalogChanged(state));
  private readonly viewer: Viewer;

  private catalogState: CatalogState = { kind: "unknown" };
  private streamState: StreamState = "none";
  private refusal: Problem | null = null; // of the stream
  private chosen: string | null = null;
  private opened: string | null = null; // the volume the viewer has
  private overrides: ViewOverrides = {}; // for the next volume that opens
  private addressTimer: number | undefined;

  constructor() {
    this.viewer = new Viewer(this.canvas, {
      opened: (volume) => {
        this.channelRows.setVolume(volume);
        this.list.showFacts(volume);
        document.body.classList.add("has-volume");
        document.title = `${volume.name} · Blockwalk`;
      },
      viewChanged: (view) => this.viewChanged(view),
      frameShown: (header) => {
        this.readout.showFrame(header);
        this.stage.dataset["frame"] = String(header.seq);
        this.stage.dataset["final"] = String(header.final);
      },
      streamChanged: (state, refusal) => this.streamChanged(state, refusal),
      problem: (problem) => this.toasts.show(problem),
    });
    bindPointer(this.canvas, this.viewer);
    const help = (): void => this.shell.toggleHelp();
    const commands = new Map([
      ["f", () => void this.shell.toggleFullscreen()],
      ["p", () => this.shell.togglePanel()],
      ["h", help],
      ["?", help],
    ]);
    bindKeys(this.canvas, this.viewer, commands);
    byId("reset-button", HTMLButtonElement).addEventListener("click", () => this.viewer.reset());
    window.addEventListener("hashchange", () => this.readAddress());
    window.setInterval(() => this.readout.showFigures(this.viewer.meter.figures(performance.now())), kFiguresPauseMs);
    this.readAddress();
    void this.catalog.refresh();
  }

  private readAddress(): void {
    const { volume, overrides, faults } = parseFragment(location.hash);
    for (const fault of faults) this.toasts.show({ title: "The address is not understood", detail: fault, field: null });
    this.overrides = overrides;
    if (volume === null || volume === this.opened) this.viewer.ask(overrides);
    if (volume !== null) this.chosen = volume;
    this.update();
  }

  private choose(id: string): void {
    if (id === this.chosen) return;
    const view = this.viewer.current;
    // The look goes along to the next volume; camera, channels and ranges are each volume's own.
    this.overrides = view === null ? {} : { mode: view.mode, background: view.background };
    this.chosen = id;
    // A step in the history, so that "back" is the volume before.
    history.pushState(null, "", `#volume=${encodeURIComponent(id)}`);
    this.update();
    void this.catalog.refresh();
  }

  private catalogChanged(state: CatalogState): void {
    this.catalogState = state;
    if (state.kind === "known" && this.chosen === null) {
      this.chosen = (state.volumes.find((volume) => volume.state === "ready") ?? state.volumes[0])?.id ?? null;
    }
    this.update();
  }

  private streamChanged(state: StreamState, refusal: Problem | null): void {
    this.streamState = state;
    this.refusal = refusal;
    this.stage.dataset["stream"] = state;
    this.stage.dataset["final"] = "false"; // until this connection has sent a final frame itself
    this.update();
    // The list knows why: the server is away, or the volume loads again.
    if (state === "lost" || refusal !== null) void this.catalog.refresh();
  }

  // Opens what is chosen once it is ready, and shows where things stand.
  private update(): void {
    const volumes = this.catalogState.kind === "known" ? this.catalogState.volumes : null;
    if (volumes !== null) this.list.show(volumes, this.chosen);
    const isReady = volumes?.some((volume) => volume.id === this.chosen && volume.state === "ready") ?? false;
    if (this.chosen !== null && this.chosen !== this.opened && volumes !== null) {
      this.opened = isReady ? this.chosen : null;
      this.readout.clear();
      delete this.stage.dataset["frame"];
      document.body.classList.remove("has-volume");
      if (isReady) this.viewer.open(streamAddress(this.chosen), this.overrides);
      else this.viewer.close();
    }
    this.overlay.show(noticeFor(this.catalogState, this.chosen, this.streamState, this.refusal));
  }

  private viewChanged(view: ViewState): void {
    this.channelRows.show(view);
    if (this.viewer.info !== null) this.controls.show(view, this.viewer.info);
    this.stage.style.backgroundColor = `#${view.background}`;
    if (this.addressTimer !== undefined) return;
    this.addressTimer = window.setTimeout(() => this.writeAddress(), kAddressPauseMs);
  }

  private writeAddress(): void {
    this.addressTimer = undefined;
    const view = this.viewer.current;
    if (view === null || this.opened === null) return;
    const isColoured = this.viewer.isColoured;
    history.replaceState(null, "", formatFragment(this.opened, view, isColoured));
    this.saveLink.href = `${kApi}/${encodeURIComponent(this.opened)}/image?${imageQuery(view, isColoured)}`;
    this.saveLink.download = `${this.opened}.png`;
  }
}

function streamAddress(id: string): string {
  const address = new URL(`${kApi}/${encodeURIComponent(id)}/stream`, document.baseURI);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.hash = "";
  return address.href;
}

new Page();
