// SPDX-License-Identifier: Apache-2.0
// The page: joins the list of volumes, the viewer, the controls and the address.

import { AdvancedControls } from "./advanced_controls";
import { AnimatePanel } from "./animate_panel";
import { AxesCube } from "./axes_cube";
import { Beside } from "./beside";
import { Catalog, type CatalogState } from "./catalog";
import { ChannelRows } from "./channel_rows";
import { Controls } from "./controls";
import { CutControl } from "./cut_control";
import { byId } from "./dom";
import { basisOf, centredOn } from "./camera";
import { bindKeys, bindPointer } from "./gestures";
import { KeptViews, tabStorage } from "./kept_views";
import { KeyChoice } from "./key_choice";
import { LightControls } from "./light_controls";
import { noticeFor, type StreamState } from "./notice";
import { Overlay } from "./overlay";
import { Panels } from "./panels";
import { EmptyNotice } from "./empty_notice";
import { FileDrop } from "./file_drop";
import { fetchPick, pickQuery, type Pick } from "./pick";
import { Probe } from "./probe";
import type { Problem } from "./protocol";
import { Readout } from "./readout";
import { SaveDialog } from "./save_dialog";
import { SceneOverlay } from "./scene_overlay";
import { Shell } from "./shell";
import { ThemeChoice } from "./theme_choice";
import { TimeBar } from "./time_bar";
import { Toasts } from "./toasts";
import { formatFragment, parseFragment } from "./url_state";
import type { Vec3 } from "./vector";
import { Viewer } from "./viewer";
import { Views } from "./views";
import { lookOf, type ViewOverrides, type ViewState } from "./view_state";
import { VolumeList } from "./volume_list";

const kApi = "api/v1/volumes";
const kDevice = "api/v1/device";
const imageAddress = (id: string): string => `${kApi}/${encodeURIComponent(id)}/image`;
const kAddressPauseMs = 250; // browsers refuse histories that change too often
const kFiguresPauseMs = 250;

class Page {
  private readonly stage = byId("stage", HTMLElement);
  private readonly undoButton = byId("undo-button", HTMLButtonElement);
  private readonly redoButton = byId("redo-button", HTMLButtonElement);
  private readonly toasts = new Toasts();
  private readonly shell = new Shell(this.toasts);
  private readonly overlay = new Overlay();
  private readonly readout = new Readout();
  private readonly canvas = byId("canvas", HTMLCanvasElement);
  private readonly list = new VolumeList((id) => this.choose(id), imageAddress, () => this.shell.openPanel());
  private readonly controls = new Controls((change) => this.viewer.change(change), (isOrtho) => this.viewer.setOrtho(isOrtho));
  private readonly light = new LightControls((change) => this.viewer.change(change));
  private readonly advanced = new AdvancedControls((change) => this.viewer.change(change));
  private readonly cut = new CutControl((change) => this.viewer.change(change), () => this.forward());
  private readonly scene = new SceneOverlay();
  private readonly cube = new AxesCube((forward, up) => this.viewer.lookAlong(forward, up));
  private readonly save = new SaveDialog(imageAddress, this.toasts);
  private readonly animate = new AnimatePanel({
    address: (id) => `${kApi}/${encodeURIComponent(id)}/animate`,
    shown: () => this.save.chosen,
    volume: () => this.viewer.info,
    bookmarks: () => this.panels.bookmarks.all,
  }, this.toasts);
  private readonly empty = new EmptyNotice((change) => this.remedy(change));
  private readonly probe = new Probe(this.canvas, (x, y) => this.pickAddress(x, y), () => this.viewer.info);
  private readonly time = new TimeBar((change) => this.viewer.change(change));
  private readonly panels = new Panels((change) => this.viewer.change(change), imageAddress, this.toasts);
  private readonly views = new Views({
    change: (change, gesture) => this.viewer.change(change, gesture),
    address: (path, query) => `${kApi}/${encodeURIComponent(this.opened ?? "")}/${path}?${query}`,
    pick: async (x, y) => (await this.pickAt(x, y))?.world ?? null,
  }, this.toasts);
  private readonly beside = new Beside({
    change: (change) => this.viewer.change(change),
    first: () => {
      const { current: view, info: volume } = this.viewer;
      return view === null || volume === null || this.opened === null ? null : { id: this.opened, view, volume };
    },
    streamAddress,
    open: (id, overrides) => this.openWith(id, overrides),
  }, this.toasts);
  private readonly channelRows = new ChannelRows((change) => this.viewer.change(change), (number, opener) => this.panels.editor.open(number, opener));
  private readonly catalog = new Catalog(kApi, (state) => this.catalogChanged(state));
  private readonly viewer: Viewer;

  private catalogState: CatalogState = { kind: "unknown" };
  private streamState: StreamState = "none";
  private refusal: Problem | null = null; // of the stream
  private chosen: string | null = null;
  private opened: string | null = null; // the volume the viewer has
  private overrides: ViewOverrides = {}; // for the next volume that opens
  private readonly kept = new KeptViews(tabStorage());
  private addressTimer: number | undefined;

  constructor() {
    new ThemeChoice();
    this.viewer = new Viewer(this.canvas, {
      opened: (volume, view) => {
        this.channelRows.setVolume(volume, view);
        this.controls.setVolume(volume);
        this.advanced.setVolume(volume);
        this.cut.setVolume(volume);
        this.panels.setVolume(volume);
        this.cube.setVolume(volume);
        this.time.setVolume(volume);
        this.views.setVolume(volume);
        this.list.showFacts(volume);
        document.body.classList.add("has-volume");
        document.title = `${volume.name} · Blockwalk`;
      },
      viewChanged: (view) => this.viewChanged(view),
      viewSent: () => {
        this.readout.expectFrame();
        this.probe.stale();
      },
      frameShown: (header, view) => {
        this.readout.showFrame(header, view.others);
        if (this.viewer.info !== null) this.scene.show(view, this.viewer.viewport(view), this.viewer.info);
        this.cut.frameShown(view, this.viewer.viewport(view));
        this.cube.show(view);
        this.views.frameShown(view, this.viewer.viewport(view));
        this.time.frameShown(view);
        this.empty.show(header);
        if (header.final) this.probe.again();
        this.stage.dataset["frame"] = String(header.seq);
        this.stage.dataset["final"] = String(header.final);
      },
      streamChanged: (state, refusal) => this.streamChanged(state, refusal),
      problem: (problem) => this.toasts.show(problem),
      pointed: (x, y) => void this.centre(x, y),
    });
    bindPointer(this.canvas, this.viewer);
    new FileDrop(this.toasts);
    this.bindKeys();
    byId("reset-button", HTMLButtonElement).addEventListener("click", () => this.viewer.reset());
    this.undoButton.addEventListener("click", () => this.viewer.step("back"));
    this.redoButton.addEventListener("click", () => this.viewer.step("forth"));
    window.addEventListener("pointerdown", () => this.viewer.history.press(true), { capture: true });
    for (const type of ["pointerup", "pointercancel"] as const) window.addEventListener(type, () => this.viewer.history.press(false));
    // The event's own address: the page may have written another over it since.
    window.addEventListener("hashchange", (event) => this.readAddress(new URL(event.newURL).hash));
    window.setInterval(() => this.readout.showFigures(this.viewer.meter.figures(performance.now())), kFiguresPauseMs);
    this.readAddress(location.hash);
    void this.catalog.refresh();
    void this.readout.askDevice(kDevice);
  }

  private bindKeys(): void {
    const choice = new KeyChoice();
    const help = (): void => this.shell.toggleHelp();
    const forth = (): void => this.viewer.step("forth");
    bindKeys(this.canvas, this.viewer, {
      single: new Map([
        ["f", () => void this.shell.toggleFullscreen()],
        ["p", () => this.shell.togglePanel()],
        ["h", help],
        ["?", help],
        [" ", () => this.time.toggle()],
        [",", () => this.time.move(-1)],
        [".", () => this.time.move(1)],
        ...this.views.keys,
        ...[0, 1, 2, 3, 4, 5].map((side) => [String(side + 1), () => this.cube.choose(side)] as const),
      ]),
      withControl: new Map([["z", () => this.viewer.step("back")], ["shift+z", forth], ["y", forth]]),
      areOn: () => choice.areOn,
    });
  }

  private forward(): Vec3 | null {
    const view = this.viewer.current;
    return view === null ? null : basisOf(view.camera).forward;
  }

  private pickAddress(x: number, y: number): string | null {
    const view = this.viewer.current;
    if (view === null || this.opened === null) return null;
    const { width, height } = this.viewer.viewport(view);
    return `${kApi}/${encodeURIComponent(this.opened)}/pick?${pickQuery(view, x, y, width, height, this.viewer.isColoured)}`;
  }

  // What the server says would help, in the words of an address.
  private remedy(change: Readonly<Record<string, string | number>>): void {
    if ("eye" in change) this.viewer.reset();
    const text = Object.entries(change).map(([name, value]) => `${name}=${encodeURIComponent(value)}`).join("&");
    this.viewer.ask(parseFragment(text).overrides);
  }

  // Turns about what is under a pixel from now on, and brings it to the middle.
  private async centre(x: number, y: number): Promise<void> {
    const view = this.viewer.current;
    if (view === null || this.views.isMarking) return;
    const pick = await this.pickAt(x, y);
    if (pick === null || this.viewer.current !== view) return;
    this.viewer.change({ camera: centredOn(view.camera, pick.world) });
    this.views.pointed(pick.world);
  }

  private async pickAt(x: number, y: number): Promise<Pick | null> {
    const address = this.pickAddress(x, y);
    return address === null ? null : fetchPick(address, AbortSignal.timeout(5000));
  }

  private readAddress(hash: string): void {
    const { volume, overrides, faults } = parseFragment(hash);
    if (faults.length > 0) this.toasts.show({ title: "Of the address this is not understood", detail: faults.join("\n"), field: null });
    this.overrides = overrides;
    if (volume === null) this.viewer.ask(overrides);
    else if (volume === this.opened) this.viewer.show(overrides);
    if (volume !== null) this.chosen = volume;
    this.update();
  }

  private choose(id: string): void {
    if (id === this.chosen) return;
    const view = this.viewer.current;
    if (view !== null && this.opened !== null) this.kept.keep(this.opened, view, formatFragment(this.opened, view, this.viewer.isColoured));
    this.openWith(id, this.keptOf(id) ?? (view === null ? {} : lookOf(view)));
  }

  // Of a volume that was open before, here or before the page was loaded again.
  private keptOf(id: string): ViewOverrides | null {
    const [view, address] = [this.kept.viewOf(id), this.kept.addressOf(id)];
    if (view !== null) return this.viewer.keptView(view);
    return address === null ? null : parseFragment(address).overrides;
  }

  private openWith(id: string, overrides: ViewOverrides): void {
    if (id === this.opened) return this.viewer.show(overrides);
    this.overrides = overrides;
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
    if (volumes !== null) this.beside.setVolumes(volumes);
    const isReady = volumes?.some((volume) => volume.id === this.chosen && volume.state === "ready") ?? false;
    if (this.chosen !== null && this.chosen !== this.opened && volumes !== null) {
      this.opened = isReady ? this.chosen : null;
      this.readout.clear();
      this.scene.clear();
      this.time.close();
      this.save.clear();
      this.animate.stop();
      this.empty.clear();
      this.probe.clear();
      this.panels.clear();
      this.views.clear();
      this.beside.clear();
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
    this.light.show(view);
    this.advanced.show(view);
    this.cut.show(view);
    this.panels.show(view);
    this.time.show(view);
    this.views.show(view);
    this.beside.show(view);
    this.stage.style.backgroundColor = `#${view.background}`;
    this.undoButton.disabled = !this.viewer.history.has("back");
    this.redoButton.disabled = !this.viewer.history.has("forth");
    if (this.addressTimer !== undefined) return;
    this.addressTimer = window.setTimeout(() => this.writeAddress(), kAddressPauseMs);
  }

  private writeAddress(): void {
    this.addressTimer = undefined;
    const view = this.viewer.current;
    if (view === null || this.opened === null) return;
    const isColoured = this.viewer.isColoured;
    history.replaceState(null, "", formatFragment(this.opened, view, isColoured));
    this.save.show({ volume: this.opened, view, isColoured, lengthUnit: this.viewer.info?.lengthUnit ?? null });
  }
}

function streamAddress(id: string): string {
  const address = new URL(`${kApi}/${encodeURIComponent(id)}/stream`, document.baseURI);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.hash = "";
  return address.href;
}

new Page();
