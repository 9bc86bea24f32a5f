// SPDX-License-Identifier: Apache-2.0
// The page around the picture: side panel or bottom sheet, help, full screen, copying the link.

import { byId } from "./dom";
import type { Toasts } from "./toasts";

const kPhone = window.matchMedia("(max-width: 720px)");
const kSwipePixels = 24;

export class Shell {
  private readonly panel = byId("panel", HTMLElement);
  private readonly toggle = byId("panel-toggle", HTMLButtonElement);
  private readonly handle = byId("sheet-handle", HTMLButtonElement);
  private readonly help = byId("help", HTMLDialogElement);

  constructor(private readonly toasts: Toasts) {
    this.setOpen(!kPhone.matches);
    kPhone.addEventListener("change", () => this.setOpen(!kPhone.matches));
    this.toggle.addEventListener("click", () => this.togglePanel());
    this.bindSwipe(this.handle, () => this.togglePanel());
    this.bindSwipe(byId("sheet-title", HTMLButtonElement), () => undefined);
    byId("help-button", HTMLButtonElement).addEventListener("click", () => this.toggleHelp());
    byId("help-close", HTMLButtonElement).addEventListener("click", () => this.help.close());
    byId("fullscreen-button", HTMLButtonElement).addEventListener("click", () => void this.toggleFullscreen());
    byId("link-button", HTMLButtonElement).addEventListener("click", () => void this.copyLink());
    this.help.addEventListener("click", (event) => {
      if (event.target === this.help) this.help.close(); // the backdrop
    });
    this.help.addEventListener("keydown", (event) => {
      if (event.key !== "h" && event.key !== "?") return;
      event.stopPropagation();
      this.help.close();
    });
  }

  openPanel(): void {
    this.setOpen(true);
  }

  togglePanel(): void {
    this.setOpen(!document.body.classList.contains("panel-open"));
  }

  toggleHelp(): void {
    if (this.help.open) this.help.close();
    else this.help.showModal();
  }

  async toggleFullscreen(): Promise<void> {
    try {
      if (document.fullscreenElement === null) await document.documentElement.requestFullscreen();
      else await document.exitFullscreen();
    } catch (error) {
      this.report("Full screen is not available here", error);
    }
  }

  async copyLink(): Promise<void> {
    const button = byId("link-button", HTMLButtonElement);
    try {
      await navigator.clipboard.writeText(location.href);
      button.classList.add("done");
      window.setTimeout(() => button.classList.remove("done"), 1500);
    } catch (error) {
      this.report("The link could not be copied; it is in the address bar", error);
    }
  }

  private setOpen(isOpen: boolean): void {
    document.body.classList.toggle("panel-open", isOpen);
    for (const button of [this.toggle, this.handle]) button.setAttribute("aria-expanded", String(isOpen));
    this.toggle.setAttribute("aria-label", isOpen ? "Hide the panel" : "Show the panel");
    // What is out of sight must be out of the tab order too.
    byId("panel-body", HTMLElement).inert = !isOpen;
    if (!isOpen) this.panel.scrollTop = 0;
  }

  // The sheet's head is pressed, or swiped up and down.
  private bindSwipe(button: HTMLButtonElement, press: () => void): void {
    let startY = 0;
    let swiped = false;
    button.addEventListener("pointerdown", (event) => {
      startY = event.clientY;
      swiped = false;
      button.setPointerCapture(event.pointerId);
    });
    button.addEventListener("pointermove", (event) => {
      const way = event.clientY - startY;
      if (swiped || !button.hasPointerCapture(event.pointerId) || Math.abs(way) < kSwipePixels) return;
      swiped = true;
      this.setOpen(way < 0);
    });
    button.addEventListener("click", (event) => {
      if (swiped) event.stopImmediatePropagation();
      else press();
      swiped = false;
    });
  }

  private report(title: string, error: unknown): void {
    this.toasts.show({ title, detail: error instanceof Error ? error.message : String(error), field: null });
  }
}
