// SPDX-License-Identifier: Apache-2.0
// A second view beside the first, of the same volume or of another: one camera for both. What it shows is text in the view,
// as an address has it; it is changed by changing places with the first.

import { byId, element } from "./dom";
import { bindPointer } from "./gestures";
import { linkedLens, type Lens } from "./link";
import type { StreamState } from "./notice";
import type { Problem } from "./protocol";
import type { Toasts } from "./toasts";
import { formatFragment, parseFragment } from "./url_state";
import { Viewer } from "./viewer";
import { kNoPagePart, type ViewChange, type ViewOverrides, type ViewState } from "./view_state";
import type { VolumeInfo, VolumeSummary } from "./volume_info";

export interface BesideHost {
  change(change: ViewChange): void;
  first(): { readonly id: string; readonly view: ViewState; readonly volume: VolumeInfo } | null;
  streamAddress(id: string): string;
  open(id: string, overrides: ViewOverrides): void; // as the first
}

const kLensMembers = ["eye", "target", "up", "fov", "ortho"];
const kSame = "=this";

export class Beside {
  private readonly root = byId("beside", HTMLElement);
  private readonly canvas = byId("beside-canvas", HTMLCanvasElement);
  private readonly title = byId("beside-title", HTMLElement);
  private readonly choice = byId("beside-choice", HTMLSelectElement);
  private readonly tools = byId("beside-tools", HTMLElement);
  private readonly linked = byId("beside-linked", HTMLInputElement);
  private readonly viewer: Viewer;
  private text: string | null = null; // what is shown
  private id = "";
  private isFollowing = false; // the camera that changes is not this one's
  private volumes = "";

  constructor(private readonly host: BesideHost, private readonly toasts: Toasts) {
    this.viewer = new Viewer(this.canvas, {
      opened: (volume) => (this.title.textContent = volume.name),
      viewChanged: (view, isResized) => (isResized ? this.follow() : this.lead(view)),
      viewSent: () => (this.root.dataset["final"] = "false"),
      frameShown: (header) => (this.root.dataset["final"] = String(header.final)),
      streamChanged: (state, refusal) => this.streamChanged(state, refusal),
      problem: (problem) => toasts.show(problem),
      pointed: () => undefined,
    });
    bindPointer(this.canvas, this.viewer);
    this.choice.addEventListener("change", () => this.choose(this.choice.value));
    byId("beside-swap", HTMLButtonElement).addEventListener("click", () => this.swap());
    byId("beside-close", HTMLButtonElement).addEventListener("click", () => host.change({ beside: null }));
    this.linked.addEventListener("change", () => this.follow());
  }

  setVolumes(volumes: readonly VolumeSummary[]): void {
    const ready = volumes.filter(({ state }) => state === "ready");
    const said = JSON.stringify(ready.map(({ id, name }) => [id, name]));
    if (said === this.volumes) return;
    this.volumes = said;
    const options = ready.map(({ id, name }) => element("option", { value: id }, name));
    this.choice.replaceChildren(element("option", { value: "" }, "Nothing"), element("option", { value: kSame }, "This view, as it is now"), ...options);
    this.showChoice();
  }

  // Slices need the room; what stands beside comes back after them.
  show(view: ViewState): void {
    const text = view.slices.layout === "3d" ? view.beside : null;
    this.root.hidden = text === null;
    document.body.classList.toggle("has-beside", text !== null);
    this.tools.hidden = view.beside === null;
    if (text !== this.text) this.open(text);
    else this.follow();
    this.showChoice();
  }

  clear(): void {
    this.open(null);
    this.root.hidden = true;
    document.body.classList.remove("has-beside");
  }

  private open(text: string | null): void {
    this.text = text;
    this.root.dataset["final"] = "false";
    this.viewer.close();
    if (text === null) return;
    const { volume, overrides, faults } = parseFragment(text);
    if (faults.length > 0) this.toasts.show({ title: "Of what stands beside this is not understood", detail: faults.join("\n"), field: "beside" });
    this.id = this.title.textContent = volume ?? "";
    if (volume === null) return this.toasts.show({ title: "What stands beside has no volume", detail: text, field: "beside" });
    this.viewer.open(this.host.streamAddress(volume), { ...overrides, ...kNoPagePart });
  }

  // This view gets the first one's camera.
  private follow(): void {
    const [first, { info, current }] = [this.host.first(), this.viewer];
    if (this.isFollowing || !this.linked.checked || first === null || info === null || current === null) return;
    this.isFollowing = true;
    this.viewer.change(linkedLens(lensOf(first.view), first.volume, info));
    this.isFollowing = false;
  }

  // The first view gets this one's camera, when a person moved it; when it opened, the other way round.
  private lead(view: ViewState): void {
    const [first, { info }] = [this.host.first(), this.viewer];
    if (this.isFollowing || first === null || info === null) return;
    if (this.root.dataset["led"] !== this.text) {
      this.root.dataset["led"] = this.text ?? "";
      window.queueMicrotask(() => this.follow());
      return;
    }
    if (!this.linked.checked) return;
    this.isFollowing = true;
    this.host.change(linkedLens(lensOf(view), info, first.volume));
    this.isFollowing = false;
  }

  private choose(value: string): void {
    const first = this.host.first();
    if (first === null) return;
    const { mode, background, filter, lit } = first.view;
    const look = `mode=${mode}&background=${background}${filter === "linear" ? "&filter=linear" : ""}${lit ? "&lit=on" : ""}`;
    const beside = value === "" ? null : value === kSame ? textOf(first.id, first.view, first.volume) : `volume=${encodeURIComponent(value)}&${look}`;
    this.host.change({ beside, slices: { ...first.view.slices, layout: "3d" } });
  }

  // What stood beside can be changed now, and what was changed stands beside.
  private swap(): void {
    const [first, { info, current }] = [this.host.first(), this.viewer];
    if (first === null || info === null || current === null) return;
    const { size: _, ...view } = current;
    this.host.open(this.id, { ...view, beside: textOf(first.id, first.view, first.volume) });
  }

  private showChoice(): void {
    const beside = this.host.first()?.view.beside ?? null;
    const isListed = beside !== null && [...this.choice.options].some(({ value }) => value === this.id);
    this.choice.value = beside === null ? "" : isListed ? this.id : kSame;
  }

  private streamChanged(state: StreamState, refusal: Problem | null): void {
    this.root.dataset["stream"] = state;
    if (refusal !== null) this.title.textContent = `${this.id}: ${refusal.detail}`;
    else if (state === "lost") this.title.textContent = `${this.id}: reconnecting`;
    else if (state === "live" && this.viewer.info !== null) this.title.textContent = this.viewer.info.name;
  }
}

const lensOf = ({ camera, ortho, fovDegrees }: ViewState): Lens => ({ camera, ortho, fovDegrees });

// A view without its camera and what is the page's own.
function textOf(id: string, view: ViewState, volume: VolumeInfo): string {
  const parts = formatFragment(id, { ...view, ...kNoPagePart }, volume.type === "rgba8").slice(1).split("&");
  return parts.filter((part) => !kLensMembers.includes(part.split("=")[0] ?? "")).join("&");
}
