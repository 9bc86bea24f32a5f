// SPDX-License-Identifier: Apache-2.0
// The bar above the pictures: which of them are shown, and what a press on them does.

import { byId, element, icon, part } from "./dom";
import { kTools, type Tool } from "./mark_tool";
import type { Orientation } from "./slice_plane";
import { kLayouts, type Layout } from "./slice_state";

const kLayoutNames: Readonly<Record<Layout, string>> = { "3d": "3D", all: "2 × 2", x: "x", y: "y", z: "z", oblique: "As seen" };
const kToolNames: Readonly<Record<Tool, readonly [name: string, hint: string]>> = {
  move: ["Move", "drag moves a slice; in 3D it turns"],
  crosshair: ["Crosshair", "where all slices meet"],
  ruler: ["Distance", "two points, or drag"],
  angle: ["Angle", "three points, the corner second"],
  line: ["Length along a line", "points, then double click or Shift+Enter"],
  area: ["Area", "points around it, then double click or Shift+Enter"],
  point: ["Point", "one click"],
  box: ["Box", "two corners, or drag"],
  text: ["Text", "one click, then type"],
};
const kPhone = window.matchMedia("(max-width: 720px)");

export class ViewBar {
  private readonly bar = byId("view-bar", HTMLElement);
  private readonly slicesButton = byId("slices-button", HTMLButtonElement);
  private readonly marksButton = byId("marks-button", HTMLButtonElement);
  private layout: Layout = "3d";
  private tool: Tool = "crosshair";
  private isOpen = false; // though there are no slices

  constructor(private readonly onLayout: (layout: Layout) => void, private readonly onTool: (tool: Tool) => void, private readonly onResize: () => void) {
    byId("layouts", HTMLElement).append(...kLayouts.map((layout) => choice("layout", layout, kLayoutNames[layout], layout === "3d")));
    byId("tool-choice", HTMLElement).append(...kTools.map((tool) => {
      const [name, hint] = kToolNames[tool];
      const label = choice("tool", tool, icon(tool), tool === "crosshair");
      label.title = `${name}: ${hint}`;
      part(label, "input", HTMLInputElement).setAttribute("aria-label", name);
      return label;
    }));
    for (const input of this.bar.querySelectorAll("input")) {
      input.addEventListener("change", () => {
        const [layout, tool] = [kLayouts.find((value) => value === input.value), kTools.find((value) => value === input.value)];
        if (input.name === "layout" && layout) this.onLayout(layout);
        if (input.name === "tool" && tool) this.onTool(tool);
      });
    }
    this.slicesButton.addEventListener("click", () => this.toggleSlices());
    this.marksButton.addEventListener("click", () => this.toggle());
    kPhone.addEventListener("change", () => this.onResize());
  }

  // Of several slices a phone shows one.
  shownLayout(layout: Layout, orientations: readonly Orientation[]): Layout {
    return layout === "all" && kPhone.matches ? (kLayouts[2 + (orientations[0]?.axis ?? 2)] ?? "z") : layout;
  }

  // What slices are called in this volume, in their order.
  setOrientations(orientations: readonly Orientation[]): void {
    const last = this.input("layout", "oblique").parentElement;
    for (const { axis, title } of orientations) {
      const label = this.input("layout", "xyz".charAt(axis)).parentElement;
      if (label === null) continue;
      part(label, "span", HTMLElement).textContent = title;
      last?.before(label);
    }
  }

  show(layout: Layout, orientations: readonly Orientation[]): void {
    this.layout = layout;
    const shown = this.shownLayout(layout, orientations);
    this.input("layout", shown).checked = true;
    this.bar.hidden = shown === "3d" && !this.isOpen;
    document.body.classList.toggle("has-bar", !this.bar.hidden);
    document.body.dataset["layout"] = shown;
    this.slicesButton.setAttribute("aria-pressed", String(shown !== "3d"));
    this.marksButton.setAttribute("aria-pressed", String(!this.bar.hidden));
  }

  showTool(tool: Tool): void {
    this.tool = tool;
    this.input("tool", tool).checked = true;
  }

  toggleSlices(): void {
    this.onLayout(this.layout === "3d" ? "all" : "3d");
  }

  // The tools alone; where slices are shown, they are there anyway.
  toggle(): void {
    if (this.layout !== "3d") return this.input("tool", this.tool).focus();
    this.isOpen = this.bar.hidden;
    this.onResize();
    if (!this.isOpen) this.onTool("crosshair");
  }

  private input(name: string, value: string): HTMLInputElement {
    const found = this.bar.querySelector(`input[name="${name}"][value="${value}"]`);
    if (!(found instanceof HTMLInputElement)) throw new Error(`index.html has no ${name} ${value}`);
    return found;
  }
}

function choice(name: string, value: string, shown: Node | string, isChosen: boolean): HTMLLabelElement {
  const input = element("input", { type: "radio", name, value });
  input.checked = isChosen;
  return element("label", {}, input, element("span", {}, shown));
}
